"""The section of tools/flapping.py, held or sinking in a stream: `make cross-checks`.

An inclined section, a level one in a stream that rises and a level one that sinks have the same
flow, seen from the section. docs/heaving.json has the lift of each from several places in a cell.
"""

from __future__ import annotations

import json
import math
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

import flowborne as fb
from committed import ROOT
from flapping import write_mesh
from markdown_text import table as markdown

FOUND = ROOT / "docs" / "heaving.json"

GRIDS = (8, 16, 32)
"""Cells a chord."""
ANGLE = 5.0
"""Of the flow against the section, degrees."""
CHORDS = 6
"""Which the stream travels; the mean over the last one counts."""
PLACES = 4
"""At which the section starts in a cell, evenly across the stream."""

MODEL = """<mujoco>
  <asset><mesh name="wing" file="wing.obj"/></asset>
  <worldbody>
    <body name="wing">
      <joint name="heave" type="slide" axis="0 1 0"/>
      <geom type="mesh" mesh="wing" euler="0 0 {turned}" contype="0" conaffinity="0"/>
    </body>
  </worldbody>
</mujoco>
"""

SCENE = """description = "a section in a stream"
dimensions = 2

[time]
frames_per_second = 8.0
frames = {frames}
steps_per_frame = {steps}

[domain]
lower = [-2.0, -2.5]
upper = [4.0, 2.5]
resolution = {resolution}

[fluid]
density = 1.0
velocity = [1.0, {rising}]

[boundaries]
x_min = {{ kind = "far", velocity = [1.0, {rising}] }}
x_max = {{ kind = "far", velocity = [1.0, {rising}] }}
y_min = {{ kind = "far", velocity = [1.0, {rising}] }}
y_max = {{ kind = "far", velocity = [1.0, {rising}] }}

[solids]
model = "wing.xml"
density = 1.0

[[motion]]
kind = "formula"
joint = "heave"
position = "{place} + {sinking} * ({half} - t)"
"""


def lift(cells: int, incidence: float, rising: float, sinking: float, place: float) -> float:
    """Lift coefficient after CHORDS of a section with an incidence (degrees) that sinks (m/s) in a
    stream that rises (m/s), from a place across the stream (cells)."""
    with TemporaryDirectory() as made:
        folder = Path(made)
        write_mesh(folder / "wing.obj", 2, (-0.5, 0.5))
        (folder / "wing.xml").write_text(MODEL.format(turned=-incidence), encoding="utf-8")
        text = SCENE.format(
            frames=8 * CHORDS,
            steps=math.ceil(1.5 * cells / 8.0),
            resolution=6 * cells,
            rising=rising,
            sinking=sinking,
            half=0.5 * CHORDS,
            place=place / cells,
        )
        (folder / "wing.toml").write_text(text, encoding="utf-8")
        lifts = []
        with fb.Simulation(folder / "wing.toml") as simulation:
            for _ in range(simulation.frames):
                simulation.advance_frame()
                lifts.append(simulation.body("wing").force[1])
    return float(np.mean(lifts[-8:])) / 0.5


def table() -> str:
    """Mean, least and largest lift over the places, of each section on each grid."""
    found = json.loads(FOUND.read_text(encoding="utf-8"))
    rows = [
        [cells, *(f"{np.mean(v):.2f} ({min(v):.2f} to {max(v):.2f})" for v in lifts.values())]
        for cells, lifts in found.items()
    ]
    return markdown(("cells a chord", *next(iter(found.values()))), rows)


def write() -> None:
    """Run each on each grid from each place."""
    slope = math.tan(math.radians(ANGLE))
    sections = {
        "held, inclined": (ANGLE, 0.0, 0.0),
        "held, the stream rises": (0.0, slope, 0.0),
        "sinks": (0.0, 0.0, slope),
    }
    places = [n / PLACES for n in range(PLACES)]
    found = {
        cells: {
            name: [round(lift(cells, *section, place), 4) for place in places]
            for name, section in sections.items()
        }
        for cells in GRIDS
    }
    FOUND.write_text(json.dumps(found, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    write()
