"""Joints as the controller knows them: the one module of control that looks into solids.

A displacement is a velocity times a time, (nv,) like a velocity, so that it is defined for ball
joints (a rotation about axes of the joint's own frame) as for hinges and slides.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from flowborne.coupling.motion import JointCommand
from flowborne.coupling.servo import Servo
from flowborne.solids.dynamics import kinematics
from flowborne.solids.following import follow, outboard_dofs, rigidify
from flowborne.solids.momentum import momentum
from flowborne.solids.state import SolidState

if TYPE_CHECKING:
    from flowborne.coupling.world import Setup, World
    from flowborne.solids.model import SolidModel

Array = NDArray[np.float64]
Integers = NDArray[np.int64]
Mask = NDArray[np.bool_]


def parts(world: World) -> tuple[SolidModel, SolidState]:
    """Model and state of the bodies. Raises ValueError when the world has none."""
    if world.setup.solid is None or world.solid is None:
        raise ValueError("the world has no bodies to control: give its setup a solid model")
    return world.setup.solid, world.solid


def given(setup: Setup, model: SolidModel) -> Mask:
    """(nv,) dofs whose velocity the controller cannot choose: prescribed and locked ones."""
    mask = np.asarray(model.locked, dtype=bool).copy()
    for motion in setup.motions:
        mask[motion.dofs] = True
    return mask


def outboard(world: World, dofs: Integers) -> Integers:
    """Free dofs outboard of any of `dofs`, in ascending order, without `dofs` themselves."""
    model, _ = parts(world)
    below = outboard_dofs(model, dofs)
    own = given(world.setup, model)
    own[dofs] = True
    return below[~own[below]]


def give_velocity(world: World, dofs: Integers, velocity: Array, kept: Integers) -> None:
    """Give `dofs` these velocities; linear and angular momentum stay, and so does `kept`.

    `rigidify` is linear in the velocities: it removes the difference to the required ones.

    source  Lentine et al. 2011, sections 3.3 and 5
    """
    model, state = parts(world)
    fixed = given(world.setup, model)
    fixed[kept] = True
    wanted = np.zeros(model.nv)
    wanted[dofs] = velocity
    excess = SolidState(state.q.copy(), state.v - wanted)
    world.solid = rigidify(model, excess, dofs, fixed)
    world.solid.v += wanted


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


def positions_in(model: SolidModel, q: Array, dofs: Integers) -> Array:
    """(k,) positions of scalar joints in pose `q`, rad or m; NaN for dofs of other joints."""
    at = model.dof_position[dofs]
    return np.where(at >= 0, q[at], np.nan)


def positions(world: World, dofs: Integers) -> Array:
    """(k,) present positions of scalar joints, rad or m; NaN for dofs of other joints."""
    model, state = parts(world)
    return positions_in(model, state.q, dofs)


def away(world: World, dofs: Integers, places: Array) -> Array:
    """(k,) displacement from given entries of q (m,) of the joints of `dofs` to their present."""
    model, state = parts(world)
    start = state.q.copy()
    start[model.indices_of(dofs)] = places
    return model.difference(start, state.q)[dofs]


def body_rotation(world: World, body: int) -> Array:
    """(3, 3) columns are the body's axes in the world."""
    model, state = parts(world)
    return kinematics(model, state.q).body_rotation[body]


def body_position(world: World, body: int) -> Array:
    """(3,) origin of the body's frame, m."""
    model, state = parts(world)
    return kinematics(model, state.q).body_position[body]


def body_velocity(world: World, body: int) -> Array:
    """(3,) velocity of the origin of the body's frame, m/s."""
    model, state = parts(world)
    pose = kinematics(model, state.q)
    twist = pose.twist_jacobian[body] @ state.v
    return twist[:3] + np.cross(twist[3:], pose.body_position[body])


def whole_velocity(world: World) -> Array:
    """(3,) velocity of the centre of mass of all bodies and their flesh, m/s."""
    model, state = parts(world)
    return momentum(model, state)[0] / model.body_mass.sum()


def approach(
    world: World, dofs: Integers, servo: Servo, target: Array, remaining: float, dt: float
) -> JointCommand:
    """Command to `dofs` (n,) for the next step, of dt (s), on their way to a pose.

    target     (nq,)
    remaining  s until it is due
    """
    model, state = parts(world)
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
