"""Sides of the domain that contradict each other are refused."""

import pytest

from flowborne.fluid.boundary import Boundaries
from flowborne.fluid.grid import Grid
from flowborne.fluid.sides.kinds import BoundaryOpen, BoundaryPeriodic


def test_periodic_sides_come_in_pairs() -> None:
    with pytest.raises(ValueError, match="x_min is periodic and x_max is closed"):
        Boundaries(x_min=BoundaryPeriodic())
    sides = Boundaries(y_min=BoundaryPeriodic(), y_max=BoundaryPeriodic())
    assert sides.periodic() == (False, True, False)


def test_slab_has_no_sides_in_z() -> None:
    with pytest.raises(ValueError, match="no sides in z"):
        Boundaries(z_max=BoundaryOpen()).check(Grid.slab(4, 4, 1.0, (0.0, 0.0)))
