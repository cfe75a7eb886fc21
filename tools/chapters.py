"""Draws pictures of chapters of the method: `make chapters`."""

from __future__ import annotations

from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Ellipse, Rectangle

from flowborne import Grid, make_world
from flowborne.worlds import cut_by_bodies

FOLDER = Path(__file__).parents[1] / "docs" / "method"
CELLS, RADII, TURN = (12, 8), (3.2, 1.5), 25.0
"""Grid of the picture; half axes (cells) of its body, and its angle (degrees)."""

ITEMS = (
    (0.0, "1  half of the last pressure"),
    (0.5, "2  bodies move with $v^{n+1/2}$"),
    (1.0, "3  the grid is cut at $q^{n+1}$"),
    (0.5, "4  leak-proof field $Q_f$"),
    (0.5, "5  advection and known forces: $u^*$, $v^*$"),
    (1.0, "6  viscosity, pressure and bodies: $u^{n+1}$, $v^{n+3/2}$"),
    (1.0, "7  the state is stored"),
)
"""Place in the step, and what happens there."""

MODEL = """<mujoco><worldbody><body pos="6 4 0" euler="0 0 {turn}">
<geom type="ellipsoid" size="{long} {short} 9"/></body></worldbody></mujoco>"""


def cut_cells(axes: Axes) -> None:
    """The open part of each cell and face around an ellipse, as a step has them."""
    nx, ny = CELLS
    text = MODEL.format(turn=TURN, long=RADII[0], short=RADII[1])
    cut = cut_by_bodies(make_world(text, Grid.slab(nx, ny, 1.0, (0, 0))))
    cells = cut.volume[:, :, 0]
    for i, j in np.ndindex(nx, ny):
        shade = 0.15 + 0.85 * cells[i, j]
        axes.add_patch(Rectangle((i, j), 1, 1, fc=plt.cm.Blues(0.6 * shade), ec="none"))
        if 0.0 < cells[i, j] < 1.0:
            axes.text(i + 0.5, j + 0.5, f"{cells[i, j]:.2f}", ha="center", va="center", size=6)
    axes.add_patch(
        Ellipse((6, 4), 2 * RADII[0], 2 * RADII[1], angle=TURN, fc="none", ec="#d98a00", lw=2)
    )
    across, along = (faces[:, :, 0] for faces in cut.open[:2])
    for i, j in np.ndindex(across.shape):
        axes.plot([i, i], [j, j + 1], color="black", lw=1.4 * across[i, j], alpha=0.7)
    for i, j in np.ndindex(along.shape):
        axes.plot([i, i + 1], [j, j], color="black", lw=1.4 * along[i, j], alpha=0.7)
    axes.set(xlim=(0, nx), ylim=(0, ny), aspect="equal")


def step(axes: Axes) -> None:
    """The items of a step, each at its time."""
    axes.axhline(0.0, color="black", lw=1)
    for time, label in ((0.0, "$t^n$"), (0.5, "$t^{n+1/2}$"), (1.0, "$t^{n+1}$")):
        axes.plot([time, time], [0.0, -len(ITEMS) - 0.6], color="black", lw=0.6, alpha=0.25)
        axes.text(time, 0.35, label, ha="center")
    for row, (time, said) in enumerate(ITEMS, 1):
        axes.plot(time, -row, "o", color="#2a6fb0", ms=5)
        left = time > 0.6
        place, side = (time - 0.03, "right") if left else (time + 0.03, "left")
        axes.text(place, -row, said, va="center", ha=side)
    axes.set(xlim=(-0.08, 1.08), ylim=(-len(ITEMS) - 0.6, 0.9))


PICTURES = {"cut-cells": cut_cells, "step": step}
"""Name of a chapter -> what draws its picture."""


def write(name: str) -> None:
    """Draw a picture of this module as docs/method/NAME.svg."""
    with plt.rc_context({"svg.hashsalt": "flowborne", "svg.fonttype": "none", "font.size": 9.0}):
        figure, axes = plt.subplots(figsize=(5.6, 3.4), layout="constrained")
        PICTURES[name](axes)
        axes.axis("off")
        figure.savefig(FOLDER / f"{name}.svg", metadata={"Date": None}, transparent=True)
        plt.close(figure)


if __name__ == "__main__":
    for name in PICTURES:
        write(name)
