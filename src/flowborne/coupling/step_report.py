"""What a step reports about the bodies and the fluid's momentum, filled in as it becomes known."""

from __future__ import annotations

from dataclasses import fields, replace

import numpy as np

from flowborne.coupling.flesh import hydrostatic_push
from flowborne.coupling.flow import AdvectionResult
from flowborne.coupling.half_pressure import HalfPressure
from flowborne.coupling.mouths import Jet, jet_wrench
from flowborne.coupling.operators import buoyancy_wrench
from flowborne.coupling.report import Momentum, Outcome, StepReport, Timer
from flowborne.coupling.solve import Solved
from flowborne.coupling.stream import winds_on
from flowborne.coupling.world import World
from flowborne.fluid.control_volumes import fluid_momentum, momentum_change
from flowborne.fluid.grid import Array, Faces
from flowborne.solids.dynamics import Kinematics
from flowborne.solids.flesh import Flesh
from flowborne.solids.momentum import halfway_momentum


def blank(world: World, dt: float, timer: Timer) -> StepReport:
    """The report of a step of which nothing is known: forces are nan, or 0 without a fluid."""
    model, force = world.setup.solid, 0.0 if world.setup.fluid is None else np.nan
    wrench, drives = np.full((model.nbody, 6), force), np.full(model.nv, force)
    return StepReport(
        dt=dt,
        outcome=Outcome.DONE,
        velocity=drives,
        acceleration=drives,
        actuator=drives,
        pressure_wrench=wrench,
        viscous_wrench=wrench,
        buoyancy_wrench=wrench,
        wind_wrench=wrench,
        jet_wrench=wrench,
        added_mass_wrench=wrench,
        centre=wrench[:, :3],
        seconds=timer.seconds,
    )


def known_push(
    done: StepReport, world: World, pose: Kinematics, half: Array, jets: tuple[Jet, ...]
) -> Array:
    """(k,) force on the bodies that is known before the solve, N and N m: of winds, of jets, of the
    hydrostatic pressure, and of half of the last pressure with the impulse `half` (k,)."""
    model, density = world.setup.solid, world.flow()[0].density
    buoyancy = buoyancy_wrench(pose.centroid, model.volume, model.gravity, density).ravel()
    if model.flesh is not None:
        surface = model.flesh.surface
        pressed = hydrostatic_push(pose.vertices, surface, model.gravity, density)
        buoyancy = np.append(buoyancy, pressed)
    done.expelled = done.dt * sum(jet.rate for jet in jets)
    done.wind_wrench = winds_on(world, pose)
    done.jet_wrench = jet_wrench(jets, density, model.nbody)
    done.buoyancy_wrench = on_bodies(pose, model.flesh, buoyancy)
    push = buoyancy + half / done.dt
    push[: 6 * model.nbody] += (done.wind_wrench + done.jet_wrench).ravel()
    return push


def report_bodies(done: StepReport, world: World, solved: Solved) -> None:
    """What the solve gave to the bodies and their drives."""
    before, model, told = solved.driven.system.v, world.setup.solid, world.setup.told
    done.velocity, done.acceleration = 0.5 * (before + solved.v), (solved.v - before) / done.dt
    done.actuator = solved.actuator + told.force_on(model.nv)
    done.work = done.dt * float(done.actuator @ done.velocity)
    done.momentum.solid = halfway_momentum(model, world.solid, done.dt)[0]
    done.contacts, done.limited = solved.driven.system.contacts, solved.driven.limited.nonzero()[0]
    done.outcome, done.unsettled = solved.outcome, solved.unsettled
    if not np.isfinite(solved.v).all():
        done.outcome = Outcome.NOT_FINITE


def report_coupled(
    done: StepReport, world: World, pose: Kinematics, half: Array, solved: Solved
) -> None:
    """`report_bodies`, the forces of the fluid on the bodies, and how well the solve did."""
    report_bodies(done, world, solved)
    projected, flesh, dt = solved.projected, world.setup.solid.flesh, done.dt
    assert projected is not None
    done.centre = pose.mass_centre
    done.pressure_wrench = on_bodies(pose, flesh, (projected.impulse + half) / dt)
    done.viscous_wrench = on_bodies(pose, flesh, solved.viscous_impulse / dt)
    done.added_mass_wrench = on_bodies(pose, flesh, solved.added_mass / dt)
    done.iterations, done.residual = projected.iterations, projected.residual
    done.divergence, done.fastest = projected.divergence, projected.fastest
    if not np.isfinite(projected.pressure).all():
        done.outcome = Outcome.NOT_FINITE


def on_bodies(pose: Kinematics, flesh: Flesh | None, push: Array) -> Array:
    """(nbody, 6) wrench of a push (k,) on every body with the flesh that it carries."""
    if flesh is None:
        return push.reshape(-1, 6)
    first = push.size - pose.vertices.size
    force = push[first:].reshape(-1, 3)
    wrench = np.concatenate([force, np.cross(pose.vertices, force)], axis=1)
    return push[:first].reshape(-1, 6) + flesh.carried.T @ wrench


def momentum_balance(
    world: World, mass: Faces, half: HalfPressure, advected: AdvectionResult, solved: Solved
) -> Momentum:
    """The fluid's budget of a step that ends with the masses `mass` of the faces."""
    fluid, _ = world.flow()
    projected, before = solved.projected, solved.before_pressure
    assert projected is not None
    assert before is not None
    grid, boundaries = fluid.grid, fluid.boundaries
    first = 6 * world.setup.solid.nbody
    pressed = fluid_momentum(before, mass, grid, boundaries)
    taken, moved = momentum_change(before, projected.velocity, mass, grid, boundaries)
    after = fluid_momentum(projected.velocity, mass, grid, boundaries)
    pushes = linear(projected.impulse, first)
    exchanged = pushes.sum(axis=0)
    scale = float(np.abs(pushes).sum()) + moved
    missing = float(np.abs(exchanged + taken - projected.sides).max())
    sides = projected.sides + half.sides
    exchanged += linear(half.impulse, first).sum(axis=0)
    forces = pressed - fluid_momentum(advected.velocity, mass, grid, boundaries)
    given = advected.crossed + advected.expelled + advected.stopped + forces + sides - exchanged
    unknown = float(np.abs(after - half.start - given).max())
    return Momentum(
        fluid=after,
        exchanged=exchanged,
        exchange_error=missing / scale if scale > 0.0 else 0.0,
        boundary=sides + advected.stopped,
        crossed=advected.crossed,
        jet=advected.expelled,
        forces=forces,
        budget_error=unknown / scale if scale > 0.0 else 0.0,
    )


def linear(push: Array, first: int) -> Array:
    """(n, 3) the forces in a push (k,), with the wrenches on bodies before index `first`."""
    return np.concatenate([push[:first].reshape(-1, 6)[:, :3], push[first:].reshape(-1, 3)])


def joined(reports: list[StepReport]) -> StepReport:
    """The report of a step from those of its parts: means of forces, sums of what was exchanged,
    and the state at the end."""
    last = reports[-1]
    if len(reports) == 1:
        return last

    budget = [report.momentum for report in reports]
    sums = ("exchanged", "advection", "boundary", "crossed", "jet", "forces")
    momentum = replace(
        last.momentum,
        **{name: np.sum([getattr(m, name) for m in budget], axis=0) for name in sums},
        exchange_error=max(m.exchange_error for m in budget),
        budget_error=max(m.budget_error for m in budget),
    )
    means = [f.name for f in fields(StepReport) if f.name.endswith("_wrench")]
    means += ["actuator", "centre"]
    return replace(
        last,
        dt=sum(report.dt for report in reports),
        **{n: np.mean([getattr(r, n) for r in reports], axis=0) for n in means},
        iterations=sum(r.iterations for r in reports),
        divergence=max(r.divergence for r in reports),
        fastest=max(r.fastest for r in reports),
        momentum=momentum,
        work=sum(r.work for r in reports),
        expelled=sum(r.expelled for r in reports),
        dye_error=max(r.dye_error for r in reports),
        seconds={k: sum(r.seconds.get(k, 0.0) for r in reports) for k in last.seconds},
        limited=np.unique(np.concatenate([r.limited for r in reports])),
    )
