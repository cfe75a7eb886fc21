"""The section of tools/flapping.py, inclined or sinking in a stream: `make cross-checks`.

Seen from the section both are the same flow. In the room the inclined one stays in its cells, and
the one that sinks crosses them; docs/heaving.json has the lift of both.
"""

from __future__ import annotations

import json
import math
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import trimesh

import flowborne as fb
from committed import ROOT
from flapping import outline
from markdown_text import table as markdown

FOUND = ROOT / "docs" / "heaving.json"

GRIDS = (8, 16, 32)
"""Cells a chord."""
ANGLE = 5.0
"""Of the flow against the section, degrees."""
CHORDS = 6
"""Which the stream travels; the mean over the last one counts."""

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
velocity = [1.0, 0.0]

[boundaries]
x_min = {{ kind = "far", velocity = [1.0, 0.0] }}
x_max = {{ kind = "far", velocity = [1.0, 0.0] }}
y_min = {{ kind = "far", velocity = [1.0, 0.0] }}
y_max = {{ kind = "far", velocity = [1.0, 0.0] }}

[solids]
model = "wing.xml"
density = 1.0

[[motion]]
kind = "formula"
joint = "heave"
position = "{sinking} * ({half} - t)"
"""


def lift(cells: int, incidence: float, sinking: float) -> float:
    """Lift coefficient after CHORDS of a section with an incidence (degrees) that sinks (m/s)."""
    with TemporaryDirectory() as made:
        folder = Path(made)
        ends = [np.pad(outline(), ((0, 0), (0, 1)), constant_values=z) for z in (-0.5, 0.5)]
        trimesh.convex.convex_hull(np.concatenate(ends)).export(folder / "wing.obj")
        (folder / "wing.xml").write_text(MODEL.format(turned=-incidence), encoding="utf-8")
        text = SCENE.format(
            frames=8 * CHORDS,
            steps=math.ceil(1.5 * cells / 8.0),
            resolution=6 * cells,
            sinking=sinking,
            half=0.5 * CHORDS,
        )
        (folder / "wing.toml").write_text(text, encoding="utf-8")
        lifts = []
        with fb.Simulation(folder / "wing.toml") as simulation:
            for _ in range(simulation.frames):
                simulation.advance_frame()
                lifts.append(simulation.body("wing").force[1])
    return float(np.mean(lifts[-8:])) / 0.5


def table() -> str:
    """The lift of both on each grid."""
    found = json.loads(FOUND.read_text(encoding="utf-8"))
    rows = [
        [f"{cells}", f"{still:.3f}", f"{moving:.3f}", f"{100.0 * (moving / still - 1.0):+.0f} %"]
        for cells, (still, moving) in found.items()
    ]
    head = ("cells a chord", "inclined by 5 degrees", "sinks at tan 5 degrees", "off")
    return markdown(head, rows)


def write() -> None:
    """Run both on each grid."""
    sinking = math.tan(math.radians(ANGLE))
    found = {cells: (lift(cells, ANGLE, 0.0), lift(cells, 0.0, sinking)) for cells in GRIDS}
    FOUND.write_text(json.dumps(found, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    write()
