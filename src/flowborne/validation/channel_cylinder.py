"""Flow past a fixed cylinder in a channel: B1 steady, B2 with vortices, B3 a pulse of inflow."""

from __future__ import annotations

import numpy as np

from flowborne import Array, Grid, StepReport, World
from flowborne.validation.case import Case, Tier, reference
from flowborne.validation.findings import Curve, Finding, Plot, falling
from flowborne.validation.shedding import (
    AFTER,
    BEFORE,
    CFL,
    PERIODS,
    Kicked,
    Stream,
    crest,
    cylinder,
    judged,
    watch,
)
from flowborne.validation.worlds import Parabola, recorded, refined, whole_steps
from flowborne.worlds import (
    Boundaries,
    BoundaryInflow,
    BoundaryNoSlip,
    BoundaryOpen,
    Profile,
    advance,
    make_world,
)

DIAMETER, CENTRE = 0.1, 0.2
"""m: of the cylinder, and both coordinates of its centre."""

LENGTH, HEIGHT = 2.2, 0.41
"""m, of the channel."""

VISCOSITY = 1e-3
"""Pa s; the fluid's density is 1 kg/m^3."""

GRIDS = {True: (10,), False: (10, 20, 40)}
"""Cells across D of B2 and B3, by quick; multiples of 10 fit the channel."""

CREEPING = Stream(DIAMETER, 0.2, 0.3)
SHEDDING = Stream(DIAMETER, 1.0, 1.5)
"""B1; B2 and B3."""

DURATION = 8.0
"""s of B3, half a period of the inflow."""


def pulsed_inflow(x: Array, y: Array, z: Array, time: float) -> tuple[Array, Array, Array]:
    """Inflow of the channel that starts and ends at rest, as a profile."""
    return Parabola(SHEDDING.fastest * np.sin(np.pi * time / DURATION))(x, y, z)


def channel(cells: int, inflow: Profile) -> World:
    """The channel at rest with the cylinder in it, `cells` across its diameter."""
    h = DIAMETER / cells
    grid = Grid.slab(round(LENGTH / h), round(HEIGHT / h), h, (0.0, 0.0))
    wall = BoundaryNoSlip()
    return make_world(
        cylinder(DIAMETER, CENTRE, CENTRE),
        grid,
        viscosity=VISCOSITY,
        boundaries=Boundaries(BoundaryInflow(inflow), BoundaryOpen(), wall, wall),
        tolerance=1e-7,
    )


def pressure_drop(world: World) -> float:
    """p at the front of the cylinder less p at its back, Pa.

    Extrapolated to them along the centre line, which runs between two rows of cells.
    """
    fluid, state = world.flow()
    h = fluid.grid.spacing
    j = round(CENTRE / h)
    row = 0.5 * (state.pressure[:, j - 1, 0] + state.pressure[:, j, 0])
    front = round((CENTRE - 0.5 * DIAMETER) / h)
    back = round((CENTRE + 0.5 * DIAMETER) / h)
    before = 1.5 * row[front - 1] - 0.5 * row[front - 2]
    behind = 1.5 * row[back] - 0.5 * row[back + 1]
    return float(before - behind)


def recirculation(world: World) -> float:
    """Length of the backflow behind the cylinder, m."""
    fluid, state = world.flow()
    h = fluid.grid.spacing
    j = round(CENTRE / h)
    row = 0.5 * (state.velocity[0][:, j - 1, 0] + state.velocity[0][:, j, 0])
    start = round((CENTRE + 0.5 * DIAMETER) / h) + 1
    i = start + int(np.argmax(row[start:] > 0.0))
    return float(h * (i - row[i] / (row[i] - row[i - 1])) - CENTRE - 0.5 * DIAMETER)


def steady_flow(world: World, change: float) -> tuple[float, float]:
    """Drag and lift coefficient of B1, when they change by less than `change` in a time D/U, or
    after 40 D/U."""
    fluid, _ = world.flow()
    dt = CFL * fluid.grid.spacing / CREEPING.fastest
    old = np.full(2, np.inf)
    for _ in range(40):
        new = np.array(CREEPING.coefficients(advance(world, dt, round(CREEPING.time / dt))))
        if np.abs(new - old).max() < change:
            break
        old = new
    return float(new[0]), float(new[1])


def steady_cylinder(quick: bool) -> list[Finding]:
    """B1: from the undisturbed flow on the coarsest grid, from the coarser one's on the others."""
    grids, inflow = (10,) if quick else (20, 40, 80), Parabola(CREEPING.fastest)
    rows = []
    for _, world, _ in refined(grids, lambda n: channel(n, inflow), inflow):
        forces = steady_flow(world, 1e-2 if quick else 2e-5)
        rows.append((*forces, pressure_drop(world), recirculation(world)))
    drag, lift, drop, length = zip(*rows, strict=True)
    return [
        falling(judged("B1", "cD", grids, drag, (5.57, 5.59))),
        falling(judged("B1", "cL", grids, lift, (0.0104, 0.0110))),
        judged("B1", "dp", grids, drop, (0.1172, 0.1176)),
        judged("B1", "La", grids, length, (0.0842, 0.0852)),
    ]


def shedding_in_channel(quick: bool) -> list[Finding]:
    """B2: largest coefficients over some periods, frequency, and the pressure drop half a period
    after the largest lift."""
    grids, periods = GRIDS[quick], PERIODS[quick]
    inflow = Parabola(SHEDDING.fastest)
    field = Kicked(inflow, SHEDDING, CENTRE, CENTRE)
    rows, lines = [], []
    for n, world, first in refined(grids, lambda n: channel(n, inflow), field):
        before = BEFORE[quick] if first else AFTER
        seen, drags, drops = watch(world, SHEDDING, before, 0.3, periods, pressure_drop)
        steps, period = seen.last(periods)
        lifts, later = seen.signal[steps], drops[steps]
        half = crest(lifts[: round(period / seen.dt)])[1] + 0.5 * period / seen.dt
        fallen = float(np.interp(half, np.arange(later.size), later))
        rows.append((crest(drags[steps])[0], crest(lifts)[0], SHEDDING.time / period, fallen))
        lines.append(f"{n:>6g} cells across D: {seen.unsteadiness(periods)}")
    drag, lift, strouhal, drop = zip(*rows, strict=True)
    return [
        falling(judged("B2", "cD max", grids, drag, (3.22, 3.24), lines=lines)),
        falling(judged("B2", "cL max", grids, lift, (0.99, 1.01))),
        falling(judged("B2", "St", grids, strouhal, (0.295, 0.305))),
        judged("B2", "dp", grids, drop, (2.46, 2.50)),
    ]


def pulse(cells: int, duration: float = DURATION) -> Array:
    """(n, 4) time in s, drag and lift coefficient, pressure drop in Pa, from a fluid at rest."""
    world = channel(cells, pulsed_inflow)
    steps, dt = whole_steps(duration, CFL * DIAMETER / cells / SHEDDING.fastest)

    def figures(report: StepReport) -> tuple[float, ...]:
        return (world.time, *SHEDDING.coefficients(report), pressure_drop(world))

    return recorded(world, dt, steps, figures)


def swelling_inflow(quick: bool) -> list[Finding]:
    """B3: largest drag and lift in the pulse, and the pressure drop at its end."""
    grids = GRIDS[quick]
    runs = [pulse(n) for n in grids]
    drags, lifts = ([crest(run[:, column])[0] for run in runs] for column in (1, 2))
    drops = [float(run[-1, 3]) for run in runs]
    # s at which the published drag and lift are largest
    drag = course(runs[-1], 1, "drag coefficient", 3.93625, reference("B3", "cD max"))
    lift = course(runs[-1], 2, "lift coefficient", 5.693125, reference("B3", "cL max"))
    drop = course(runs[-1], 3, "pressure drop (Pa)", DURATION, reference("B3", "dp(t=8)"))
    return [
        judged("B3", "cD max", grids, drags, (2.93, 2.97), plot=drag),
        judged("B3", "cL max", grids, lifts, (0.47, 0.49), plot=lift),
        judged("B3", "dp(t=8)", grids, drops, (-0.115, -0.105), plot=drop),
    ]


def course(run: Array, column: int, name: str, time: float, published: float) -> Plot:
    """Some hundred points of a column of a run over time, with the one published value."""
    thinned = run[:: max(1, len(run) // 400)]
    curves = (
        Curve("published", (time,), (published,), True),
        Curve("flowborne", thinned[:, 0], thinned[:, column]),
    )
    return Plot("t (s)", name, curves)


CASES = (
    Case("B1", steady_cylinder, coarse=True),
    Case("B2", shedding_in_channel, Tier.HALF_HOUR, coarse=True),
    Case("B3", swelling_inflow, Tier.HALF_HOUR, coarse=True),
)
