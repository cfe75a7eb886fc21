"""The bodies in a step: they move, then forces and drives change their velocities.

Without a fluid this is the whole step. With one, no body crosses more than one cell in any part of
a step. What a body leaves behind and takes up is known on the mean of both ends alone, so that
fluid leaks through a plate that crosses more than its own thickness: 8.8 % of the dye at 2.4 cells
a step. The fluid's own speed asks for no parts: its transport has substeps (see `fluid.transport`).
"""

from __future__ import annotations

import numpy as np

from flowborne.coupling.cut import pose_and_cut
from flowborne.coupling.drives import joint_command
from flowborne.coupling.operators import generalised, twists
from flowborne.coupling.report import StepReport, timed
from flowborne.coupling.solve import solve_bodies
from flowborne.coupling.step_report import fluid_forces, on_bodies, report_bodies
from flowborne.coupling.stream import forces_on, winds_on
from flowborne.coupling.world import World
from flowborne.fluid.transport import parts_for
from flowborne.kernels.arrays import Array
from flowborne.solids.driven import Driven, drive
from flowborne.solids.dynamics import kinematics
from flowborne.solids.following import followed
from flowborne.solids.model import SolidState
from flowborne.solids.motors import Controls, advanced, motors
from flowborne.solids.prescribed import PrescribedSystem
from flowborne.solids.scratch import cross
from flowborne.solids.trajectories import JointCommand


def move_bodies(world: World, command: JointCommand, dt: float) -> None:
    """Move the positions to the end of the step, in place."""
    q = world.solid.q
    q[:] = world.setup.solid.integrate(q, position_velocity(world, command), dt)


def position_velocity(world: World, command: JointCommand) -> Array:
    """(nv,) velocity with which the positions move in a step.

    A drive with a torque limit may not reach its velocity, so its dof moves with the one it has.
    Where a drive moves bones otherwise than they went, the flesh that they carry moves with them.
    """
    model, q, v = world.setup.solid, world.solid.q, world.solid.v
    exact = command.prescribed & ~np.isfinite(command.torque_limit)
    velocity = np.where(exact, command.rate, v)
    if model.flesh is not None and (velocity != v).any():
        pose = kinematics(model, q) if world.setup.fluid is None else pose_and_cut(world)[0]
        velocity = np.where(exact, velocity, v + followed(model, pose, velocity - v))
    return velocity


def equations(
    world: World, before: SolidState, force: Array, command: JointCommand, dt: float
) -> Driven:
    """The bodies' own equations of motion under a generalised force (nv,), with the drives: those
    of the last step where only that force is another."""
    goal, limit, model = command.final_velocity, command.torque_limit, world.setup.solid
    driven, q, v = command.prescribed, world.solid.q, world.solid.v
    force, added, controls = force + world.told.force_on(model.nv), None, world.told.controls
    world.motors = None if controls is None else motors(model, world.solid, controls, dt)
    if world.motors is not None:
        force, added = force + world.motors.onto, world.motors.matrix
    arrays = q, v, before.q, before.v, driven, goal, limit
    given, found = (model, dt, *(a.tobytes() for a in arrays)), None
    if added is None and world.driven is not None and world.driven[0] == given:
        found = world.driven[1].under(force)
    made = found or drive(model, world.solid, force, dt, before, command, added)
    world.driven = None
    if added is None and isinstance(made, PrescribedSystem):
        world.driven = given, made
    return made


def activate(world: World, dt: float) -> None:
    """Advance the activations of the actuators by dt (s), in place."""
    model, controls = world.setup.solid, world.told.controls
    if world.solid.act.size:
        controls = controls or Controls.none(model)
        world.solid.act = advanced(model, world.solid, controls, dt)


@timed("solids")
def step_bodies(world: World, dt: float, command: JointCommand) -> StepReport:
    """A step without a fluid, in place: simple winds, forces, gravity, joints and contact."""
    model, before, force = world.setup.solid, world.solid.copy(), np.zeros(world.setup.solid.nv)
    move_bodies(world, command, dt)
    known = fluid_forces(model, 0.0)
    if world.setup.winds or world.setup.forces or world.told.forces:
        pose = kinematics(model, world.solid.q)
        wind, applied = winds_on(world, pose), forces_on(world, pose, world.time + dt)
        push = wind.copy()
        push[: applied.size] += applied.ravel()
        force = generalised(pose, push)
        known |= {"centre": pose.mass_centre, "applied_wrench": applied}
        known |= {"wind_wrench": on_bodies(pose, model.flesh, wind)}
    driven = equations(world, before, force, command, dt)
    solved = solve_bodies(driven, command.torque_limit)
    world.solid.v[:] = solved.v
    world.advance_clock(dt)
    return report_bodies(world, dt, solved, known)


def advance_prescribed(world: World, dt: float, command: JointCommand) -> bool:
    """Advance the bodies by dt, in place, if every dof is prescribed: then no force is needed.

    returns  False, and does nothing, if there is a fluid or a dof that answers forces
    """
    if world.setup.fluid is not None:
        return False
    command = joint_command(world, dt, command)
    if not np.all(command.prescribed & np.isinf(command.torque_limit)):
        return False
    activate(world, dt)
    move_bodies(world, command, dt)
    world.solid.v[:] = command.final_velocity
    world.advance_clock(dt)
    return True


def parts_of(world: World, velocity: Array, dt: float) -> int:
    """Number of parts of a step in which the bodies move with `velocity` (nv,) for `dt` (s): no
    point of them crosses more than a cell in a part."""
    fluid = world.setup.fluid
    if fluid is None or fluid.one_way or not velocity.any():
        return 1
    (pose, _), fastest = pose_and_cut(world), 0.0
    shapes = world.setup.shapes
    if shapes.body.size:
        turned = np.einsum("gij,gkj->gki", pose.geom_rotation[shapes.source], shapes.tips)
        at = turned + pose.geom_position[shapes.source][:, None]
        twist = twists(pose, velocity)[shapes.body][:, None]
        speed = twist[..., :3] + cross(twist[..., 3:], at)
        fastest = float(np.linalg.norm(speed, axis=-1).max())
    if pose.vertices.size:
        skin = (pose.vertex_jacobian @ velocity).reshape(-1, 3)
        fastest = max(fastest, float(np.linalg.norm(skin, axis=1).max()))
    return parts_for(fastest * dt / fluid.grid.spacing)


def part_of(command: JointCommand, world: World, left: int) -> JointCommand:
    """What the joints do in the next of `left` parts of what is left of a step: the same, but
    drives that may give way change their velocity evenly."""
    limited = np.isfinite(command.torque_limit)
    if not limited.any():
        return command
    part, v = command.copy(), world.solid.v
    evenly = v + (command.final_velocity - v) / left
    part.final_velocity[limited] = evenly[limited]
    return part
