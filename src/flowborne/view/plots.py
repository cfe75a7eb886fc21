"""Plots of numbers: curves below a picture, over time, and the cost of chains (Fig. 10)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path
from typing import IO, Any

import numpy as np
from matplotlib import rc_context
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import StrMethodFormatter

from flowborne.base.atomic import write_atomically
from flowborne.kernels.arrays import Array, Integers
from flowborne.view import style
from flowborne.view.run import Run

MAX_CURVES = 6
"""Maximum number of curves in a strip."""

LETTERS_IN_LEGEND = 60
"""Maximum number of letters of all names above a strip."""

EFFORT = "measured_effort_"
"""Prefix of the columns with the effort of named joints."""


def joint_curves(run: Run) -> tuple[str, dict[str, Array]]:
    """(title with unit, name -> values) of the controlled joints, or of all if none is controlled.

    Angles of hinges in degrees; positions of slides in m only if there is no hinge.
    """
    for kind, unit, title, factor in (
        ("angle_", "_rad", "angle (°)", 180.0 / np.pi),
        ("position_", "_m", "position (m)", 1.0),
    ):
        joints = {
            column.removeprefix(kind).removesuffix(unit): factor * values
            for column, values in run.history.items()
            if column.startswith(kind)
        }
        chosen = {name: v for name, v in joints.items() if name in run.controlled} or joints
        if chosen:
            return title, dict(list(chosen.items())[:MAX_CURVES])
    return "", {}


def objective_title(run: Run) -> str:
    """Title of the plot of the objective: its goal, its kind and its unit, if they are known."""
    tables = [
        table for table in run.tables.get("objectives", ()) if table.get("weight", 1.0) != 0.0
    ]
    title = "objective"
    if len(tables) == 1:
        title += f": {tables[0].get('goal', 'least')} {tables[0]['kind']}"
    return f"{title} ({run.objective_unit})" if run.objective_unit else title


def strip_curves(run: Run) -> list[tuple[str, dict[str, Array]]]:
    """(title, name -> values) of every strip of a run.

    They are the objective of the last decision in every frame, if there is one; the efforts of
    objectives that name their joints, unless such an effort is the whole objective; and the joints.
    """
    strips: list[tuple[str, dict[str, Array]]] = []
    terms = [column for column in run.history if column.startswith("measured_")]
    objective = run.history.get("objective")
    if objective is not None and np.isfinite(objective).any():
        strips.append((objective_title(run), {"": objective}))
    efforts = {
        column.removeprefix(EFFORT).replace("_", " "): run.history[column]
        for column in terms
        if column.startswith(EFFORT) and len(terms) > 1
    }
    if efforts:
        strips.append(("effort (N m s)", dict(list(efforts.items())[:MAX_CURVES])))
    title, joints = joint_curves(run)
    if joints:
        strips.append((title, joints))
    return strips


class Strip:
    """One strip of curves in `axes`: the whole run faint, the part up to the cursor bright.

    moving  artists that change in every frame
    """

    def __init__(self, axes: Axes, title: str, times: Array, curves: dict[str, Array]) -> None:
        self.axes = axes
        self.times = times
        self.curves = list(curves.values())
        strip_style(axes)
        axes.set_xlim(0.0, 1.01 * _span(np.append(times, 0.0))[1])
        axes.set_ylim(*robust_limits(np.concatenate(self.curves)))
        axes.set_title(title, loc="left", fontsize=8.5, color=style.MUTED, pad=4)
        self._past, self._heads = [], []
        letters = LETTERS_IN_LEGEND // max(len(curves), 1)
        for n, (name, values) in enumerate(curves.items()):
            colour = style.CURVES[n % len(style.CURVES)]
            axes.plot(times, values, color=colour, lw=1.1, alpha=0.3)
            self._past += axes.plot([], [], color=colour, lw=1.9, animated=True)
            self._past[-1].set_label(shortened(name, letters))
            self._heads += axes.plot([], [], "o", ms=4.5, mec="none", color=colour, animated=True)
        if len(curves) > 1:
            legend(axes, self._past)
        self._cursor = axes.axvline(0.0, color=style.TEXT, lw=0.9, alpha=0.7, animated=True)
        self.moving: list[Artist] = [self._cursor, *self._past, *self._heads]

    def show(self, time: float, row: int | None) -> None:
        """Move the cursor to `time`; `row` is the row of the history at that time, if any."""
        self._cursor.set_xdata([time, time])
        count = 0 if row is None else row + 1
        for values, past, head in zip(self.curves, self._past, self._heads, strict=True):
            past.set_data(self.times[:count], values[:count])
            head.set_data(self.times[max(count - 1, 0) : count], values[max(count - 1, 0) : count])


def shortened(name: str, letters: int) -> str:
    """A name of at most so many letters: an ellipsis replaces the middle of a longer one."""
    if len(name) <= letters:
        return name
    tail = (letters - 1) // 2
    return f"{name[: letters - 1 - tail]}…{name[-tail:]}"


def signed(value: float) -> str:
    """A number at the end of a colour scale, with a true minus."""
    return f"{value:.2g}".replace("-", "−")


def strip_style(axes: Axes) -> None:
    """Style axes as dark with a faint grid."""
    axes.set_facecolor(style.WATER)
    axes.grid(color=style.LINE, lw=0.6)
    axes.set_axisbelow(True)
    axes.tick_params(colors=style.MUTED, labelsize=8, length=0, pad=5)
    axes.locator_params(axis="y", nbins=4)
    axes.yaxis.set_major_formatter(StrMethodFormatter("{x:.5g}"))
    for spine in axes.spines.values():
        spine.set_color(style.LINE)
        spine.set_linewidth(0.6)


def legend(axes: Axes, handles: Sequence[Artist]) -> None:
    """Write the names of curves in one row above the axes, at the right."""
    axes.legend(
        handles=handles,
        loc="lower right",
        bbox_to_anchor=(1.0, 0.97),
        ncols=len(handles),
        frameon=False,
        fontsize=8,
        labelcolor=style.MUTED,
        handlelength=1.1,
        columnspacing=1.2,
        borderaxespad=0.0,
    )


def robust_limits(values: Array) -> tuple[float, float]:
    """Limits that show `values` except rare spikes; (-1, 1) if there are no finite values."""
    finite = values[np.isfinite(values)]
    if finite.size == 0:
        return -1.0, 1.0
    low, high = np.percentile(finite, [5.0, 95.0])
    inside = finite[(finite >= 2.0 * low - high) & (finite <= 2.0 * high - low)]
    return _span(inside if inside.size else finite, margin=0.1)


def _span(values: Array, margin: float = 0.0) -> tuple[float, float]:
    """Smallest and largest of `values` with a margin, never equal."""
    low, high = float(np.nanmin(values)), float(np.nanmax(values))
    pad = margin * (high - low)
    if high - low <= 1e-9 * max(abs(low), abs(high), 1e-300):
        pad = max(0.05 * abs(high), 1e-6)
    return low - pad, high + pad


@dataclass(frozen=True)
class ChainCost:
    """Time per frame of a chain.

    joints    number of controlled joints
    serial    s per frame, with trials in sequence
    parallel  s per frame, with trials in parallel
    """

    joints: int
    serial: float
    parallel: float


def plot_chain_cost(rows: Sequence[ChainCost], path: Path) -> None:
    """Plot seconds per frame against the number of controlled joints, as in Fig. 10.

    rows    at least two lengths of chain
    path    .png, .svg or .pdf; overwritten
    raises  ValueError for fewer than two lengths, or another format
    """
    joints = np.array([row.joints for row in rows], float)
    serial = np.array([row.serial for row in rows])
    if np.unique(joints).size < 2:
        raise ValueError(f"a line needs chains of two lengths, and these have {joints.tolist()}")
    slope, start = np.polyfit(joints, serial, 1)
    line = slope * joints + start
    deviation = float((np.abs(serial - line) / line).max())
    figure, (axes,) = _figure(1, (6.4, 4.2))
    ends = np.array([0.0, joints.max() + 0.5])
    dashes, *_ = axes.plot(
        ends,
        slope * ends + start,
        "--",
        color=style.CURVES[0],
        lw=1.2,
        alpha=0.75,
        label=f"{1e3 * slope:.3g} ms a joint, within {100.0 * deviation:.2g} %",
    )
    marks: dict[str, Any] = {"marker": "o", "ms": 7, "lw": 1.4, "mec": style.EDGE}
    parallel = np.array([row.parallel for row in rows])
    handles = [
        *axes.plot(joints, serial, ls="none", color=style.CURVES[0], label="serial", **marks),
        *axes.plot(joints, parallel, ls="-", color=style.CURVES[1], label="parallel", **marks),
        dashes,
    ]
    axes.set(xlim=ends, ylim=(0.0, None), xticks=joints)
    axes.set_xlabel("controlled joints", fontsize=9, color=style.MUTED)
    axes.set_title("seconds per frame", loc="left", fontsize=9, color=style.MUTED)
    axes.legend(handles=handles, loc="upper left", frameon=False, fontsize=9, labelcolor=style.TEXT)
    _save(figure, path)


def plot_forces(title: str, curves: dict[str, tuple[Array, Array]], path: Path) -> None:
    """Plot forces over time.

    curves  name -> times (n,) s and forces (n,) N
    path    .png, .svg or .pdf; overwritten
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
    """Plot several quantities over time, in a column of strips.

    strips  title -> name -> times (n,) s and values (n,); the same names in every strip
    path    .png, .svg or .pdf; overwritten
    """
    figure, axes = _figure(len(strips), (7.2, 0.6 + 2.0 * len(strips)))
    for strip, (title, curves) in zip(axes, strips.items(), strict=True):
        strip.set_title(title, loc="left", fontsize=9, color=style.MUTED)
        lines = [
            strip.plot(times, values, lw=1.6, color=colour, label=name)[0]
            for (name, (times, values)), colour in zip(curves.items(), style.CURVES, strict=False)
        ]
    legend(axes[0], lines)
    axes[-1].set_xlabel("time (s)", fontsize=9, color=style.MUTED)
    _save(figure, path)


class Plot(Figure):
    """A figure that notebooks show."""

    def _repr_png_(self) -> bytes:
        picture = BytesIO()
        self.savefig(picture, format="png")
        return picture.getvalue()


def plot_columns(times: Array, columns: dict[str, Array]) -> Plot:
    """Columns of a history over time, a strip for each.

    times    (n,) s
    columns  name with its unit -> (n,) values
    """
    figure, axes = _figure(len(columns), (7.2, 0.6 + 1.8 * len(columns)), Plot)
    for strip, (name, values) in zip(axes, columns.items(), strict=True):
        strip.set_title(name, loc="left", fontsize=9, color=style.MUTED)
        strip.plot(times, values, lw=1.6, color=style.CURVES[0])
    axes[-1].set_xlabel("time (s)", fontsize=9, color=style.MUTED)
    return figure


def plot_points(
    x: Array,
    y: Array,
    bars: tuple[Array | None, Array | None],
    labels: tuple[str, str],
    front: Integers,
    path: Path | str | IO[bytes],
) -> None:
    """Plot one number of many runs against another.

    x, y    (n,); nan in either leaves a point out
    bars    (n,) half widths of error bars along x and y; None without
    labels  of the axes x and y
    front   indices of points to connect, in the order of their x
    path    .png, .svg or .pdf, overwritten; or an open file, which becomes SVG
    """
    figure, (axes,) = _figure(1, (5.2, 3.6))
    ordinary = np.setdiff1d(np.arange(len(x)), front)
    best = front[np.argsort(x[front], kind="stable")]
    for rows, colour, line in ((ordinary, style.CURVES[1], ""), (best, style.CURVES[0], "-")):
        x_bar, y_bar = (None if bar is None else bar[rows] for bar in bars)
        axes.errorbar(
            x[rows],
            y[rows],
            y_bar,
            x_bar,
            fmt="o" + line,
            ms=4.0,
            lw=1.2,
            color=colour,
            mec=style.EDGE,
            mew=0.4,
            elinewidth=0.8,
        )
    axes.set_xlabel(labels[0], fontsize=9, color=style.MUTED)
    axes.set_title(labels[1], loc="left", fontsize=9, color=style.MUTED)
    if isinstance(path, str | Path):
        _save(figure, Path(path))
    else:
        with rc_context({"svg.hashsalt": "flowborne"}):
            figure.savefig(path, format="svg", metadata={"Date": None})


def _figure(
    rows: int, inches: tuple[float, float], kind: type[Figure] = Figure
) -> tuple[Any, list[Axes]]:
    figure = kind(figsize=inches, dpi=150, layout="constrained", facecolor=style.PAPER)
    axes = list(np.ravel(figure.subplots(rows, 1, sharex=True)))
    for strip in axes:
        strip_style(strip)
    return figure, axes


def _save(figure: Figure, path: Path) -> None:
    kind = path.suffix.removeprefix(".")
    if kind not in ("png", "svg", "pdf"):
        raise ValueError(f"{path} has no known format; let its name end in .png, .svg or .pdf")
    write_atomically(path, lambda file: figure.savefig(file, format=kind))
