"""A rigid wing that flaps in a stream, beside Ptera Software's vortex lattice: `make cross-checks`.

That makes an environment with Ptera Software (`pip install pterasoftware`, Python 3.11 to 3.13),
runs the wing in both, and writes docs/flapping.json and docs/flapping.svg.
"""

from __future__ import annotations

import json
import math
import subprocess
import sys
from dataclasses import asdict, dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from time import process_time
from typing import Any

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
import trimesh

import flowborne as fb
from committed import ROOT
from flowborne.kernels.arrays import Array
from markdown_text import table as markdown

FOUND, PICTURE = ROOT / "docs" / "flapping.json", ROOT / "docs" / "flapping.svg"

LOWER, UPPER = (-1.5, -1.0, -1.5), (3.5, 5.0, 1.5)
"""Corners of the room in chords; its sides are far."""
GRIDS = (8, 12)
"""Cells a chord."""


@dataclass(frozen=True)
class Wing:
    """A rectangular wing about an axis along the stream, from which its root is `root` away.

    chord, span, root      m
    incidence, amplitude   degrees
    reduced                reduced frequencies, omega chord / (2 speed)
    beats                  of a run, the last of which counts
    chordwise, spanwise    panels of the lattice
    """

    foil: str = "naca0018"
    chord: float = 1.0
    span: float = 3.0
    root: float = 0.5
    incidence: float = 5.0
    amplitude: float = 10.0
    density: float = 1.0
    speed: float = 1.0
    reduced: tuple[float, ...] = (0.2, 0.4, 0.6)
    beats: int = 2
    chordwise: int = 8
    spanwise: int = 12

    @property
    def unit(self) -> float:
        """Lift at a coefficient of one, N."""
        return 0.5 * self.density * self.speed**2 * self.chord * self.span

    def period(self, reduced: float) -> float:
        """Time of a beat, s."""
        return math.pi * self.chord / (reduced * self.speed)


WING = Wing()

MODEL = """<mujoco>
  <asset><mesh name="wing" file="wing.obj"/></asset>
  <worldbody>
    <body name="wing">
      <joint name="flap" axis="1 0 0"/>
      <geom type="mesh" mesh="wing" euler="0 {incidence} 0" contype="0" conaffinity="0"/>
    </body>
  </worldbody>
</mujoco>
"""

SCENE = """description = "a rigid wing flaps in a stream"
dimensions = 3

[time]
frames_per_second = 8.0
frames = {frames}
steps_per_frame = {steps}

[domain]
lower = {lower}
upper = {upper}
resolution = {resolution}

[fluid]
density = {density}
velocity = [{speed}, 0.0, 0.0]

[boundaries]
{sides}

[solids]
model = "wing.xml"
density = 1.0

[[motion]]
kind = "sinusoid"
joint = "flap"
amplitude = {amplitude}
period = {period}
"""


def outline(points: int = 40) -> Array:
    """(n, 2) points of NACA 0018, of chord 1, with a closed trailing edge."""
    x = 0.5 * (1.0 - np.cos(np.linspace(0.0, np.pi, points)))
    shape = 0.2969 * np.sqrt(x) - 0.126 * x - 0.3516 * x**2 + 0.2843 * x**3 - 0.1036 * x**4
    upper = np.stack([x, 5.0 * 0.18 * shape], axis=1)
    return np.concatenate([upper, upper[1:-1] * (1.0, -1.0)])


def write_mesh(path: Path, axis: int, ends: tuple[float, float]) -> None:
    """The section as a mesh that spans from one place along an axis to another, m."""
    section = WING.chord * outline()
    points = np.concatenate([np.insert(section, axis, end, axis=1) for end in ends])
    trimesh.convex.convex_hull(points).export(path)


def write_scene(folder: Path, reduced: float, cells: int) -> Path:
    """Scene, model and mesh of the wing, with cells across its chord."""
    write_mesh(folder / "wing.obj", 1, (WING.root, WING.root + WING.span))
    (folder / "wing.xml").write_text(MODEL.format(incidence=WING.incidence), encoding="utf-8")
    far = f'{{ kind = "far", velocity = [{WING.speed}, 0.0, 0.0] }}'
    longest = max(np.subtract(UPPER, LOWER))
    text = SCENE.format(
        frames=round(8.0 * WING.beats * WING.period(reduced)),
        steps=math.ceil(1.5 * cells / 8.0),
        lower=list(LOWER),
        upper=list(UPPER),
        resolution=round(longest * cells),
        density=WING.density,
        speed=WING.speed,
        sides="\n".join(f"{axis}_{end} = {far}" for axis in "xyz" for end in ("min", "max")),
        amplitude=WING.amplitude,
        period=WING.period(reduced),
    )
    (folder / "wing.toml").write_text(text, encoding="utf-8")
    return folder / "wing.toml"


def room(reduced: float, cells: int) -> dict[str, Any]:
    """The wing in a room of ideal fluid: lift over the beats, cells, seconds of a core."""
    with TemporaryDirectory() as made:
        scene = write_scene(Path(made), reduced, cells)
        times, lifts, start = [], [], process_time()
        with fb.Simulation(scene) as simulation:
            for _ in range(simulation.frames):
                simulation.advance_frame()
                times.append(simulation.time - 0.5 * simulation.frame_time)
                lifts.append(float(simulation.body("wing").force[2]))
            count = math.prod(simulation.world.flow()[0].grid.shape)
    seconds = process_time() - start
    return {"times": times, "lifts": lifts, "seconds": seconds, "cells": count}


def lattice(python: Path) -> dict[str, Any]:
    """The wing by Ptera Software, in the environment of a Python that has it."""
    command = [str(python), str(ROOT / "tools" / "flapping_lattice.py"), json.dumps(asdict(WING))]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    answer: dict[str, Any] = json.loads(done.stdout.splitlines()[-1])
    return answer


def last_beat(run: dict[str, Any], reduced: float) -> tuple[Array, Array]:
    """Times in the last beat, in beats, and the lift coefficient then."""
    phase = np.asarray(run["times"]) / WING.period(reduced) - (WING.beats - 1)
    inside = phase >= 0.0
    return phase[inside], np.asarray(run["lifts"])[inside] / WING.unit


def harmonic(run: dict[str, Any], reduced: float) -> tuple[float, float, float]:
    """Mean of the lift coefficient, and amplitude and lead (degrees, before the flap angle) of its
    first harmonic, by least squares."""
    phase, lift = last_beat(run, reduced)
    angle = 2.0 * np.pi * phase
    matrix = np.stack([np.ones_like(angle), np.sin(angle), np.cos(angle)], axis=1)
    mean, sine, cosine = np.linalg.lstsq(matrix, lift, rcond=None)[0]
    return float(mean), math.hypot(sine, cosine), math.degrees(math.atan2(cosine, sine))


def table() -> str:
    """The lift by the lattice and in the rooms, with cells and seconds."""
    found = json.loads(FOUND.read_text(encoding="utf-8"))
    rows = []
    for reduced in WING.reduced:
        sheet = found["lattice"]["runs"][f"{reduced:g}"]
        panels = f"{WING.chordwise} x {WING.spanwise} panels"
        mean, amplitude, lead = harmonic(sheet, reduced)
        said = [f"{mean:.3f}", f"{amplitude:.3f}", "", f"{lead:.0f}°", f"{sheet['seconds']:.0f}"]
        rows.append([f"{reduced:g}", f"lattice, {panels}", *said])
        for cells in GRIDS:
            run = found["rooms"][f"{reduced:g}"][str(cells)]
            own, height, phase = harmonic(run, reduced)
            off = f"{100.0 * (height / amplitude - 1.0):+.0f} %"
            said = [f"{own:.3f}", f"{height:.3f}", off, f"{phase:.0f}°", f"{run['seconds']:.0f}"]
            rows.append(["", f"{cells} cells a chord, {run['cells']:,} in all", *said])
    head = ("k", "", "mean", "amplitude", "off", "lead", "seconds of a core")
    note = f"Ptera Software {found['lattice']['version']}; flowborne `{found['version']}`."
    return f"{markdown(head, rows)}\n{note}"


def draw(found: dict[str, Any]) -> None:
    """The lift over the last beat, a panel for each reduced frequency."""
    figure, panels = plt.subplots(1, len(WING.reduced), figsize=(10.0, 3.4), sharey=True)
    for panel, reduced in zip(panels, WING.reduced, strict=True):
        sheet = found["lattice"]["runs"][f"{reduced:g}"]
        panel.plot(*last_beat(sheet, reduced), color="black", label="vortex lattice")
        for cells, style in zip(GRIDS, (":", "-"), strict=True):
            run = found["rooms"][f"{reduced:g}"][str(cells)]
            label = f"flowborne, {cells} cells a chord"
            panel.plot(*last_beat(run, reduced), style, color="#1f77b4", label=label)
        panel.set(title=f"k = {reduced:g}", xlabel="time / beat", xlim=(0.0, 1.0))
        panel.grid(alpha=0.3)
    panels[0].set_ylabel("lift coefficient")
    panels[0].legend(frameon=False, fontsize=8)
    figure.tight_layout()
    figure.savefig(PICTURE, metadata={"Date": None})
    plt.close(figure)


def write(python: Path) -> None:
    """Run the wing in both programs, and write what they give."""
    rooms = {f"{k:g}": {str(cells): room(k, cells) for cells in GRIDS} for k in WING.reduced}
    found = {"version": fb.__version__, "lattice": lattice(python), "rooms": rooms}
    FOUND.write_text(json.dumps(rounded(found)) + "\n", encoding="utf-8")
    draw(found)


def rounded(value: Any) -> Any:
    """What goes into the file: numbers of five digits."""
    if isinstance(value, dict):
        return {key: rounded(one) for key, one in value.items()}
    if isinstance(value, list):
        return [rounded(one) for one in value]
    return float(f"{value:.5g}") if isinstance(value, float) else value


if __name__ == "__main__":
    write(Path(sys.argv[1]))
