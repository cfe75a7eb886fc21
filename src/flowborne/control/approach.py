"""How the drives of controlled joints approach a pose, in the world as in a rehearsal of it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from flowborne.control import creature
from flowborne.coupling.motion import JointCommand
from flowborne.coupling.servo import Servo

if TYPE_CHECKING:
    from flowborne.coupling.world import World

Array = NDArray[np.float64]
Integers = NDArray[np.int64]


def approach(
    world: World, dofs: Integers, servo: Servo, target: Array, remaining: float, dt: float
) -> JointCommand:
    """Command to `dofs` (n,) for the next step, of dt (s), on their way to a pose.

    target     (nq,)
    remaining  s until it is due
    """
    model, state = creature.parts(world)
    remaining = max(remaining, dt)
    gap = model.difference(state.q, target)[dofs]
    v = state.v[dofs]
    rate, final = servo.velocity(gap, v, remaining, dt)
    # a drive that may give way moves with the velocity it has: it steers the step after
    ahead, _ = servo.velocity(gap - dt * v, v, max(remaining - dt, dt), dt)
    limit = np.asarray(servo.torque_limit, dtype=np.float64)
    command = JointCommand.none(model.nv)
    command.set(dofs, rate, np.where(np.isfinite(limit), ahead, final), limit)
    return command
