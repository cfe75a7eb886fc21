"""The joints as the controller moves them.

A displacement is a velocity times a time, (nv,) like a velocity, so that it is defined for ball
joints (a rotation about axes of the joint's own frame) as for hinges and slides.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from flowborne.kernels.arrays import Array, Integers, Mask
from flowborne.solids.following import follow, outboard_dofs, rigidify
from flowborne.solids.model import SolidState
from flowborne.solids.trajectories import JointCommand, Servo

if TYPE_CHECKING:
    from flowborne.coupling.world import World
    from flowborne.solids.model import SolidModel


def given(world: World) -> Mask:
    """(nv,) dofs whose velocity the controller cannot choose: prescribed, told and locked ones."""
    mask = np.asarray(world.setup.solid.locked, dtype=bool).copy()
    mask[world.told.dofs()] = True
    for motion in world.setup.motions:
        mask[motion.dofs] = True
    return mask


def outboard(world: World, dofs: Integers) -> Integers:
    """Free dofs outboard of any of `dofs`, in ascending order, without `dofs` themselves."""
    below = outboard_dofs(world.setup.solid, dofs)
    own = given(world)
    own[dofs] = True
    return below[~own[below]]


def give_velocity(world: World, dofs: Integers, velocity: Array, kept: Integers) -> None:
    """Give `dofs` these velocities; linear and angular momentum stay, and so does `kept`.

    `rigidify` is linear in the velocities: it removes the difference to the required ones.

    source  Lentine et al. 2011, sections 3.3 and 5
    """
    model, state = world.setup.solid, world.solid
    fixed = given(world)
    fixed[kept] = True
    wanted = np.zeros(model.nv)
    wanted[dofs] = velocity
    excess = SolidState(state.q.copy(), state.v - wanted)
    world.solid = replace(state, v=rigidify(model, excess, dofs, fixed).v + wanted)


def moved(model: SolidModel, q: Array, displacement: Array) -> Array:
    """(nq,) the pose reached from `q` by `displacement` (nv,) of bones; flesh goes along."""
    return model.integrate(q, follow(model, q, displacement), 1.0)


def within_range(model: SolidModel, q: Array, displacement: Array) -> Array:
    """(nv,) the part of a displacement from pose `q` that the joints' ranges allow.

    Hinges and slides stop at their ends; the rotation vector of a ball joint is shortened. A joint
    that contact or a track has brought beyond its range may go back, and not farther out.
    """
    allowed, scalar = displacement.copy(), model.scalar_dofs
    if scalar.size:
        here = q[model.dof_position[scalar]]
        low, high = model.dof_range[scalar].T
        allowed[scalar] = np.clip(
            displacement[scalar], np.minimum(low - here, 0.0), np.maximum(high - here, 0.0)
        )
    for at, dof, limit in model.limited_balls:
        turn = displacement[dof : dof + 3]
        allowed[dof : dof + 3] = _within_cone(q[at : at + 4], turn, limit)
    return allowed


def _within_cone(quaternion: Array, turn: Array, limit: float) -> Array:
    """The part of a rotation vector `turn` that leaves a ball joint within `limit` of its rest.

    The scalar part of quaternion * (cos t/2, e sin t/2) is r cos(t/2 + shift): it must not fall
    below cos(limit/2), or below where it is when the joint is out of its range already.
    """
    angle = float(np.linalg.norm(turn))
    if angle == 0.0:
        return turn
    scalar, vector = quaternion[0], quaternion[1:]
    if scalar < 0.0:
        scalar, vector = -scalar, -vector
    along = float(vector @ turn) / angle
    least = min(np.cos(0.5 * limit), scalar)
    r = float(np.hypot(scalar, along))
    if least <= -r:
        return turn
    shift = np.arctan2(along, scalar)
    largest = 2.0 * (np.arccos(min(least / r, 1.0)) - shift) if r > 0.0 else 0.0
    return turn * (min(max(largest, 0.0), angle) / angle)


def positions(model: SolidModel, q: Array, dofs: Integers) -> Array:
    """(k,) positions of scalar joints in pose `q`, rad or m; NaN for dofs of other joints."""
    at = model.dof_position[dofs]
    return np.where(at >= 0, q[at], np.nan)


def approach(
    world: World, dofs: Integers, servo: Servo, target: Array, remaining: float, dt: float
) -> JointCommand:
    """Command to `dofs` (n,) for the next step, of dt (s), on their way to a pose.

    target     (nq,)
    remaining  s until it is due
    """
    model, state = world.setup.solid, world.solid
    remaining = max(remaining, dt)
    gap = model.difference(state.q, target)[dofs]
    v = state.v[dofs]
    rate, final = servo.velocity(gap, v, remaining, dt)
    # a torque-limited drive keeps its velocity in this step, and steers the next one
    ahead, _ = servo.velocity(gap - dt * v, v, max(remaining - dt, dt), dt)
    limit = np.asarray(servo.torque_limit, dtype=np.float64)
    command = JointCommand.none(model.nv)
    command.set(dofs, rate, np.where(np.isfinite(limit), ahead, final), limit)
    return command
