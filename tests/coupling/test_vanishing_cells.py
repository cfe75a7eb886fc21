"""What is left in a cell that a body fills may not be any velocity."""

from __future__ import annotations

import pytest

import flowborne as fb
from flowborne.worlds import advance, make_world, set_going
from flowborne_validation.worlds import mjcf

H = 1.0 / 32.0
"""m, side of a cell."""

PISTON = (
    '<body name="piston"><joint type="slide" axis="1 0 0"/>'
    '<geom type="box" size=".125 .1 .1"/></body>'
)


@pytest.mark.parametrize(
    "grid",
    [fb.Grid.slab(64, 32, H, (-1.0, -0.5)), fb.Grid((48, 24, 24), H, (-0.75, -0.375, -0.375))],
    ids=["slab", "room"],
)
def test_what_a_piston_pushes_out_of_closing_cells_is_no_faster_than_what_passes_it(
    grid: fb.Grid,
) -> None:
    """Its front closes cells but for a part, in water, whose friction holds small cells.

    What they had, over what is left of them, was 2100 m/s once.
    """

    def fastest(left: float) -> float:
        """Over the piston's speed, when it has come to leave this part of the cells before it."""
        dt, world = 0.01, make_world(mjcf(PISTON), grid, viscosity=1e-4, solid_density=50.0)
        speed = 0.3 * H / dt
        world.solid.q[0], world.solid.v[0] = -(0.3 + left) * H, speed
        set_going(world)
        return advance(world, dt).fastest / speed

    passing = max(fastest(left) for left in (0.3, 0.5, 0.7))
    assert passing < 2.0
    assert max(fastest(left) for left in (1e-3, 1e-5, 1e-7)) < min(passing, 1.25)
