"""What far sides answer to a dipole."""

from __future__ import annotations

import numpy as np
import pytest

from flowborne.fluid.boundary import Boundaries
from flowborne.fluid.grid import Grid
from flowborne.fluid.sides.far import BoundaryFar
from flowborne.fluid.sides.kinds import BoundaryClosed, BoundaryOpen, BoundaryPeriodic
from flowborne.kernels.arrays import Array

FAR, CLOSED, OPEN, RING = BoundaryFar(), BoundaryClosed(), BoundaryOpen(), BoundaryPeriodic()
SLAB = Grid.slab(24, 12, 0.1, (-1.2, -0.6))
ROOM = Grid((12, 8, 6), 0.1, (-0.6, -0.4, -0.3))


def dipole(grid: Grid, along: int, centre: Array) -> Array:
    """p = r_k / r^D in all cells; D is 2 in a slab."""
    at = np.meshgrid(*grid.cell_coordinates(), indexing="ij", sparse=True)
    r, dimensions = [x - c for x, c in zip(at, centre, strict=True)], len(grid.axes)
    square = sum(r[axis] ** 2 for axis in grid.axes)
    return np.broadcast_to(r[along] / square ** (0.5 * dimensions), grid.shape)


@pytest.mark.parametrize("grid", [SLAB, ROOM], ids=["slab", "room"])
def test_with_the_columns_a_dipole_gives_its_own_flux(grid: Grid) -> None:
    """On every face of every side: the difference of its pressure across half a cell, h/2 dp/dn."""
    sides, h = Boundaries(*(FAR,) * (2 * len(grid.axes))), grid.spacing
    dipoles = sides.dipoles(grid)
    assert dipoles is not None
    for along in grid.axes:
        pressure = dipole(grid, along, np.zeros(3))
        for place, answer in dipoles.answer(pressure):
            side = sides.pair(place.axis)[place.upper]
            found = side.pressure_weight(place) * pressure[place.layer] + answer
            out, ends = 1.0 if place.upper else -1.0, []
            for step in (-1e-5, 1e-5):
                moved = np.zeros(3)
                moved[place.axis] = -out * (0.5 * h + step)  # the cell's middle goes to the side
                ends.append(dipole(grid, along, moved)[place.layer])
            np.testing.assert_allclose(found, -0.5 * h * (ends[1] - ends[0]) / 2e-5, rtol=1e-6)


@pytest.mark.parametrize("grid", [SLAB, ROOM], ids=["slab", "room"])
def test_the_weights_of_all_faces_stay_positive_definite(grid: Grid) -> None:
    sides = Boundaries(*(FAR,) * (2 * len(grid.axes)))
    dipoles = sides.dipoles(grid)
    assert dipoles is not None
    columns = [
        np.broadcast_to(
            sides.pair(place.axis)[place.upper].pressure_weight(place),
            [1 if a == place.axis else n for a, n in enumerate(grid.shape)],
        ).reshape(-1)
        for place in dipoles.places
    ]
    E = dipoles.vectors.T @ (dipoles.signs[:, None] * dipoles.vectors)
    assert np.linalg.eigvalsh(np.diag(np.concatenate(columns)) + E)[0] > 0.0


@pytest.mark.parametrize(
    ("sides", "count"),
    [
        (Boundaries(*(FAR,) * 6), 3),
        (Boundaries(FAR, FAR, FAR, FAR, CLOSED, FAR), 2),
        (Boundaries(CLOSED, FAR, CLOSED, FAR, FAR, FAR), 1),
        (Boundaries(FAR, FAR, FAR, FAR, OPEN, FAR), 1),
        (Boundaries(FAR, FAR, FAR, FAR, RING, RING), 2),
        (Boundaries(FAR, FAR, OPEN, OPEN, FAR, FAR), 0),
        (Boundaries(OPEN, FAR, OPEN, FAR, FAR, FAR), 0),
        (Boundaries(*(BoundaryFar((1.0, 0.0, 0.0)),) * 6), 0),
        (Boundaries(), 0),
    ],
    ids=["sea", "lid", "edge", "open lid", "flat", "open", "two open", "stream", "closed"],
)
def test_dipoles_are_those_that_mirrors_leave(sides: Boundaries, count: int) -> None:
    dipoles = sides.dipoles(ROOM)
    assert (0 if dipoles is None else dipoles.signs.size // 2) == count


def test_faces_that_bodies_cut_keep_their_columns() -> None:
    dipoles = Boundaries(*(FAR,) * 4).dipoles(SLAB)
    assert dipoles is not None
    uncut = [np.ones(values.shape, bool) for _, values in dipoles.answer(np.ones(SLAB.shape))]
    uncut[1][0, 5] = False
    pressure = np.random.default_rng(5).normal(size=SLAB.shape)
    answers = [values for _, values in dipoles.on(uncut).answer(pressure)]
    assert answers[1][0, 5] == 0.0
    pressure[-1, 5] += 1.0
    for before, (_, after) in zip(answers, dipoles.on(uncut).answer(pressure), strict=True):
        np.testing.assert_allclose(after, before, atol=1e-14)
