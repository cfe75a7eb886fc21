"""What colours and arrows stand for, as HTML."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape

import numpy as np

from flowborne.view import style
from flowborne.view.arrows import round_number
from flowborne.view.fields import Scale
from flowborne.view.forces import Forces

STOPS = 24
"""Colours of which the bar of a scale is made."""

ARROW = 60.0
"""Length of the arrow of a large force in the legend, pixels."""


def legend_html(
    names: Sequence[tuple[str, str]], scales: Sequence[Scale], forces: Forces | None
) -> str:
    """The legend.

    names   (name, colour) of what has a colour of its own
    scales  of colours
    forces  whose arrows are shown, if any
    """
    rows = [_named(name, colour) for name, colour in names]
    rows += [_bar(scale) for scale in scales]
    if forces is not None and forces.large > 0.0:
        rows.append(_force(forces))
    body = "".join(f'<div style="margin:0 0 8px">{row}</div>' for row in rows)
    return f'<div style="padding:6px 12px 0;font-size:13px;line-height:1.4">{body}</div>'


def _named(name: str, colour: str) -> str:
    dot = f"display:inline-block;width:11px;height:11px;border-radius:6px;background:{colour}"
    return f'<span style="{dot};margin-right:8px"></span>{escape(name)}'


def _bar(scale: Scale) -> str:
    colours, low, high, name = scale
    picked = colours[np.linspace(0, len(colours) - 1, STOPS).round().astype(int)]
    stops = ",".join(f"rgb({r},{g},{b})" for r, g, b in np.rint(255.0 * picked).astype(int))
    bar = f"height:11px;border-radius:3px;background:linear-gradient(to right,{stops})"
    ends = f"<span>{_number(low)}</span><span>{_number(high)}</span>"
    between = "display:flex;justify-content:space-between;font-variant-numeric:tabular-nums"
    return f'{escape(name)}<div style="{bar}"></div><div style="{between}">{ends}</div>'


def _force(forces: Forces) -> str:
    force = round_number(forces.large)
    length = ARROW * force / forces.large
    line = (
        f"display:inline-block;vertical-align:middle;height:3px;width:{length:.0f}px;"
        f"background:{style.FORCE}"
    )
    head = (
        "display:inline-block;vertical-align:middle;border:5px solid transparent;"
        f"border-left:9px solid {style.FORCE};border-right:0;margin-right:8px"
    )
    what = f"force on a body: {force:g} {forces.unit}"
    return f'<span style="{line}"></span><span style="{head}"></span>{what}'


def _number(value: float) -> str:
    return f"{value:.2g}".replace("-", "−")
