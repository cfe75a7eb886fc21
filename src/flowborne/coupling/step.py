"""One time step of the coupled world (paper, section 6)."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from flowborne.coupling.advection.scheme import Carried
from flowborne.coupling.flesh import hydrostatic_push, skins_on
from flowborne.coupling.flow import carry_fluid, forced, settle_state, volumes_of
from flowborne.coupling.fractions import Geometry, geometry, uncut
from flowborne.coupling.half_kick import Kick, half_kick
from flowborne.coupling.motion import JointCommand, Trajectory, velocity_after
from flowborne.coupling.mouths import Jet, jet_wrench, jets_of
from flowborne.coupling.operators import (
    boundary_velocity,
    buoyancy_wrench,
    generalised,
    leak_proof,
    on_bodies,
    side_push,
)
from flowborne.coupling.report import Momentum, Outcome, StepReport
from flowborne.coupling.servo import TrajectoryServo
from flowborne.coupling.solve import Solved, solve_bodies, solve_together
from flowborne.coupling.stream import winds_on
from flowborne.coupling.timer import Timer
from flowborne.coupling.world import Setup, World
from flowborne.fluid.grid import Array, Faces
from flowborne.fluid.momentum import face_masses, fluid_momentum, momentum_change
from flowborne.solids.driven import Driven, drive
from flowborne.solids.dynamics import Kinematics, kinematics
from flowborne.solids.following import follow
from flowborne.solids.model import SolidModel
from flowborne.solids.momentum import halfway_momentum
from flowborne.solids.state import SolidState


def step(world: World, dt: float, command: JointCommand | None = None) -> StepReport:
    """Advance `world` by dt, in place (section 6).

    command    what the controlled dofs do; the setup's prescribed motions are added to it
    returns  the report; its outcome is not DONE when the numbers cannot be trusted, and the world
             cannot be stepped on
    """
    timer = Timer()
    if not world.setup.trial:
        world.ahead = 0.5 * dt
    command = joint_command(world, dt, command)
    if world.setup.fluid is None:
        return step_bodies(world, dt, command, timer)
    return step_together(world, dt, command, timer)


def step_bodies(world: World, dt: float, command: JointCommand, timer: Timer) -> StepReport:
    """A step without a fluid: simple winds, gravity, joints and contact."""
    model, before = world.setup.solid, move_positions(world, command, dt)
    wind, force, pose = np.zeros((model.nbody, 6)), np.zeros(model.nv), None
    if world.setup.winds:
        pose = kinematics(model, world.solid.q)
        wind = winds_on(world, pose)
        force = generalised(pose, np.append(wind, np.zeros(pose.vertices.size)))
    driven = equations_under(world, before, force, command, dt)
    solved = solve_bodies(driven, command.torque_limit, wind.size)
    world.solid.v[:] = solved.v
    advance_clock(world, dt)
    timer.lap("solids")
    none = np.zeros(wind.shape)
    return report(world, pose, solved, none.ravel(), wind, none, Momentum(), dt, timer)


def step_together(world: World, dt: float, command: JointCommand, timer: Timer) -> StepReport:
    """A step of bodies and fluid (section 6)."""
    fluid, state = world.flow()
    cut_before = cut_by_bodies(world)
    blown = jets_at(world, cut_before, world.time)
    timer.lap("geometry")
    start = volumes_of(world, cut_before)
    kick = half_kick(world, cut_before, start, dt)
    timer.lap("advection")
    # the bodies move with the velocity they have, driven joints as they are told
    before, pose = move_bodies(world, command, dt)
    timer.lap("solids")
    cut = cut_by_bodies(world, pose)
    timer.lap("geometry")
    # velocity and scalars are carried by the leak-proof field
    carried, dyed = carry_fluid(world, kick.velocity, before, cut_before, start, cut, blown, dt)
    blown, mass = carried.jets, face_masses(carried.volumes, fluid.density)
    velocity = forced(carried.velocity, cut.open, mass, fluid, world.time + dt, dt)
    timer.lap("advection")
    if not all(np.isfinite(u).all() for u in velocity):
        return broken_off(world, Outcome.ADVECTION_NOT_FINITE, dt, timer)
    # forces on the bodies, and their own equations of motion
    wind = winds_on(world, pose)
    buoyancy = buoyant_push(world.setup.solid, pose, fluid.density)
    reaction = jet_wrench(blown, fluid.density, len(wind))
    push = buoyancy + kick.impulse / dt
    push[: wind.size] += (wind + reaction).ravel()
    driven = equations(world, before, pose, push, command, dt)
    timer.lap("solids")
    # viscosity, pressure, bodies, joints and contact in one solve (item 6)
    jets = jets_at(world, cut, world.time + dt, pose)
    solved = solve_together(
        world, velocity, mass, driven, pose, cut, jets, command.torque_limit, timer
    )
    timer.lap("projection")
    # the new state, with the leak-proof field of the next step (item 4)
    assert solved.projected is not None
    world.solid.v[:] = solved.v
    leak_free = leak_proof(
        solved.projected.velocity, cut, boundary_velocity(pose, solved.v), fluid.grid
    )
    settle_state(world, carried, kick.velocity, solved.projected.velocity, leak_free, dt)
    state.earlier[:] = state.pressure + kick.pressure
    state.pressure[:] = kick.pressure + solved.projected.pressure
    state.scalars = dyed.scalars
    advance_clock(world, dt)
    balance = momentum_balance(world, cut, mass, kick, carried, solved)
    timer.lap("advection")
    done = report(
        world, pose, with_kick(solved, kick), buoyancy, wind, reaction, balance, dt, timer
    )
    done.expelled, done.dye_error = dt * sum(jet.rate for jet in blown), dyed.error
    return done


def move_as_told(world: World, dt: float, command: JointCommand) -> bool:
    """Advance bodies by dt, in place, where every dof is told how to move: no force is asked for.

    returns  False, and does nothing, where there is a fluid or a dof that answers forces
    """
    if world.setup.fluid is not None:
        return False
    command = joint_command(world, dt, command)
    if not np.all(command.prescribed & np.isinf(command.torque_limit)):
        return False
    move_positions(world, command, dt)
    world.solid.v[:] = command.final_velocity
    advance_clock(world, dt)
    return True


def joint_command(world: World, dt: float, command: JointCommand | None) -> JointCommand:
    """The drive with prescribed motions and a slab's locked dofs added."""
    model = world.setup.solid
    command = JointCommand.none(model.nv) if command is None else command.copy()
    for told in world.setup.motions:
        later = world.time + dt
        if isinstance(told, TrajectoryServo):
            # a drive that may give way moves with the velocity it has: it steers the step after
            v = world.solid.v[told.dofs]
            after = gap_to(world, told, later + dt) - dt * v
            final_velocity, _ = told.servo.velocity(after, v, dt, dt)
            limit = np.asarray(told.servo.torque_limit, dtype=np.float64)
            command.set(told.dofs, v, final_velocity, limit)
        else:
            # v is that of half a step on (leapfrog), of driven dofs as of those that answer them;
            # a trial keeps to the world's own, so that its velocities change over just its step
            rate = gap_to(world, told, later) / dt
            span = 2.0 * world.ahead
            ahead = told.velocity(later)
            if span > 0.0:
                ahead = velocity_after(model, world.solid.q, told, later, span)
            command.set(told.dofs, rate, ahead)
    command.set(model.locked, 0.0, 0.0)
    return command


def gap_to(world: World, told: Trajectory, time: float) -> Array:
    """(k,) displacement of a motion's dofs from where they are to where it is at `time` (s)."""
    model, goal = world.setup.solid, world.solid.q.copy()
    goal[model.indices_of(told.dofs)] = told.position(time)
    return model.difference(world.solid.q, goal)[told.dofs]


def cut_by_bodies(world: World, pose: Kinematics | None = None) -> Geometry:
    """The grid cut by the bodies where they are: once for each pose, and kept beside it.

    pose  of the bodies at the world's positions, where it is known
    """
    if world.cut is None or not np.array_equal(world.cut[0], world.solid.q):
        if pose is None:
            pose = kinematics(world.setup.solid, world.solid.q)
        world.cut = world.solid.q.copy(), cut_at(world.setup, pose)
    return world.cut[1]


def cut_at(setup: Setup, pose: Kinematics) -> Geometry:
    """The grid cut by the bodies in a pose."""
    assert setup.fluid is not None
    seen = None if setup.fluid.one_way else setup.solid.flesh
    if setup.shapes.body.size == 0 and seen is None:
        return uncut(setup.fluid.grid, pose.vertices)
    return geometry(
        setup.shapes,
        pose.geom_position[setup.shapes.source],
        pose.geom_rotation[setup.shapes.source],
        skins_on(setup.fluid.grid, setup.fluid.boundaries, seen, pose.vertices),
        setup.solid.nbody,
        setup.fluid.grid,
        setup.fluid.boundaries,
    )


def jets_at(
    world: World, cut: Geometry, time: float, pose: Kinematics | None = None
) -> tuple[Jet, ...]:
    """What the mouths do at `time` (s) where the bodies are.

    raises  ValueError when a mouth covers no cell
    """
    setup = world.setup
    if not setup.mouths:
        return ()
    if pose is None:
        pose = kinematics(setup.solid, world.solid.q)
    return jets_of(setup.mouths, cut, pose, world.solid.v, world.flow()[0].grid, time)


def move_bodies(world: World, command: JointCommand, dt: float) -> tuple[SolidState, Kinematics]:
    """Move the bodies to the end of the step, in place; gives the state before and the new pose."""
    before = move_positions(world, command, dt)
    return before, kinematics(world.setup.solid, world.solid.q)


def move_positions(world: World, command: JointCommand, dt: float) -> SolidState:
    """Move the positions to the end of the step, in place; gives the state before.

    A drive with a torque limit may give way, so its dof moves with the velocity it has. Where a
    drive moves bones otherwise than they went, the flesh that they carry moves with them.
    """
    before = world.solid.copy()
    told = command.prescribed & ~np.isfinite(command.torque_limit)
    otherwise = np.where(told, command.rate - before.v, 0.0)
    velocity = before.v + follow(world.setup.solid, before.q, otherwise)
    velocity[told] = command.rate[told]
    world.solid.q[:] = world.setup.solid.integrate(before.q, velocity, dt)
    return before


def equations(
    world: World,
    before: SolidState,
    pose: Kinematics,
    push: Array,
    command: JointCommand,
    dt: float,
) -> Driven:
    """The bodies' own equations of motion under a push (k,), with the drives in force."""
    return equations_under(world, before, generalised(pose, push), command, dt)


def equations_under(
    world: World, before: SolidState, force: Array, command: JointCommand, dt: float
) -> Driven:
    """As `equations`, under a generalised force (nv,)."""
    told, goal = command.prescribed, command.final_velocity
    return drive(
        world.setup.solid, world.solid, force, dt, before, told, goal, command.torque_limit
    )


def buoyant_push(model: SolidModel, pose: Kinematics, density: float) -> Array:
    """(k,) Archimedes' force on every body, and that on the vertices of flesh, N and N m."""
    wrench = buoyancy_wrench(pose.centroid, model.volume, model.gravity, density)
    if model.flesh is None:
        return wrench.ravel()
    surface = model.flesh.surface
    return np.append(wrench, hydrostatic_push(pose.vertices, surface, model.gravity, density))


def advance_clock(world: World, dt: float) -> None:
    world.time += dt
    world.steps += 1


def with_kick(solved: Solved, kick: Kick) -> Solved:
    """What the pressure of the whole step did."""
    assert solved.projected is not None
    whole = replace(
        solved.projected,
        pressure=solved.projected.pressure + kick.pressure,
        impulse=solved.projected.impulse + kick.impulse,
    )
    return replace(solved, projected=whole)


def linear(push: Array, first: int) -> Array:
    """(n, 3) the forces in a push (k,), whose wrenches on bodies end at `first`."""
    return np.concatenate([push[:first].reshape(-1, 6)[:, :3], push[first:].reshape(-1, 3)])


def momentum_balance(
    world: World, cut: Geometry, mass: Faces, kick: Kick, carried: Carried, solved: Solved
) -> Momentum:
    """Where the fluid's momentum came from and went to in a step that ends at the cut `cut`."""
    fluid, _ = world.flow()
    projected, before = solved.projected, solved.before_pressure
    assert projected is not None
    assert before is not None
    dt, grid, boundaries = solved.driven.system.dt, fluid.grid, fluid.boundaries
    pressed = fluid_momentum(before, mass, grid, boundaries)
    taken, moved = momentum_change(before, projected.velocity, mass, grid, boundaries)
    after = fluid_momentum(projected.velocity, mass, grid, boundaries)
    first = 6 * world.setup.solid.nbody
    forces = linear(projected.impulse, first)
    sides = dt * side_push(projected.pressure, cut.open, grid, boundaries)
    exchanged = forces.sum(axis=0)
    scale = float(np.abs(forces).sum()) + moved
    missing = float(np.abs(exchanged + taken - sides).max())
    sides += kick.sides
    exchanged += linear(kick.impulse, first).sum(axis=0)
    forces = pressed - fluid_momentum(carried.velocity, mass, grid, boundaries)
    came = carried.crossed + carried.expelled + carried.lost
    given = came + carried.stopped + forces + sides - exchanged
    unknown = float(np.abs(after - kick.start - given).max())
    return Momentum(
        fluid=after,
        exchanged=exchanged,
        exchange_error=missing / scale if scale > 0.0 else 0.0,
        advection=carried.lost,
        boundary=sides + carried.stopped,
        crossed=carried.crossed,
        jet=carried.expelled,
        forces=forces,
        budget_error=unknown / scale if scale > 0.0 else 0.0,
    )


def broken_off(world: World, outcome: Outcome, dt: float, timer: Timer) -> StepReport:
    """What a step did that ends before its solve: nothing is known of forces."""
    model = world.setup.solid
    wrench, unknown = np.full((model.nbody, 6), np.nan), np.full(model.nv, np.nan)
    return StepReport(
        dt=dt,
        outcome=outcome,
        velocity=unknown,
        actuator=unknown,
        pressure_wrench=wrench,
        viscous_wrench=wrench,
        buoyancy_wrench=wrench,
        wind_wrench=wrench,
        jet_wrench=wrench,
        added_mass_wrench=wrench,
        centre=wrench[:, :3],
        seconds=timer.seconds,
    )


def report(
    world: World,
    pose: Kinematics | None,
    solved: Solved,
    buoyancy: Array,
    wind: Array,
    reaction: Array,
    balance: Momentum,
    dt: float,
    timer: Timer,
) -> StepReport:
    """What the step did; its pose is needed where a fluid or a wind acts."""
    projected, flesh = solved.projected, world.setup.solid.flesh
    balance.solid = halfway_momentum(world.setup.solid, world.solid, dt)[0]
    finite = bool(np.isfinite(solved.v).all())
    if projected is not None:
        finite = finite and bool(np.isfinite(projected.pressure).all())
    halfway = 0.5 * (solved.driven.system.v + solved.v)
    done = StepReport(
        dt=dt,
        outcome=solved.outcome if finite else Outcome.NOT_FINITE,
        velocity=halfway,
        actuator=solved.actuator,
        pressure_wrench=np.zeros(wind.shape),
        viscous_wrench=np.zeros(wind.shape),
        buoyancy_wrench=np.zeros(wind.shape),
        wind_wrench=wind,
        jet_wrench=reaction,
        added_mass_wrench=np.zeros(wind.shape),
        centre=np.zeros((len(wind), 3)) if pose is None else pose.mass_centre,
        momentum=balance,
        work=dt * float(solved.actuator @ halfway),
        contacts=solved.driven.system.contacts,
        limited=solved.driven.limited.nonzero()[0],
        unsettled=solved.unsettled,
        seconds=timer.seconds,
    )
    if projected is not None:
        assert pose is not None
        carried = np.zeros((0, len(wind))) if flesh is None else flesh.carried
        done.pressure_wrench = on_bodies(pose, carried, projected.impulse / dt)
        done.viscous_wrench = on_bodies(pose, carried, solved.viscous_impulse / dt)
        done.buoyancy_wrench = on_bodies(pose, carried, buoyancy)
        done.added_mass_wrench = on_bodies(pose, carried, solved.added_mass / dt)
        done.iterations, done.residual = projected.iterations, projected.residual
        done.divergence, done.fastest = projected.divergence, projected.fastest
    return done
