"""Plots of numbers: the cost of chains (Fig. 10) and the course of a run."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from flowborne.files.atomic import write_atomically
from flowborne.view import style
from flowborne.view.strips import legend, strip_style

Array = NDArray[np.float64]


@dataclass(frozen=True)
class ChainCost:
    """What a frame of a chain costs.

    joints    controlled
    serial    s per frame, one trial after the other
    parallel  s per frame, the trials side by side
    """

    joints: int
    serial: float
    parallel: float


def straight_line(x: Array, y: Array) -> tuple[float, float, float]:
    """(slope, value at 0, largest deviation of y from the line as a share of the line's value).

    The line is that of least squares.
    raises  ValueError when fewer than two different x are given
    """
    if np.unique(x).size < 2:
        raise ValueError(f"a line needs two different x, and x is {np.asarray(x).tolist()}")
    slope, start = np.polyfit(x, y, 1)
    line = slope * np.asarray(x, float) + start
    return float(slope), float(start), float(np.max(np.abs(np.asarray(y) - line) / np.abs(line)))


def plot_chain_cost(rows: Sequence[ChainCost], path: Path) -> None:
    """Plot seconds per frame against the number of controlled joints, as Fig. 10 has it.

    rows    at least two lengths of chain
    path    .png, .svg or .pdf; made anew
    raises  ValueError when there are fewer than two lengths, or no such format
    """
    joints = np.array([row.joints for row in rows], float)
    serial = np.array([row.serial for row in rows])
    slope, start, off = straight_line(joints, serial)
    figure, axes = _figure(1, (6.4, 4.2))
    ends = np.array([0.0, joints.max() + 0.5])
    dashes, *_ = axes[0].plot(
        ends,
        slope * ends + start,
        "--",
        color=style.CURVES[0],
        lw=1.2,
        alpha=0.75,
        label=f"{1e3 * slope:.3g} ms a joint, within {100.0 * off:.2g} %",
    )
    handles = [dashes]
    for n, (name, seconds) in enumerate(
        (("serial", serial), ("parallel", np.array([row.parallel for row in rows])))
    ):
        handles += axes[0].plot(
            joints,
            seconds,
            linestyle="-" if name == "parallel" else "none",
            marker="o",
            ms=7,
            lw=1.4,
            color=style.CURVES[n],
            mec=style.EDGE,
            label=name,
        )
    axes[0].set(xlim=ends, ylim=(0.0, None), xticks=joints)
    axes[0].set_xlabel("controlled joints", fontsize=9, color=style.MUTED)
    axes[0].set_title("seconds per frame", loc="left", fontsize=9, color=style.MUTED)
    axes[0].legend(
        handles=[*handles[1:], dashes],
        loc="upper left",
        frameon=False,
        fontsize=9,
        labelcolor=style.TEXT,
    )
    _save(figure, path)


def plot_forces(title: str, curves: dict[str, tuple[Array, Array]], path: Path) -> None:
    """Plot forces over time.

    curves  name -> times (n,) s and forces (n,) N
    path    .png, .svg or .pdf; made anew
    """
    figure, (axes,) = _figure(1, (8.4, 3.6))
    handles = []
    for n, (name, (times, force)) in enumerate(curves.items()):
        handles += axes.plot(times, force, color=style.CURVES[n], lw=1.3, label=name)
    low, high = np.percentile(np.concatenate([f for _, f in curves.values()]), [0.5, 99.5])
    axes.set(xlim=(0.0, None), ylim=(1.1 * low, 1.1 * high))
    axes.set_xlabel("time (s)", fontsize=9, color=style.MUTED)
    axes.set_title(title, loc="left", fontsize=9, color=style.MUTED)
    legend(axes, handles)
    _save(figure, path)


def plot_courses(strips: dict[str, dict[str, tuple[Array, Array]]], path: Path) -> None:
    """Plot several quantities over time, one below the other.

    strips  title -> name -> times (n,) s and values (n,); the same names in every strip
    path    .png, .svg or .pdf; made anew
    """
    figure, axes = _figure(len(strips), (7.2, 0.6 + 2.0 * len(strips)))
    for place, (title, curves) in zip(axes, strips.items(), strict=True):
        place.set_title(title, loc="left", fontsize=9, color=style.MUTED)
        lines = [
            place.plot(times, values, lw=1.6, color=colour, label=name)[0]
            for (name, (times, values)), colour in zip(curves.items(), style.CURVES, strict=False)
        ]
    legend(axes[0], lines)
    axes[-1].set_xlabel("time (s)", fontsize=9, color=style.MUTED)
    _save(figure, path)


def _figure(rows: int, inches: tuple[float, float]) -> tuple[Figure, list[Axes]]:
    figure = Figure(figsize=inches, dpi=150, layout="constrained", facecolor=style.PAPER)
    axes = list(np.ravel(figure.subplots(rows, 1, sharex=True)))
    for place in axes:
        strip_style(place)
    return figure, axes


def _save(figure: Figure, path: Path) -> None:
    kind = path.suffix.removeprefix(".")
    if kind not in ("png", "svg", "pdf"):
        raise ValueError(f"{path} has no known format; let its name end in .png, .svg or .pdf")
    write_atomically(path, lambda file: figure.savefig(file, format=kind))
