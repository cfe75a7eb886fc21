"""What is seen of the fluid: dye or vorticity as a small image, a pixel per cell."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from flowborne.fluid.grid import Grid
from flowborne.view import style
from flowborne.view.run import Run, State

Array = NDArray[np.float64]
Pixels = NDArray[np.uint8]

SAMPLES = 24
"""Frames from which the scale of a film is taken."""

ROBUST = 98.5
"""Percentile of the vorticity's size at which its colours are strongest."""


STRONG = 75.0
"""Percentile of a dye's values above half the largest at which it has its full colour."""


class Field(Protocol):
    """What is shown of the fluid.

    legend  (name, colour) of each thing shown in a colour of its own
    scale   (colours from lowest to highest (k, 3), lowest, highest, name), or None
    """

    legend: Sequence[tuple[str, str]]
    scale: tuple[Array, float, float, str] | None

    def image(self, state: State) -> Pixels:
        """(ny, nx, 3) colours of the cells, lowest row first."""
        ...


def field_of(run: Run) -> Field | None:
    """What the scene of `run` wants to see of its fluid; None without fluid."""
    if run.grid is None:
        return None
    dyes = [name for name in run.state(0) if name.startswith("scalar_")]
    if run.picture == "dye" and dyes:
        return FieldDye(run, dyes)
    return FieldStill() if run.picture == "none" else FieldVorticity(run)


class FieldStill:
    """Plain water."""

    def __init__(self) -> None:
        self.legend: Sequence[tuple[str, str]] = ()
        self.scale: tuple[Array, float, float, str] | None = None

    def image(self, state: State) -> Pixels:
        return _pixels(np.broadcast_to(style.rgb(style.WATER), (1, 1, 3)))


class FieldDye:
    """Carried dyes, each in a colour of its own, mixed where they meet."""

    def __init__(self, run: Run, dyes: Sequence[str]) -> None:
        self.dyes = tuple(dyes)
        sampled = run.sampled(SAMPLES)
        self.full = {dye: full_strength([state[dye] for state in sampled]) for dye in self.dyes}
        self.colours = [style.DYES[n % len(style.DYES)] for n in range(len(self.dyes))]
        names = [dye.removeprefix("scalar_") for dye in self.dyes]
        self.legend: Sequence[tuple[str, str]] = list(zip(names, self.colours, strict=True))
        self.scale: tuple[Array, float, float, str] | None = None

    def image(self, state: State) -> Pixels:
        open_cells = state["open"][:, :, 0]
        colour: Array = np.zeros((*open_cells.T.shape, 3))
        weight: Array = np.zeros((*open_cells.T.shape, 1))
        clear: Array = np.ones_like(weight)
        for dye, name in zip(self.dyes, self.colours, strict=True):
            strength = filled(state[dye][:, :, 0] / self.full[dye], open_cells).T[..., None]
            strength = np.clip(strength, 0.0, 1.0)
            light = 0.25 * strength**3
            colour += strength * (style.rgb(name) * (1.0 - light) + light)
            weight += strength
            clear *= 1.0 - strength
        mixed = colour / np.maximum(weight, 1e-12)
        return _pixels(style.rgb(style.WATER) * clear + mixed * (1.0 - clear))


class FieldVorticity:
    """Vorticity, warm where the fluid turns counter-clockwise, on one scale for all frames.

    limit  1/s, where the colours are strongest
    """

    def __init__(self, run: Run) -> None:
        if run.grid is None:
            raise ValueError("a run without fluid has no vorticity")
        self.grid = run.grid
        sizes = [np.abs(vorticity(state, run.grid)).ravel() for state in run.sampled(SAMPLES)]
        self.limit = max(float(np.percentile(np.concatenate(sizes), ROBUST)), 1e-12)
        self.table = _diverging(255)
        self.legend: Sequence[tuple[str, str]] = ()
        self.scale: tuple[Array, float, float, str] | None = (
            self.table / 255.0,
            -self.limit,
            self.limit,
            "vorticity (1/s)",
        )

    def image(self, state: State) -> Pixels:
        share = vorticity(state, self.grid).T / self.limit
        levels = np.rint(127.0 + 127.0 * np.clip(share, -1.0, 1.0)).astype(np.intp)
        return self.table[levels]


def full_strength(frames: Sequence[NDArray[np.floating]]) -> float:
    """Value at which a dye has its full colour: that of most of what is strong, not the largest,
    which is one of the swings that advection makes beside an edge."""
    values = np.concatenate([frame.ravel() for frame in frames])
    values = values[np.isfinite(values)]
    strong = values[values > 0.5 * values.max(initial=0.0)]
    return max(float(np.percentile(strong, STRONG)), 1e-12) if strong.size else 1.0


def vorticity(state: State, grid: Grid) -> Array:
    """(nx, ny) vorticity about z at the cell centres, 1/s; closed cells continue their neighbours.

    The corners' values dv/dx - du/dy are averaged; the outermost corners take those next to them.
    """
    u, v = state["velocity_x"][:, :, 0], state["velocity_y"][:, :, 0]
    corners = (np.diff(v[:, 1:-1], axis=0) - np.diff(u[1:-1], axis=1)) / grid.spacing
    padded = np.pad(corners.astype(float), 1, mode="edge")
    cells = 0.25 * (padded[1:, 1:] + padded[1:, :-1] + padded[:-1, 1:] + padded[:-1, :-1])
    return filled(cells, state["open"][:, :, 0])


def filled(values: NDArray[np.floating], open_cells: NDArray[np.floating]) -> Array:
    """`values` (nx, ny) with mostly closed cells and NaNs replaced by the mean of their neighbours.

    Two layers are filled, so that interpolation beside a body's edge sees no jump; beyond them
    stands 0.
    """
    known = np.isfinite(values) & (open_cells > 0.5)
    result = np.where(known, values, 0.0).astype(float)
    for _ in range(2):
        total, count = _around(result), _around(known.astype(float))
        reached = ~known & (count > 0.0)
        result[reached] = total[reached] / count[reached]
        known |= reached
    return result


def _around(values: Array) -> Array:
    """Sum over the four neighbours of each cell."""
    padded = np.pad(values, 1)
    return np.asarray(padded[2:, 1:-1] + padded[:-2, 1:-1] + padded[1:-1, 2:] + padded[1:-1, :-2])


def _diverging(count: int) -> Pixels:
    """(count, 3) colours from strong clockwise through plain water to strong counter-clockwise."""
    strong, middle, weak = ([style.rgb(c) for c in pair] for pair in zip(
        style.SPIN_RIGHT, style.SPIN_LEFT, strict=True))  # fmt: skip
    knots = [strong[0], middle[0], weak[0], style.rgb(style.WATER), weak[1], middle[1], strong[1]]
    places = [-1.0, -0.55, -0.2, 0.0, 0.2, 0.55, 1.0]
    share = np.linspace(-1.0, 1.0, count)
    return _pixels(
        np.stack([np.interp(share, places, [knot[c] for knot in knots]) for c in range(3)], axis=1)
    )


def _pixels(colours: NDArray[np.floating]) -> Pixels:
    return np.rint(255.0 * colours).astype(np.uint8)
