"""Scalars advected by a given velocity: F4."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from flowborne import Array, Faces, Grid
from flowborne.worlds import (
    Boundaries,
    BoundaryOpen,
    Passage,
    Transport,
    control_volumes,
    faces_of,
    nothing_brought,
)
from flowborne_validation.findings import Figure, Figures
from flowborne_validation.worlds import whole_steps

Shape = Callable[[Array, Array], Array]
"""Value of a scalar at (x, y)."""

OPEN = Boundaries(*(BoundaryOpen(),) * 4)

BOUNDS = 0.0, 1.0
"""Least and largest value of all shapes; the cells' values of a blob are a little below 1."""

SHORT_PERIOD = 2.0
"""s, of the swirl with the semi-Lagrangian scheme: in 8 s it would smear LeVeque's thread away on
every affordable grid, without an observable order."""


@dataclass(frozen=True)
class Turn:
    """Rigid rotation about (centre, centre), one turn in `period` s."""

    centre: float
    period: float

    def __call__(self, x: Array, y: Array, time: float) -> tuple[Array, Array]:
        rate = 2.0 * np.pi / self.period
        return -rate * (y - self.centre), rate * (x - self.centre)

    def stream(self, x: Array, y: Array, time: float) -> Array:
        away = (x - self.centre) ** 2 + (y - self.centre) ** 2
        return np.asarray(-np.pi / self.period * away)


@dataclass(frozen=True)
class Swirl:
    """LeVeque's vortex in the unit box, which reverses after half of `period` s."""

    period: float

    def __call__(self, x: Array, y: Array, time: float) -> tuple[Array, Array]:
        strength = np.cos(np.pi * time / self.period)
        u = strength * np.sin(np.pi * x) ** 2 * np.sin(2.0 * np.pi * y)
        return u, -strength * np.sin(2.0 * np.pi * x) * np.sin(np.pi * y) ** 2

    def stream(self, x: Array, y: Array, time: float) -> Array:
        strength = np.cos(np.pi * time / self.period) / np.pi
        return np.asarray(strength * np.sin(np.pi * x) ** 2 * np.sin(np.pi * y) ** 2)


Flow = Turn | Swirl
"""A flow in the plane without sources: velocity (m/s), and stream function psi (m^2/s) with
(u, v) = (d psi/dy, -d psi/dx)."""


@dataclass(frozen=True)
class Blob:
    """Gaussian of height 1 about (0.5, height)."""

    height: float
    width: float

    def __call__(self, x: Array, y: Array) -> Array:
        away = (x - 0.5) ** 2 + (y - self.height) ** 2
        return np.asarray(np.exp(-away / self.width**2))


def slotted_disc(x: Array, y: Array) -> Array:
    """Zalesak's disc: 1 inside."""
    inside = (x - 50.0) ** 2 + (y - 75.0) ** 2 <= 15.0**2
    slot = (np.abs(x - 50.0) < 2.5) & (y < 85.0)
    return np.where(inside & ~slot, 1.0, 0.0)


def advecting_velocity_of(flow: Flow, grid: Grid, time: float, dt: float) -> Faces:
    """Padded Faces, cells per step: the mean velocity, in the step from `time` on, of a particle at
    each face, as the solver estimates it from velocity and acceleration."""
    h, (x0, y0, _) = grid.spacing, grid.origin
    wide = Grid.slab(grid.shape[0] + 2, grid.shape[1] + 2, h, (x0 - h, y0 - h))
    faces = wide.zeros_faces()
    for axis in grid.axes:
        x, y, _ = np.meshgrid(*wide.face_coordinates(axis), indexing="ij", sparse=True)
        u, v = flow(x, y, time)
        faces[axis][:] = flow(x + 0.5 * dt * u, y + 0.5 * dt * v, time + 0.5 * dt)[axis]
    return faces_of([dt / h * values for values in faces])


def flux_of(flow: Flow, grid: Grid, time: float) -> Faces:
    """Volume per time through the faces, m^2/s."""
    x, y = grid.face_coordinates(0)[0], grid.face_coordinates(1)[1]
    psi = flow.stream(x[:, None, None], y[None, :, None], time)
    return np.diff(psi, axis=1), -np.diff(psi, axis=0), grid.zeros_faces()[2]


def carried_back(
    flow: Flow, shape: Shape, period: float, grid: Grid, courant: float, flux_form: bool
) -> tuple[Array, Array]:
    """The scalar before and after a period; exactly it would be the same.

    courant    cells that the fastest particle of the box crosses in a step
    flux_form  False for the semi-Lagrangian scheme
    """
    x, y, _ = np.meshgrid(*grid.cell_coordinates(), indexing="ij")
    before = shape(x, y)
    fastest = max(float(np.abs(u).max()) for u in flow(x, y, 0.0))
    count, dt = whole_steps(period, courant * grid.spacing / fastest)
    after, none = before, nothing_brought(grid)
    opened = [np.ones(grid.face_shape(axis)) for axis in range(3)]
    whole = control_volumes(
        np.full(grid.shape, grid.cell_volume), (opened[0], opened[1], opened[2]), grid, OPEN
    )
    for step in range(count):
        if flux_form:
            flux = flux_of(flow, grid, (step + 0.5) * dt)
            transport = Transport(flux, whole, whole, dt, step * dt)
            passage = Passage(transport, none, grid, OPEN, step % 2 == 1)
            after, _ = passage.carry("dye", after, BOUNDS)
        else:
            after = carry_once(after, advecting_velocity_of(flow, grid, step * dt, dt), grid)
    return before, after


def carry_once(values: Array, advecting_velocity: Faces, grid: Grid) -> Array:
    """One step of the paper's semi-Lagrangian scheme: what arrives at x was at
    x_d = x - dt c(x_d) before, with the velocity c that it has half-way."""
    nx, ny, _ = grid.shape
    x, y = np.meshgrid(np.arange(nx) + 0.5, np.arange(ny) + 0.5, indexing="ij")
    a, b = x, y
    for _ in range(2):
        u = sampled(advecting_velocity[0], a + 1.0, b + 0.5)
        v = sampled(advecting_velocity[1], a + 0.5, b + 1.0)
        a, b = np.clip(x - u, 0.0, nx), np.clip(y - v, 0.0, ny)
    field = np.pad(values, [(1, 1), (1, 1), (0, 0)], mode="edge")
    return sampled(field, a + 0.5, b + 0.5)[:, :, None]


def sampled(field: Array, x: Array, y: Array) -> Array:
    """Bilinear interpolation of a padded field of a slab at padded indices inside it."""
    i, j, at = x.astype(int), y.astype(int), field[:, :, 0]
    low = at[i, j] + (y - j) * (at[i, j + 1] - at[i, j])
    high = at[i + 1, j] + (y - j) * (at[i + 1, j + 1] - at[i + 1, j])
    return np.asarray(low + (x - i) * (high - low))


def lost(before: Array, after: Array) -> float:
    """Sum of the absolute differences over the sum before."""
    return float(np.abs(after - before).sum() / before.sum())


def box(cells: int, side: float = 1.0) -> Grid:
    return Grid.slab(cells, cells, side / cells, (0.0, 0.0))


def blob_in_turn(grids: Sequence[int], flux_form: bool) -> tuple[Figure, Figure]:
    """Error and peak of the blob after one rigid turn."""
    errors, peaks = [], []
    for n in grids:
        courant = 2.0 if flux_form else 4.0
        blob, turn = Blob(0.7, 0.1), Turn(0.5, 1.0)
        before, after = carried_back(turn, blob, 1.0, box(n), courant, flux_form)
        errors.append(lost(before, after))
        peaks.append(float(after.max() / before.max()))
    return Figure(errors, grids, 0.0), Figure(peaks, grids)


def blob_in_swirl(grids: Sequence[int], period: float, flux_form: bool) -> Figure:
    """Error of the blob after the swirl has reversed."""
    errors = [
        lost(*carried_back(Swirl(period), Blob(0.75, 0.2), period, box(n), 4.0, flux_form))
        for n in grids
    ]
    return Figure(errors, grids, 0.0)


def disc_in_turn(grids: Sequence[int]) -> Figure:
    """Error of Zalesak's disc after one turn, and the disc's values on the finest grid."""
    turn = Turn(50.0, 628.0)
    runs = [carried_back(turn, slotted_disc, 628.0, box(n, 100.0), 2.0, True) for n in grids]
    after = runs[-1][1]
    extremes = f"after the turn the disc's values lie in [{after.min():.3f}, {after.max():.3f}]"
    return Figure([lost(*run) for run in runs], grids, lines=[extremes])


def scalars_carried(
    turn: Sequence[int],
    smeared: Sequence[int],
    swirl: Sequence[int],
    period: float,
    disc: Sequence[int],
) -> Figures:
    """F4: orders of both schemes, the peak after a turn, and Zalesak's disc.

    turn, smeared, swirl, disc  cells a side; `smeared` for the semi-Lagrangian scheme
    period                      of the swirl, s
    """
    order, peak = blob_in_turn(turn, True)
    return {
        "order of the flux form, blob after a turn": order,
        "order of the flux form, blob in the swirl": blob_in_swirl(swirl, period, True),
        "order of semi-Lagrangian, blob after a turn": blob_in_turn(smeared, False)[0],
        "order of semi-Lagrangian, blob in the swirl": blob_in_swirl(swirl, SHORT_PERIOD, False),
        "peak of the blob after a turn": peak,
        "error of Zalesak's disc / its area": disc_in_turn(disc),
    }
