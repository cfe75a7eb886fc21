"""The report of a step, made at its end from what was solved for."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from flowborne.coupling.flesh import hydrostatic_push
from flowborne.coupling.flow import AdvectionResult
from flowborne.coupling.half_pressure import HalfPressure
from flowborne.coupling.mouths import Jet, jet_wrench
from flowborne.coupling.operators import buoyancy_wrench
from flowborne.coupling.report import FIELDS, Asked, Outcome, StepReport
from flowborne.coupling.solve import Solved, SolvedFlow
from flowborne.coupling.stream import forces_on, winds_on
from flowborne.coupling.thrusters import Disc, thrust_wrench
from flowborne.coupling.world import Setup, World
from flowborne.fluid.control_volumes import momentum_changes
from flowborne.kernels.arrays import Array
from flowborne.kernels.faces import is_finite
from flowborne.solids.dynamics import Kinematics
from flowborne.solids.flesh import Flesh
from flowborne.solids.model import SolidModel
from flowborne.solids.momentum import halfway_momentum
from flowborne.solids.scratch import cross

WRENCHES = [name for name in FIELDS if name.endswith("_wrench")]
UNKNOWN = {
    name: np.full(3, np.nan) if made.axes else np.nan
    for name, made in FIELDS.items()
    if name.startswith("momentum_")
}
"""What reports say of momenta without balances."""


def fluid_forces(model: SolidModel, value: float) -> dict[str, Any]:
    """What a report says of forces on bodies where all are `value`: 0, or nan if not known."""
    wrench = np.full((model.nbody, 6), value)
    around = {"centre": wrench[:, :3], "added_mass": Asked(lambda: wrench, kept=True)}
    return dict.fromkeys(WRENCHES, wrench) | around


def report_failed(setup: Setup, dt: float, outcome: Outcome) -> StepReport:
    """Of a step that ended before its solve."""
    model, thrust = setup.solid, np.full(len(setup.thrusters), np.nan)
    drives, known = np.full(model.nv, np.nan), fluid_forces(model, np.nan)
    known |= {"thrust": thrust, "jet_power": thrust, "disc_water": thrust}
    known |= dict.fromkeys(("output", "output_power"), np.full(model.outputs, np.nan))
    return StepReport(dt, outcome, drives, drives, drives, **known)


def report_bodies(world: World, dt: float, solved: Solved, known: dict[str, Any]) -> StepReport:
    """Of a step without a fluid.

    known  what the report says of the forces of winds and of the fluid
    """
    before, model = solved.driven.system.v, world.setup.solid
    velocity = 0.5 * (before + solved.v)
    actuator = solved.actuator + world.told.force_on(model.nv)
    work, (outputs, rates) = dt * float(actuator @ velocity), np.zeros((2, model.outputs))
    if world.motors is not None:
        outputs, onto = world.motors.through(solved.v - before)
        rates, work = world.motors.moment @ velocity, work + dt * float(onto @ velocity)
        own = solved.driven.prescribed | solved.driven.limited
        actuator = np.where(own, actuator, actuator + onto)
    for number, dof in world.told.servos:
        place, gear = model.mj.actuator_outadr[number], model.mj.actuator_gear[number, 0]
        outputs[place], rates[place] = actuator[dof] / gear, gear * velocity[dof]
    balance = UNKNOWN
    if world.setup.balances:
        balance = {"momentum_solid": halfway_momentum(model, world.solid, dt)[0]}
    return StepReport(
        dt,
        solved.outcome if np.isfinite(solved.v).all() else Outcome.NOT_FINITE,
        velocity,
        (solved.v - before) / dt,
        actuator,
        work=work,
        contacts=solved.driven.system.contacts,
        limited=solved.driven.limited.nonzero()[0],
        unsettled=solved.unsettled,
        output=outputs,
        output_power=outputs * rates,
        **balance | known,
    )


def known_forces(
    world: World,
    pose: Kinematics,
    half: Array,
    jets: tuple[Jet, ...],
    discs: tuple[Disc, ...],
    dt: float,
) -> tuple[Array, dict[str, Any]]:
    """(k,) force on the bodies that is known before the solve, N and N m: of winds, of forces from
    outside and thrusters at the end of the step, of jets, of the hydrostatic pressure, and of half
    of the last pressure with the impulse `half` (k,); and what the report says of it."""
    model, density = world.setup.solid, world.flow()[0].density
    buoyancy = buoyancy_wrench(pose.centroid, model.volume, model.gravity, density).ravel()
    if model.flesh is not None:
        surface = model.flesh.surface
        pressed = hydrostatic_push(pose.vertices, surface, model.gravity, density)
        buoyancy = np.append(buoyancy, pressed)
    wind, jet = winds_on(world, pose), jet_wrench(jets, density, model.nbody)
    push = buoyancy + half / dt + wind
    applied = forces_on(world, pose, world.time + dt) + thrust_wrench(discs, model.nbody)
    push[: 6 * model.nbody] += (applied + jet).ravel()
    return push, {
        "buoyancy_wrench": on_bodies(pose, model.flesh, buoyancy),
        "wind_wrench": on_bodies(pose, model.flesh, wind),
        "applied_wrench": applied,
        "jet_wrench": jet,
        "expelled": dt * sum(jet.rate for jet in jets),
    }


def thrust_of(discs: tuple[Disc, ...], solved: SolvedFlow, pose: Kinematics) -> dict[str, Any]:
    """What the report says of thrusters."""
    v = 0.5 * (solved.driven.system.v + solved.v)
    return {
        "thrust": np.array([disc.thrust for disc in discs]),
        "jet_power": np.array([disc.power(solved.velocity, pose, v) for disc in discs]),
        "disc_water": np.array([disc.water for disc in discs]),
    }


def report_coupled(
    world: World,
    dt: float,
    pose: Kinematics,
    half: HalfPressure,
    advected: AdvectionResult,
    solved: SolvedFlow,
    known: dict[str, Any],
) -> StepReport:
    """Of a step with a fluid: forces on the bodies, the budget of momentum, how well the solve did.

    known  what the report says of forces known before the solve, and of dyes
    """
    flesh, added = world.setup.solid.flesh, solved.added_mass

    def added_mass() -> Array:
        return on_bodies(pose, flesh, (added() if callable(added) else added) / dt)

    world.splitting = (*world.splitting, added_mass)
    if world.setup.balances:
        known |= momentum_budget(world, half, advected, solved)
    known |= {
        "centre": pose.mass_centre,
        "pressure_wrench": on_bodies(pose, flesh, (solved.impulse + half.impulse) / dt),
        "viscous_wrench": on_bodies(pose, flesh, solved.viscous_impulse / dt),
        "added_mass": Asked(added_mass, kept=not callable(added)),
        "solver_iterations": solved.iterations,
        "residual": solved.residual,
        "sweeps": solved.sweeps,
        "sweep_error": solved.sweep_error,
        "divergence": solved.divergence,
        "fastest": solved.fastest,
    }
    done = report_bodies(world, dt, solved, known)
    finite = is_finite(solved.pressure)
    return done if finite else replace(done, outcome=Outcome.NOT_FINITE)


def on_bodies(pose: Kinematics, flesh: Flesh | None, push: Array) -> Array:
    """(nbody, 6) wrench of a push (k,) on every body with the flesh that it carries."""
    if flesh is None:
        return push.reshape(-1, 6)
    first = push.size - pose.vertices.size
    force = push[first:].reshape(-1, 3)
    wrench = np.concatenate([force, cross(pose.vertices, force)], axis=1)
    return push[:first].reshape(-1, 6) + flesh.carried.T @ wrench


def momentum_budget(
    world: World, half: HalfPressure, advected: AdvectionResult, solved: SolvedFlow
) -> dict[str, Any]:
    """What the report says of the fluid's momentum."""
    (fluid, _), volumes = world.flow(), advected.volumes.moving
    before, grid, boundaries = solved.before_pressure, fluid.grid, fluid.boundaries
    first = 6 * world.setup.solid.nbody
    fields = advected.velocity, before, solved.velocity
    sums = momentum_changes(fields, volumes, fluid.density, grid, boundaries)
    carried, pressed, after, taken, moved = sums
    pushes = linear(solved.impulse, first)
    exchanged = pushes.sum(axis=0)
    scale = float(np.abs(pushes).sum() + moved.sum())
    missing = float(np.abs(exchanged + taken - solved.sides).max())
    sides = solved.sides + half.sides
    exchanged += linear(half.impulse, first).sum(axis=0)
    forces = pressed - carried
    given = advected.crossed + advected.expelled + advected.stopped + forces + sides - exchanged
    unknown = float(np.abs(after - half.start - given).max())
    return {
        "momentum_fluid": after,
        "momentum_exchanged": exchanged,
        "momentum_boundary": sides + advected.stopped,
        "momentum_crossed": advected.crossed,
        "momentum_jet": advected.expelled,
        "momentum_forces": forces,
        "momentum_exchange_error": missing / scale if scale > 0.0 else 0.0,
        "momentum_budget_error": unknown / scale if scale > 0.0 else 0.0,
    }


def linear(push: Array, first: int) -> Array:
    """(n, 3) the forces in a push (k,), with the wrenches on bodies before index `first`."""
    return np.concatenate([push[:first].reshape(-1, 6)[:, :3], push[first:].reshape(-1, 3)])
