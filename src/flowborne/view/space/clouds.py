"""What is seen of a fluid in space: dye, or where it turns, as colour and density of each cell."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from flowborne.fluid.grid import Grid
from flowborne.view import style
from flowborne.view.fields import full_strength
from flowborne.view.run import Run, State
from flowborne.view.space.camera import TOWARD

Array = NDArray[np.float64]
Pixels = NDArray[np.uint8]

SAMPLES = 12
"""Frames from which the scale of a film is taken."""

STRONG = 95.0
"""Percentile of the vorticity's size at which its smoke is thickest."""

FAINT = 0.3
"""Share of that size below which nothing is seen of it."""


class Cloud(Protocol):
    """What is shown of the fluid.

    legend  (name, colour) of each thing shown
    """

    legend: Sequence[tuple[str, str]]

    def voxels(self, state: State) -> Pixels:
        """(nx, ny, nz, 4) colour and density of the cells."""
        ...


def cloud_of(run: Run) -> Cloud | None:
    """What the scene of `run` wants to see of its fluid; None when there is nothing to see."""
    if run.grid is None or run.picture == "none":
        return None
    dyes = [name for name in run.state(0) if name.startswith("scalar_")]
    return CloudDye(run, dyes) if run.picture == "dye" and dyes else CloudVorticity(run)


class CloudDye:
    """Carried dyes, each in a colour of its own, mixed where they meet."""

    def __init__(self, run: Run, dyes: Sequence[str]) -> None:
        sampled = run.sampled(SAMPLES)
        self._full = {dye: full_strength([state[dye] for state in sampled]) for dye in dyes}
        colours = [style.DYES[n % len(style.DYES)] for n in range(len(dyes))]
        self._colours = dict(zip(dyes, map(style.rgb, colours), strict=True))
        names = [dye.removeprefix("scalar_") for dye in dyes]
        self.legend: Sequence[tuple[str, str]] = list(zip(names, colours, strict=True))

    def voxels(self, state: State) -> Pixels:
        colour: Array = np.zeros((*state["open"].shape, 3), np.float32)
        weight: Array = np.zeros(state["open"].shape, np.float32)
        for dye, own in self._colours.items():
            strength = np.clip(np.nan_to_num(state[dye]) / self._full[dye], 1e-6, 1.0)
            colour += strength[..., None] * own.astype(np.float32)
            weight += strength
        return _voxels(colour / weight[..., None], np.minimum(weight, 1.0) * state["open"])


class CloudVorticity:
    """Where the fluid turns: warm counter-clockwise as the camera sees it, cold clockwise.

    limit  1/s, size of the vorticity at which the smoke is thickest
    """

    legend: Sequence[tuple[str, str]] = (
        ("vorticity, counter-clockwise", style.SPIN_LEFT[1]),
        ("clockwise", style.SPIN_RIGHT[1]),
    )

    def __init__(self, run: Run) -> None:
        assert run.grid is not None
        self._grid = run.grid
        sizes = [
            np.linalg.norm(vorticity(s, run.grid), axis=-1).ravel() for s in run.sampled(SAMPLES)
        ]
        self.limit = max(float(np.percentile(np.concatenate(sizes), STRONG)), 1e-12)

    def voxels(self, state: State) -> Pixels:
        spin = vorticity(state, self._grid)
        size = np.linalg.norm(spin, axis=-1)
        density = np.clip((size / self.limit - FAINT) / (1.0 - FAINT), 0.0, 1.0)
        left = np.clip(0.5 + (spin @ TOWARD) / np.maximum(size, 1e-12), 0.0, 1.0)[..., None]
        warm, cold = style.rgb(style.SPIN_LEFT[1]), style.rgb(style.SPIN_RIGHT[1])
        return _voxels(cold + left * (warm - cold), density * state["open"])


def vorticity(state: State, grid: Grid) -> Array:
    """(nx, ny, nz, 3) curl of the velocity in the cells, 1/s; 0 where a number is lost."""
    u, v, w = (
        0.5 * (np.delete(faces, 0, axis) + np.delete(faces, -1, axis))
        for axis, faces in enumerate(state[f"velocity_{name}"] for name in "xyz")
    )
    (_, uy, uz), (vx, _, vz), (wx, wy, _) = (np.gradient(c, grid.spacing) for c in (u, v, w))
    return np.nan_to_num(np.stack([wy - vz, uz - wx, vx - uy], axis=-1))


def _voxels(colour: Array, density: Array) -> Pixels:
    return np.rint(255.0 * np.concatenate([colour, density[..., None]], axis=-1)).astype(np.uint8)
