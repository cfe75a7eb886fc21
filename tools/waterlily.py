"""The sphere of WaterLily's validation, in its box on coarser grids: `make cross-checks`.

Figures of WaterLily are from its paper, and of the cylinder from an issue of its repository; those
of flowborne are from runs, in docs/waterlily.json, and from the committed report.
"""

from __future__ import annotations

import json
import math
from pathlib import Path
from tempfile import TemporaryDirectory
from time import process_time
from typing import Any

import flowborne as fb
from accuracy import finding_of
from committed import REPORT, ROOT, number
from flowborne_validation.report import grid_of, read_report
from markdown_text import table

FOUND = ROOT / "docs" / "waterlily.json"

REYNOLDS = 3700
GRIDS = (8, 12)
"""Cells a diameter."""
START, END = 20.0, 60.0
"""Of the mean, in times in which the stream passes a diameter."""

PAPER = "[paper](https://doi.org/10.1016/j.cpc.2025.109748), section 4"
ISSUE = "[issue 293](https://github.com/WaterLily-jl/WaterLily.jl/issues/293), by a user"

MODEL = '<mujoco><worldbody><body name="sphere"><geom size="0.5"/></body></worldbody></mujoco>'

SCENE = """description = "a sphere in a stream"
dimensions = 3

[time]
frames_per_second = 4.0
frames = {frames}
steps_per_frame = {steps}

[domain]
lower = [-1.5, -1.5, -1.5]
upper = [5.5, 1.5, 1.5]
resolution = {resolution}

[fluid]
density = 1.0
viscosity = {viscosity}
velocity = [1.0, 0.0, 0.0]

[boundaries]
x_min = {{ kind = "inflow", velocity = [1.0, 0.0, 0.0] }}
x_max = "open"

[solids]
model = "sphere.xml"
density = 1.0
"""


def sphere(cells: int) -> dict[str, Any]:
    """Mean drag coefficient of the sphere on so many cells a diameter, cells, seconds of a core."""
    with TemporaryDirectory() as folder:
        (Path(folder) / "sphere.xml").write_text(MODEL, encoding="utf-8")
        text = SCENE.format(
            frames=round(4.0 * END),
            steps=math.ceil(1.5 * cells / 4.0),
            resolution=7 * cells,
            viscosity=1.0 / REYNOLDS,
        )
        (Path(folder) / "sphere.toml").write_text(text, encoding="utf-8")
        start, drags = process_time(), []
        with fb.Simulation(Path(folder) / "sphere.toml") as simulation:
            for _ in range(simulation.frames):
                simulation.advance_frame()
                if simulation.time > START:
                    drags.append(simulation.body("sphere").force[0])
            count = math.prod(simulation.world.flow()[0].grid.shape)
    drag = float(sum(drags) / len(drags) / (0.5 * math.pi / 4.0))
    return {"drag": drag, "cells": count, "seconds": process_time() - start}


def figures() -> str:
    """WaterLily's figures and flowborne's, with the grid of each and the figure of a third."""
    found = json.loads(FOUND.read_text(encoding="utf-8"))
    rows = [
        ["sphere, Re 3700, 7 x 3 x 3 D: drag coefficient", "WaterLily", "88 to 168", "0.45", PAPER],
        ["", "WaterLily, 7 x 6 x 6 D", "88", "0.38", PAPER],
    ]
    for cells, one in found["sphere"].items():
        where = f"flowborne, {one['cells']:,} cells in all, {one['seconds']:.0f} s of a core"
        rows.append(["", where, cells, f"{one['drag']:.2f}", f"`{found['version']}`"])
    report = read_report(REPORT)
    for what, quantity, own, volume in (
        ("largest drag coefficient", "cD max", "2.994", "3.210"),
        ("largest lift coefficient", "cL max", "0.941", "0.975"),
    ):
        ours = finding_of(report, "B2", quantity)
        rows += [
            [
                f"cylinder in a channel, Re 100: {what}",
                "WaterLily, on its surface",
                "160",
                own,
                ISSUE,
            ],
            ["", "WaterLily, by a control volume", "160", volume, ISSUE],
            ["", "flowborne", grid_of(ours).split()[0], number(ours["value"]), "case B2"],
            ["", "reference of B2", "", number(ours["reference"]), "Schäfer and Turek 1996"],
        ]
    return table(("case", "program", "cells a diameter", "value", "source"), rows)


def write() -> None:
    """Run the sphere on each grid, and keep what it gives."""
    runs = {str(cells): sphere(cells) for cells in GRIDS}
    FOUND.write_text(
        json.dumps({"version": fb.__version__, "sphere": runs}, indent=1) + "\n", encoding="utf-8"
    )


if __name__ == "__main__":
    write()
