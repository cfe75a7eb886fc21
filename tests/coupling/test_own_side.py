"""A kind of side of one's own: all that it does is in its class."""

from __future__ import annotations

import math
from dataclasses import dataclass

import pytest

from flowborne.coupling.motion import JointCommand
from flowborne.coupling.step import step
from flowborne.fluid.grid import Array, Grid
from flowborne.fluid.sides.side import Place
from flowborne.worlds import Boundaries, Boundary, BoundaryClosed, BoundaryOpen, make_world

CELLS = 16
"""A radius."""

DISC = """<mujoco><worldbody><body><joint name="x" type="slide" axis="1 0 0"/>
  <geom type="cylinder" size="1 0.5"/></body></worldbody></mujoco>"""


@dataclass(frozen=True)
class Column(BoundaryOpen):
    """Endless fluid outside, as a column of the length behind each face that is right for the
    dipole of a body in the origin: dp/dn = -(n.r) / r^2 p in two dimensions."""

    kind = "column"

    def pressure_weight(self, place: Place) -> Array:
        x, y, _ = place.cell_coordinates()
        half, outward = 0.5 * place.grid.spacing, abs((x, y)[place.axis])
        return half / (half + (x**2 + y**2) / outward)


@pytest.mark.parametrize(
    ("side", "half_width", "endless", "within"),
    [
        (BoundaryClosed(), 2.0, 1.55, 0.01),
        (BoundaryOpen(), 2.0, 0.65, 0.01),
        (Column(), 1.5, 1.0, 0.02),
        (Column(), 2.0, 1.0, 0.015),
        (Column(), 3.0, 1.0, 0.01),
    ],
)
def test_added_mass_of_a_disc_set_going(
    side: Boundary, half_width: float, endless: float, within: float
) -> None:
    """Over that in endless fluid, rho pi R^2."""
    n, dt = 2 * round(CELLS * half_width), 1e-9
    grid = Grid.slab(n, n, 1.0 / CELLS, (-half_width, -half_width))
    world = make_world(DISC, grid, boundaries=Boundaries(*(side,) * 4))
    command = JointCommand.none(1)
    command.set([0], 0.0, 1.0)
    report = step(world, dt, command)
    found = -report.pressure_wrench[-1, 0] * dt / math.pi
    assert found == pytest.approx(endless, abs=within)
    assert report.momentum.budget_error < 1e-10
