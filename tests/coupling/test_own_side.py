"""A kind of side of one's own: all that it does is in its class."""

from __future__ import annotations

import math
from dataclasses import dataclass

import pytest

from flowborne.coupling.step import step
from flowborne.fluid.grid import Grid
from flowborne.fluid.sides.side import Place
from flowborne.kernels.arrays import Array
from flowborne.solids.trajectories import JointCommand
from flowborne.worlds import Boundaries, Boundary, BoundaryClosed, BoundaryOpen, make_world

CELLS = 16
"""A radius."""

DISC = """<mujoco><worldbody><body><joint name="x" type="slide" axis="1 0 0"/>
  <geom type="cylinder" size="1 0.5"/></body></worldbody></mujoco>"""


@dataclass(frozen=True)
class Column(BoundaryOpen):
    """What a far side is for a body in the origin, written as a user would."""

    kind = "column"

    def pressure_weight(self, place: Place) -> Array:
        x, y, _ = place.cell_coordinates()
        half, outward = 0.5 * place.grid.spacing, abs((x, y)[place.axis])
        return half / (half + (x**2 + y**2) / outward)


@pytest.mark.parametrize(
    ("side", "endless"), [(BoundaryClosed(), 1.55), (BoundaryOpen(), 0.65), (Column(), 1.0)]
)
def test_added_mass_of_a_disc_set_going(side: Boundary, endless: float) -> None:
    """Over that in endless fluid, rho pi R^2; in a box of two radii to each side."""
    n, dt = 4 * CELLS, 1e-9
    grid = Grid.slab(n, n, 1.0 / CELLS, (-2.0, -2.0))
    world = make_world(DISC, grid, boundaries=Boundaries(*(side,) * 4))
    command = JointCommand.none(1)
    command.set([0], 0.0, 1.0)
    report = step(world, dt, command)
    found = -report.pressure_wrench[-1, 0] * dt / math.pi
    assert found == pytest.approx(endless, abs=0.01)
    assert report.momentum_budget_error < 1e-10
