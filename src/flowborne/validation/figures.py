"""The paper's Figs. 2, 7, 9 b, 10 and 11 with our numbers: tables, a picture and plots."""

from __future__ import annotations

import csv
import io
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

from flowborne import Simulation, load_scene
from flowborne.bench.timing import frame_times
from flowborne.exporters import write_atomically
from flowborne.machine import cores
from flowborne.pictures import ChainCost, plot_chain_cost, plot_courses, plot_forces
from flowborne.validation.blocked_arms import COLUMNS, blocked_rows, draw_frame
from flowborne.validation.controller_in_flow import SCENES, course
from flowborne.validation.flyer import flights
from flowborne.validation.reference import reference
from flowborne.validation.swimmer import swims

PAPER_SERIAL = {1: 14.0, 2: 29.0, 3: 43.0, 4: 58.0}
PAPER_PARALLEL = (14.0, 15.0)
"""s per frame in Fig. 10 on the authors' machines; parallel: least and most."""

CHAIN_FRAMES = 20
"""Frames of each chain whose median time is taken, after the first."""


def figure_names() -> tuple[str, ...]:
    """Every figure, in the paper's order."""
    return tuple(FIGURES)


def make_figures(
    out: Path, names: Sequence[str] | None = None, console: Console | None = None
) -> None:
    """Run the scenes of the paper's figures and write what they gave; print the tables.

    out      folder; made when it is not there. A figure writes figure-<name>.csv, and most a .png
    names    which; all when None
    console  where the tables are printed
    raises   ArithmeticError or BlowUpError when a run blows up, OSError when a file cannot be
             written, ValueError when this machine cannot draw in three dimensions
    """
    shown = console or Console()
    out.mkdir(parents=True, exist_ok=True)
    for name in figure_names() if names is None else names:
        FIGURES[name](out, shown)


def convergence_figure(out: Path, console: Console) -> None:
    """Fig. 2: the frame in which the block arrives, for each wind and objective."""
    paper = reference("K6", "paper frames")
    columns = (
        "run",
        "scene",
        "reached in frame",
        "stays from frame",
        "frames in the paper",
        "final angle",
        "chatter in steps",
    )
    rows = []
    for row, scene in SCENES.items():
        found = course(scene)
        stays = str(found.frames) if found.arrived else "never"
        final, chatter = f"{found.final:.1f}", f"{found.chatter:.2f}"
        rows.append((row, scene, found.reached, stays, paper[row], final, chatter))
    finish(
        "Fig. 2: frames until the block is within a step of its final angle",
        columns,
        rows,
        out / "figure-2.csv",
        console,
    )


def swimmer_figure(out: Path, console: Console) -> None:
    """Fig. 7: way up, tilt and work of the swimmer, with its jet alone, and with neither."""
    found = swims(quick=False)
    columns = ("run", "rises m", "largest tilt degrees", "work of the drives kJ")
    rows = [
        (name, f"{run.risen():.2f}", f"{run.tilt.max():.1f}", f"{1e-3 * run.work[-1]:.1f}")
        for name, run in found.items()
    ]
    finish("Fig. 7: three cycles of the swimmer", columns, rows, out / "figure-7.csv", console)
    strips = {
        "height of the head (m)": {name: (run.time, run.height) for name, run in found.items()},
        "tilt (degrees)": {name: (run.time, run.tilt) for name, run in found.items()},
        "work of the drives (kJ)": {
            name: (run.time, 1e-3 * run.work) for name, run in found.items()
        },
    }
    plot_courses(strips, out / "figure-7.png")


def arms_figure(out: Path, console: Console) -> None:
    """Fig. 9 b: the leg blocks the arm, which stays ahead, and the torso answers."""
    rows, frame = blocked_rows()
    finish("Fig. 9 b: arms in the way", COLUMNS, rows, out / "figure-9b.csv", console)
    draw_frame(frame, out / "figure-9b.png")


def chain_figure(out: Path, console: Console) -> None:
    """Fig. 10: seconds per frame of chains with 1 to 4 joints."""
    costs = [ChainCost(n, frame_seconds(n, 1), frame_seconds(n, cores())) for n in PAPER_SERIAL]
    columns = (
        "joints",
        "serial s",
        "parallel s",
        "workers",
        "serial s in the paper",
        "parallel s in the paper",
    )
    rows = [
        (
            c.joints,
            f"{c.serial:.4f}",
            f"{c.parallel:.4f}",
            cores(),
            PAPER_SERIAL[c.joints],
            "{:g} to {:g}".format(*PAPER_PARALLEL),
        )
        for c in costs
    ]
    finish("Fig. 10: seconds per frame", columns, rows, out / "figure-10.csv", console)
    plot_chain_cost(costs, out / "figure-10.png")


def flyer_figure(out: Path, console: Console) -> None:
    """Figs. 11 and 12: upward force on a flyer with and without twisting wings."""
    found = flights(quick=False)
    rows = [
        (n + 1, *(f"{value:.1f}" for pair in both for value in pair))
        for n, both in enumerate(
            zip(found["twist"].impulses(), found["base"].impulses(), strict=True)
        )
    ]
    columns = ("stroke", "down N s", "up N s", "down without N s", "up without N s")
    finish("Fig. 11: upward impulse with twist", columns, rows, out / "figure-11.csv", console)
    curves = {
        name: (flight.time, flight.lift)
        for name, flight in zip(("no control", "twist"), found.values(), strict=True)
    }
    plot_forces("upward force of the air (N)", curves, out / "figure-11.png")


def frame_seconds(joints: int, workers: int, frames: int = CHAIN_FRAMES) -> float:
    """Median time of a frame of ns-chain-`joints`, s; several workers are processes."""
    executor = "serial" if workers == 1 else "processes"
    with Simulation(load_scene(f"ns-chain-{joints}"), workers, executor) as simulation:
        return float(np.median(frame_times([simulation], frames)))


def finish(
    title: str,
    columns: Sequence[str],
    rows: Iterable[Sequence[object]],
    path: Path,
    console: Console,
) -> None:
    """Print a table and write it as CSV."""
    table = Table(*columns, title=title)
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(columns)
    for row in rows:
        table.add_row(*(str(value) for value in row))
        writer.writerow(row)
    write_atomically(path, lambda file: file.write(text.getvalue().encode("utf-8")))
    console.print(table)


FIGURES: dict[str, Callable[[Path, Console], None]] = {
    "2": convergence_figure,
    "7": swimmer_figure,
    "9b": arms_figure,
    "10": chain_figure,
    "11": flyer_figure,
}
"""Name of a figure -> what makes it."""
