"""Numbers of the cells of a fluid, as pictures need them: filled, refined, and their scale."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from flowborne.fluid.grid import Grid
from flowborne.view.run import State

Array = NDArray[np.float64]

ROBUST = 98.5
"""Percentile of a quantity's size at which its colours are strongest."""

STRONG = 75.0
"""Percentile of a dye's values above half the largest at which it has its full colour."""

TURNING = 0.4
"""Part of all circulation, the sum of the sizes of vorticity, that is stronger than its scale."""

UNCUT = 0.999
"""Open part of a cell from which on no body cuts it."""

FINE = 256
"""Points along the longer side of a field that values are refined to at least."""

FILLED, FILLED_SLOPES = 2, 4
"""Layers of cells into a body that continue the fluid: of its values, and of their differences,
which cut cells do not have."""


def speed(state: State) -> Array:
    """(nx, ny, nz) size of the velocity in the cells, m/s."""
    parts = [
        0.5 * (np.delete(faces, 0, axis) + np.delete(faces, -1, axis))
        for axis, faces in enumerate(state.get(f"velocity_{name}") for name in "xyz")
        if faces is not None
    ]
    return np.asarray(np.sqrt(sum(part.astype(float) ** 2 for part in parts)))


def pressure(state: State) -> Array:
    """(nx, ny, nz) pressure in the cells about its mean in the fluid, Pa."""
    values = state["pressure"].astype(float)
    known = values[in_fluid(state)]
    return np.asarray(values - (known[np.isfinite(known)].mean() if known.size else 0.0))


def in_fluid(state: State) -> NDArray[np.bool_]:
    """(nx, ny, nz) cells that are mostly open."""
    return np.asarray(state["open"] > 0.5)


def vorticity(state: State, grid: Grid) -> Array:
    """(nx, ny) vorticity about z at the cell centres, 1/s; bodies continue their neighbours.

    The corners' values dv/dx - du/dy are averaged; the outermost corners take those next to them.
    A corner of a cell that a body cuts does not count: faces that are partly closed carry a flux,
    and no velocity that could be differentiated.
    """
    u, v = state["velocity_x"][:, :, 0], state["velocity_y"][:, :, 0]
    corners = (np.diff(v[:, 1:-1], axis=0) - np.diff(u[1:-1], axis=1)) / grid.spacing
    whole = state["open"][:, :, 0] > UNCUT
    counted = np.isfinite(corners)
    counted &= whole[1:, 1:] & whole[1:, :-1] & whole[:-1, 1:] & whole[:-1, :-1]
    padded = np.pad(np.where(counted, corners, 0.0).astype(float), 1, mode="edge")
    count = _corners(np.pad(counted.astype(float), 1, mode="edge"))
    return filled(_corners(padded) / np.maximum(count, 1.0), count > 0.0, FILLED_SLOPES)


def _corners(values: Array) -> Array:
    """Sum over the four corners of each cell."""
    return np.asarray(values[1:, 1:] + values[1:, :-1] + values[:-1, 1:] + values[:-1, :-1])


def filled(values: NDArray[np.floating], known: NDArray[np.bool_], layers: int = FILLED) -> Array:
    """`values` (nx, ny) with those not known, and NaNs, replaced by the mean of their neighbours.

    `layers` of cells are, so that interpolation at a body's edge finds no jump; beyond them is 0.
    """
    known = np.isfinite(values) & known
    result = np.where(known, values, 0.0).astype(float)
    for _ in range(layers):
        total, count = _around(result), _around(known.astype(float))
        reached = ~known & (count > 0.0)
        result[reached] = total[reached] / count[reached]
        known |= reached
    return result


def _around(values: Array) -> Array:
    """Sum over the four neighbours of each cell."""
    padded = np.pad(values, 1)
    return np.asarray(padded[2:, 1:-1] + padded[:-2, 1:-1] + padded[1:-1, 2:] + padded[1:-1, :-2])


def refined(values: Array) -> Array:
    """`values` (n, m) on a grid a whole number of times as fine, cubic in between: colours of them
    have the edges that the values have, and not those of their cells."""
    times = -(-FINE // max(values.shape))
    if times == 1:
        return values
    size = (times * values.shape[1], times * values.shape[0])
    fine = Image.fromarray(values.astype(np.float32)).resize(size, Image.Resampling.BICUBIC)
    return np.asarray(fine, float)


def robust(values: Sequence[Array], percentile: float = ROBUST) -> float:
    """Size at which colours are strongest: that of all but the largest of the values' sizes."""
    sizes = _sizes(values)
    return max(float(np.percentile(sizes, percentile)), 1e-12) if sizes.size else 1.0


def turning(values: Sequence[Array]) -> float:
    """Size of vorticity at which its colours are strongest, that of TURNING: a wake fills little of
    a large domain or much of a small one, and has the same colours in both."""
    sizes = np.sort(_sizes(values))[::-1]
    if not sizes.size:
        return 1.0
    together = np.cumsum(sizes)
    return max(float(sizes[np.searchsorted(together, TURNING * together[-1])]), 1e-12)


def _sizes(values: Sequence[Array]) -> Array:
    sizes = np.abs(np.concatenate([one.ravel() for one in values]))
    return np.asarray(sizes[np.isfinite(sizes)])


def levels(share: Array, count: int) -> NDArray[np.intp]:
    """Rows of a table of `count` colours for shares of the limit from -1 to 1."""
    half = 0.5 * (count - 1)
    return np.rint(half + half * np.clip(np.nan_to_num(share), -1.0, 1.0)).astype(np.intp)


def full_strength(frames: Sequence[NDArray[np.floating]]) -> float:
    """Value at which a dye has its full colour: that of most of what is strong, not the largest,
    which is one of the swings that advection makes beside an edge."""
    values = np.concatenate([frame.ravel() for frame in frames])
    values = values[np.isfinite(values)]
    strong = values[values > 0.5 * values.max(initial=0.0)]
    return max(float(np.percentile(strong, STRONG)), 1e-12) if strong.size else 1.0
