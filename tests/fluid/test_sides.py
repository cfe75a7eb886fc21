"""The contract of the sides: every kind does all that the solvers ask of it."""

from __future__ import annotations

import numpy as np
import pytest

from flowborne.fluid.boundary import Boundaries
from flowborne.fluid.ghosts import impose_sides
from flowborne.fluid.grid import Grid, faces_of
from flowborne.fluid.sides.far import BoundaryFar
from flowborne.fluid.sides.kinds import (
    BoundaryClosed,
    BoundaryInflow,
    BoundaryNoSlip,
    BoundaryOpen,
    BoundaryPeriodic,
)
from flowborne.fluid.sides.side import Boundary
from flowborne.kernels.arrays import PERIODIC, PRESCRIBED, Array
from flowborne.scenes import sides as tables

CUBE = Grid((6, 5, 4), 0.5, (0.0, 1.0, -1.0))


def profile(x: Array, y: Array, z: Array, time: float) -> tuple[Array, Array, Array]:
    return 1.0 + y + time + 0 * x, x + z, x * y


ALL: list[Boundary] = [
    BoundaryClosed(),
    BoundaryNoSlip((1.0, 2.0, 3.0)),
    BoundaryOpen(),
    BoundaryFar(),
    BoundaryInflow(profile, {"dye": lambda x, y, z, time: y + time + 0 * (x + z)}),
    BoundaryPeriodic(),
]
KINDS = pytest.mark.parametrize("side", ALL, ids=lambda side: side.kind)


def places(side: Boundary):
    return [place for place, _ in Boundaries(*(side,) * 6).around(CUBE)]


@KINDS
def test_pressure_acts_where_the_flux_is_not_prescribed(side: Boundary) -> None:
    for place in places(side):
        weight = side.pressure_weight(place)
        assert np.all(weight == 0.0) == (side.normal == PRESCRIBED)
        assert (side.normal == PERIODIC) == (side.tangential == PERIODIC)


@KINDS
def test_a_field_that_meets_sides_stays_when_they_are_imposed_again(side: Boundary) -> None:
    random, sides = np.random.default_rng(2), Boundaries(*(side,) * 6)
    field = faces_of([random.normal(size=CUBE.face_shape(axis)) for axis in range(3)])
    impose_sides(field, CUBE, sides, 0.3)
    again = faces_of([u.copy() for u in field])
    impose_sides(again, CUBE, sides, 0.3)
    np.testing.assert_array_equal(again[0], field[0])
    np.testing.assert_array_equal(again[1], field[1])
    np.testing.assert_array_equal(again[2], field[2])
    kept = sides.across(CUBE, 0.3) is sides.across(CUBE, 0.4)
    assert kept == (side.steady and side.normal == PRESCRIBED)


@KINDS
def test_what_enters_is_of_the_shape_of_the_side(side: Boundary) -> None:
    for place in places(side):
        cells = np.zeros(CUBE.shape)[place.layer]
        scalar = side.entering_scalar("dye", place, 0.5)
        assert side.entering_scalar("smoke", place, 0.5) is None
        assert scalar is None or np.broadcast_to(scalar, cells.shape).shape == cells.shape
        if scalar is not None and place.axis == 0:
            np.testing.assert_allclose(scalar[0, :, 0], CUBE.cell_coordinates()[1] + 0.5)


def test_every_side_of_scenes_is_of_a_kind_of_its_name() -> None:
    found = {
        table.boundary.kind: table.model_fields["kind"].annotation.__args__[0]
        for table in tables.AnySideTable.__subclasses__()
    }
    assert found == {side.kind: side.kind for side in ALL}
