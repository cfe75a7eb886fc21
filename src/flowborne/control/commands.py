"""Commands to joints from outside: a position, a velocity or a torque for the next frame."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, is_dataclass, replace
from typing import Any

import numpy as np

from flowborne.base.errors import SceneError
from flowborne.control.creature import within_range
from flowborne.coupling.world import Setup, World
from flowborne.kernels.arrays import Array, Integers
from flowborne.solids.actuators import ActuatorServo, actuator_servos, unusable_actuator
from flowborne.solids.force import Force, check_force
from flowborne.solids.model import BALL, FREE, SLIDE, SolidModel, joint_kind
from flowborne.solids.motors import Controls, control_range, driven_by, inputs_of, joint_of
from flowborne.solids.trajectories import (
    Servo,
    ServoExact,
    ServoPD,
    Told,
    Trajectory,
    TrajectoryKnots,
    TrajectoryServo,
    driven,
)

Numbers = float | Sequence[float] | Array


@dataclass(frozen=True)
class Position:
    """Where a joint is at the end of the frame. It goes there at even velocity.

    value  rad or m; a unit quaternion (w, x, y, z) of a ball
    then   where it is at the end of the frame after, which tells the velocity that it ends this
           one with; when None it keeps its velocity
    """

    value: Numbers
    then: Numbers | None = None


@dataclass(frozen=True)
class Velocity:
    """How fast a joint moves in the frame.

    value  rad/s or m/s, (k,) in the joint's own axes for a ball
    """

    value: Numbers


@dataclass(frozen=True)
class Torque:
    """What drives a joint in the frame: a force in the bodies' equations.

    It acts from half a step after the frame's start to half a step after its end: velocities are
    those of the middle of steps, and that of the first one has been found.

    value  N m or N (per m in a slab), (k,) in the joint's own axes for a ball
    """

    value: Numbers


@dataclass(frozen=True)
class Control:
    """What an actuator of the model is told, by its own name: u as MuJoCo's `ctrl`, held within its
    range. A thruster of the scene is told its thrust in N, or its speed in 1/s.

    On a hinge or slide a position actuator is a critically damped servo of its stiffness, and a
    velocity actuator an exact one, each with the actuator's largest force. All others, such as
    motors, muscles, those on sites and tendons, and those with more force to one side, exert
    MuJoCo's force. An actuator acts in frames in which it has a control.

    value  several numbers for an actuator with several controls
    """

    value: Numbers


Command = Position | Velocity | Torque | Control | Force
Commands = Mapping[str, Command]

Drives = Sequence[tuple[Integers, Servo]]
"""Dofs and servo of drives."""


def told_by(
    commands: Commands, world: World, span: float, drives: Drives
) -> tuple[Told, tuple[str, ...]]:
    """What joints and bodies are told by commands, and which limits these would have passed.

    A joint keeps within its range, and moves as its drive can: exactly, by a PD law, or with a
    limited torque, which limits a told torque too.

    commands  by the names of joints, or of actuators and thrusters for Control; a Force has a
              name of its own
    span      s, length of the frame
    drives    of the scene itself
    raises    SceneError for a joint or body that is unknown or cannot be driven, and for wrong
              numbers
    """
    model, motions, beyond = world.setup.solid, list[Trajectory](), list[str]()
    forces = {name: given for name, given in commands.items() if isinstance(given, Force)}
    for name, pushing in forces.items():
        check_force(pushing, model, name)
    thrusters = {thruster.name: thruster for thruster in world.setup.thrusters}
    settings: dict[str, float] = {}
    pushed, force = [np.zeros(0, np.int64)], [np.zeros(0)]
    controls, servos = Controls.none(model), list[tuple[int, int]]()
    as_servo = _sole_servos(model, commands)
    for name, given in commands.items():
        if isinstance(given, Force):
            continue
        if isinstance(given, Control) and name in thrusters:
            asked = _numbers(name, given.value, 1)
            settings[name] = float(np.clip(asked, *thrusters[name].limits)[0])
            beyond += _said(name, asked, np.array([settings[name]]), "N or 1/s")
            continue
        joint, own = name, None
        command: Command = given
        if isinstance(given, Control):
            number, values, said = _controlled(model, name, given)
            beyond += said
            controls.values[inputs_of(model, number)] = values
            joint = joint_of(model, number) or ""
            if isinstance(commands.get(joint), Position | Velocity | Torque):
                raise SceneError(
                    f"actuator '{name}' drives joint '{joint}', which has a command of its own as "
                    "well: give one of the two"
                )
            if name not in as_servo:
                controls.told[number] = True
                pushed.append(freed := driven_by(model, number))
                force.append(np.zeros(freed.size))
                continue
            joint, command, own = _as_servo(as_servo[name], float(values[0]))
            servos.append((number, int(model.dofs_of(joint)[0])))
        dofs = _driven_dofs(model, joint)
        servo = servo_of(dofs, drives) if own is None else own
        if isinstance(command, Torque):
            wanted = _numbers(joint, command.value, dofs.size)
            torque = np.clip(wanted, *torque_limits(model, joint, servo))
            beyond += _said(joint, wanted, torque, "N m or N")
            pushed.append(dofs)
            force.append(torque)
        elif isinstance(command, Position | Velocity):
            poses, said = _knots(joint, command, world, span)
            beyond += said
            end = world.time + span
            times = np.array([world.time, end, end + span])
            motions.append(driven(TrajectoryKnots(model, dofs, times, poses), servo))
        else:
            raise SceneError(
                f"the command to '{joint}' is {command!r:.60}: "
                "give a Position, a Velocity, a Torque, a Control or a Force"
            )
    pushes = np.concatenate(pushed), np.concatenate(force)
    acting = controls if controls.told.any() or servos else None
    joints = tuple(motions), *pushes, acting, servos
    return Told(*joints, tuple(forces.values()), settings), tuple(beyond)


def _controlled(model: SolidModel, name: str, command: Control) -> tuple[int, Array, list[str]]:
    """Number of an actuator, its controls (k,) within their range, and what was beyond it."""
    try:
        number = model.actuator(name)
    except ValueError as error:
        raise SceneError(str(error)) from None
    if wrong := unusable_actuator(model, number):
        raise SceneError(wrong)
    low, high = control_range(model, number)
    wanted = _numbers(name, command.value, low.size)
    values = np.clip(wanted, low, high)
    return number, values, _said(name, wanted, values, "of control")


def _sole_servos(model: SolidModel, commands: Commands) -> dict[str, ActuatorServo]:
    """Actuators that drive their joint as its servo: those that have it to themselves."""
    told = [name for name, given in commands.items() if isinstance(given, Control)]
    numbers = [model.actuator(name) for name in told if name in model.actuator_names]
    dofs = [int(dof) for number in numbers for dof in driven_by(model, number)]
    return {
        model.actuator_names[servo.number]: servo
        for servo in actuator_servos(model)
        if servo.number in numbers and servo.even
        if dofs.count(int(model.dofs_of(servo.joint)[0])) == 1
    }


def _as_servo(actuator: ActuatorServo, u: float) -> tuple[str, Command, Servo]:
    """Joint, command and servo that the control of a position or velocity actuator means."""
    wanted = actuator.wanted(u)
    if actuator.kind == "velocity":
        return actuator.joint, Velocity(wanted), ServoExact(actuator.limit)
    return actuator.joint, Position(wanted), ServoPD(actuator.frequency, actuator.limit)


def _knots(
    joint: str, command: Position | Velocity, world: World, span: float
) -> tuple[Array, list[str]]:
    """(3, nq) poses now, at the end of the frame and of the frame after, and what was beyond the
    joint's range."""
    model, here, dofs = world.setup.solid, world.solid.q, world.setup.solid.dofs_of(joint)
    move, then = np.zeros(model.nv), None
    if isinstance(command, Velocity):
        move[dofs] = span * _numbers(joint, command.value, dofs.size)
        goal = model.integrate(here, move, 1.0)
    else:
        goal = _pose(model, joint, here, command.value)
        move = model.difference(here, goal)
        if command.then is not None:
            then = _pose(model, joint, goal, command.then)
    allowed, said = within_range(model, here, move), list[str]()
    if not np.array_equal(allowed, move):
        kind, at = joint_kind(model, joint), model.positions_of(joint)
        start = here[at] if at.size == 1 else 0.0
        unit = "rad from here" if kind == BALL else "m" if kind == SLIDE else "rad"
        said = _said(joint, start + move[dofs], start + allowed[dofs], unit)
        goal = model.integrate(here, allowed, 1.0)
    onwards = allowed if then is None else model.difference(goal, then)
    if then is None or not np.array_equal(within_range(model, goal, onwards), onwards):
        then = model.integrate(goal, within_range(model, goal, onwards), 1.0)
    return np.array([here, goal, then]), said


def _pose(model: SolidModel, joint: str, q: Array, value: Numbers) -> Array:
    """(nq,) the pose q with a joint at `value`."""
    pose, at = q.copy(), model.positions_of(joint)
    pose[at] = _numbers(joint, value, at.size)
    if at.size == 4:
        length = float(np.linalg.norm(pose[at]))
        if not 0.999 < length < 1.001:
            raise SceneError(f"the position of '{joint}' is no unit quaternion (w, x, y, z)")
        pose[at] /= length
    return pose


def _numbers(joint: str, value: Any, count: int) -> Array:
    """(count,) finite numbers of a command."""
    try:
        found = np.atleast_1d(np.asarray(value, dtype=np.float64))
    except (TypeError, ValueError):
        found = np.zeros(0)
    if found.shape != (count,) or not np.isfinite(found).all():
        wanted = "a finite number" if count == 1 else f"{count} finite numbers"
        raise SceneError(f"the command to '{joint}' has {value!r:.60}: give {wanted}")
    return found


def _driven_dofs(model: SolidModel, joint: str) -> Integers:
    """Dofs of a joint that can be driven."""
    try:
        dofs = model.dofs_of(joint)
    except ValueError as error:
        raise SceneError(str(error)) from None
    if model.mj.jnt_type[model.joint(joint)] == FREE:
        raise SceneError(f"'{joint}' is a free joint, which nothing drives: tell other joints")
    if model.locked[dofs].any():
        raise SceneError(f"'{joint}' is locked in a slab: tell joints that turn about z")
    return dofs


def drives_of(setup: Setup, others: Drives) -> Drives:
    """The drives of a scene's motions, and others."""
    servos = [(m.dofs, m.servo) for m in setup.motions if isinstance(m, TrajectoryServo)]
    return [*servos, *others]


def servo_of(dofs: Integers, drives: Drives) -> Servo:
    """The servo of dofs: exact where none is known."""
    for owner, servo in drives:
        own = np.isin(owner, dofs)
        if own.any():
            limit = np.broadcast_to(servo.torque_limit, owner.shape)[own]
            if is_dataclass(servo) and np.ndim(servo.torque_limit):
                return replace(servo, torque_limit=tuple(limit.tolist()))
            return servo
    return ServoExact()


def torque_limits(model: SolidModel, joint: str, servo: Servo) -> tuple[Array, Array]:
    """(k,) or (): least and largest torque on a joint, N m or N, by its servo and the model's
    actuatorfrcrange."""
    number, limit = model.joint(joint), np.asarray(servo.torque_limit, dtype=np.float64)
    if not model.mj.jnt_actfrclimited[number]:
        return -limit, limit
    least, most = model.mj.jnt_actfrcrange[number]
    return np.maximum(-limit, least), np.minimum(limit, most)


def _said(joint: str, wanted: Array, given: Array, unit: str) -> list[str]:
    """That what was wanted of a joint, an actuator or a thruster is beyond its limit."""
    if np.array_equal(wanted, given):
        return []
    told, got = (", ".join(f"{x:.4g}" for x in values) for values in (wanted, given))
    return [f"{joint}: {told} is beyond its limit of {got} {unit}"]
