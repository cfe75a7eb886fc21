"""Bodies that reach into a no-slip side of the domain."""

from __future__ import annotations

import numpy as np
import pytest

from flowborne import Grid, Outcome, step
from flowborne.bodies import JointCommand
from flowborne.worlds import Boundaries, BoundaryNoSlip, make_world
from flowborne_validation.worlds import mjcf

STICKS = Boundaries(*(BoundaryNoSlip(),) * 4)
LINK = mjcf(
    '<body pos="0.4 0 0"><joint type="slide" axis="1 0 0"/><joint type="slide" axis="0 1 0"/>'
    '<joint axis="0 0 1"/><geom type="capsule" fromto="-.15 0 0 .15 0 0" size=".04"/></body>'
)


@pytest.mark.parametrize("pose", [(0.0, 0.08, 0.3), (0.0, 0.035, 0.05)], ids=["oblique", "flat"])
def test_a_link_that_slides_in_a_side_keeps_momentum(pose: tuple[float, float, float]) -> None:
    """Cells that it closes in at the side push nothing, whatever their pressure was before."""
    world = make_world(
        LINK, Grid.slab(48, 24, 1.0 / 48, (0.0, 0.0)), viscosity=1e-3, boundaries=STICKS
    )
    velocity = np.array([0.5, 0.0, 0.0])
    world.solid.q[:], world.solid.v[:] = pose, velocity
    command = JointCommand.none(3)
    command.set(np.arange(3), velocity, velocity)
    for _ in range(24):
        report = step(world, 0.25 / 48, command)
        assert report.outcome is Outcome.DONE
        assert report.momentum_budget_error < 1e-10
        assert report.fastest < 3.0 * velocity[0]


def test_a_link_dropped_along_a_side_comes_to_rest_on_it() -> None:
    """With contact, which lets it sink into the side a little; no momentum is lost."""
    model = LINK.replace(
        "<worldbody>", '<worldbody><geom type="plane" size="5 5 1" zaxis="0 1 0" contype="1"/>'
    ).replace('type="capsule"', 'type="capsule" contype="1" conaffinity="1"')
    world = make_world(
        model,
        Grid.slab(48, 24, 1.0 / 48, (0.0, 0.0)),
        gravity=(0.0, -9.81, 0.0),
        solid_density=3.0,
        viscosity=1e-3,
        boundaries=STICKS,
    )
    world.solid.q[:], world.solid.v[:] = (0.0, 0.12, 0.3), (0.3, -0.3, 0.0)
    for _ in range(120):
        report = step(world, 0.25 / 48)
        assert report.outcome is Outcome.DONE
        assert report.momentum_budget_error < 1e-10
        assert report.fastest < 3.5
    assert abs(world.solid.v[1]) < 0.05
