"""The velocities that bodies and fluid have together when they start."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from flowborne.coupling.motion import JointCommand
from flowborne.coupling.report import Outcome
from flowborne.coupling.step import step
from flowborne.coupling.world import World

INSTANT = 1e-9
"""s of the step in which only impulses act."""


def set_going(world: World, given: NDArray[np.bool_] | None = None) -> None:
    """Set the fluid going with its bodies, as by an impulse at the start, in place.

    The velocity of the fluid becomes that with the same circulation that flows around the moving
    bodies: potential flow, where it was at rest or uniform. Without it the fluid takes its share
    of the bodies' velocity in the first step, and the pressure of that step is an impulse.

    given   (nv,) dofs that keep their velocity; the others get that at which no impulse acts on
            them and their share of the fluid from outside. All when None
    raises  ValueError when the flow cannot be solved for
    """
    fluid, state = world.flow()
    if fluid.one_way:
        return
    there = World(
        replace(world.setup, motions=(), winds=()),
        world.solid.copy(),
        state.copy(),
        world.time,
        cut=world.cut,
    )
    command = JointCommand.none(there.solid.v.size)
    kept = np.ones(there.solid.v.size, bool) if given is None else given
    command.set(kept, 0.0, there.solid.v[kept])
    there.solid.v[:] = 0.0
    report = step(there, INSTANT, command)
    if report.outcome is not Outcome.DONE:
        raise ValueError(f"the flow at the start was not found: {report.outcome.value}")
    _, found = there.flow()
    world.solid.v[:] = there.solid.v
    for axis in range(3):
        state.velocity[axis][:] = found.velocity[axis]
        state.advecting_velocity[axis][:] = found.velocity[axis]
    world.cut = there.cut
