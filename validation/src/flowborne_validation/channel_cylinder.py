"""Flow past a fixed cylinder in a channel: B1 steady, B2 with vortices, B3 a pulse of inflow."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

import numpy as np

from flowborne import Array, Grid, StepReport, World
from flowborne.worlds import (
    Boundaries,
    BoundaryInflow,
    BoundaryNoSlip,
    BoundaryOpen,
    Profile,
    advance,
    make_world,
)
from flowborne_validation.case import reference
from flowborne_validation.findings import Curve, Figure, Figures, Plot, named
from flowborne_validation.shedding import (
    AFTER,
    BEFORE,
    CFL,
    Kicked,
    Stream,
    backflow,
    crest,
    cylinder,
    watch,
)
from flowborne_validation.worlds import PLACES, Parabola, Place, over_places, recorded, whole_steps

DIAMETER, CENTRE, LENGTH, HEIGHT = 0.1, 0.2, 2.2, 0.41
"""m: of the cylinder, both coordinates of its centre; of the channel."""

VISCOSITY = 1e-3
"""Pa s; the fluid's density is 1 kg/m^3."""

ONCE = (40,)
"""Cells across D of B3 with one place, as it starts at rest in each and takes an hour. Multiples of
10 fit the channel."""

CREEPING = Stream(DIAMETER, 0.2, 0.3)
SHEDDING = Stream(DIAMETER, 1.0, 1.5)
"""B1; B2 and B3."""

DURATION = 8.0
"""s of B3, half a period of the inflow."""


def pulsed_inflow(x: Array, y: Array, z: Array, time: float) -> tuple[Array, Array, Array]:
    """Inflow of the channel that starts and ends at rest, as a profile."""
    return Parabola(SHEDDING.fastest * np.sin(np.pi * time / DURATION))(x, y, z)


def channel(cells: int, place: Place, inflow: Profile) -> World:
    """The channel at rest with the cylinder in it, `cells` across its diameter. Along the channel
    the cylinder's centre is at its place in a cell. Across it is on a plane of nodes; where the
    place is nearer to the next one, one cell more across the channel puts it 0.49 of a cell above a
    plane. The walls allow no others."""
    across = round(HEIGHT * cells / DIAMETER) + round(place[1])
    h = HEIGHT / across
    ahead = (place[0] - CENTRE / h) % 1.0
    grid = Grid.slab(round(LENGTH / h + ahead), across, h, (-ahead * h, 0.0))
    wall = BoundaryNoSlip()
    return make_world(
        cylinder(DIAMETER, CENTRE, CENTRE),
        grid,
        viscosity=VISCOSITY,
        boundaries=Boundaries(BoundaryInflow(inflow), BoundaryOpen(), wall, wall),
        tolerance=1e-7,
    )


def pressure_drop(world: World) -> float:
    """p at the front of the cylinder less p at its back, Pa. Extrapolated to them along its axis,
    from two cells whose centres are half a cell or more away."""
    fluid, state = world.flow()
    (x, y, _), h = fluid.grid.cell_coordinates(), fluid.grid.spacing
    j = int(np.searchsorted(y, CENTRE))
    row = state.pressure[:, j, 0] - (y[j] - CENTRE) / h * np.diff(state.pressure[:, :, 0])[:, j - 1]
    found = []
    for side in (-1, 1):
        end = CENTRE + 0.5 * side * DIAMETER
        away = side * (x - end) / h
        i = int(np.argmin(np.where(away > 0.5 - 1e-9, away, np.inf)))
        found.append(row[i] + away[i] * (row[i] - row[i + side]))
    return float(found[0] - found[1])


def steady_flow(world: World, change: float) -> tuple[float, float, float]:
    """Drag and lift coefficient of B1, when they change by less than `change` in a time D/U, or
    after 40 D/U; and their largest change in the last."""
    fluid, _ = world.flow()
    dt = CFL * fluid.grid.spacing / CREEPING.fastest
    new, changed, times = np.full(2, np.inf), np.inf, 0
    while changed >= change and times < 40:
        old, times = new, times + 1
        new = np.array(CREEPING.coefficients(advance(world, dt, round(CREEPING.time / dt))))
        changed = float(np.abs(new - old).max())
    return float(new[0]), float(new[1]), changed


def steady_cylinder(grids: Sequence[int]) -> Figures:
    """B1: from the undisturbed flow on the coarsest grid, from the coarser one's on the others."""
    inflow = Parabola(CREEPING.fastest)
    back = (CENTRE + 0.5 * DIAMETER, CENTRE, 0.0)

    def measure(world: World, first: bool) -> tuple[Sequence[float], str]:
        drag, lift, change = steady_flow(world, 2e-5)
        figures = drag, lift, pressure_drop(world), backflow(world, back, 3.0 * DIAMETER)
        return figures, f"coefficients change by {change:.1g} in the last D/U"

    found, lines = over_places(grids, partial(channel, inflow=inflow), inflow, measure)
    return named(("cD", "cL", "dp", "La"), found, grids, lines)


def shedding_in_channel(grids: Sequence[int], periods: int) -> Figures:
    """B2: largest coefficients over some periods, frequency, and the pressure drop half a period
    after the largest lift."""
    inflow = Parabola(SHEDDING.fastest)
    field = Kicked(inflow, SHEDDING, CENTRE, CENTRE)

    def measure(world: World, first: bool) -> tuple[Sequence[float], str]:
        before = BEFORE if first else AFTER
        seen, drags, drops = watch(world, SHEDDING, before, 0.3, periods, pressure_drop)
        steps, period = seen.last(periods)
        lifts, later = seen.signal[steps], drops[steps]
        half = crest(lifts[: round(period / seen.dt)])[1] + 0.5 * period / seen.dt
        fallen = float(np.interp(half, np.arange(later.size), later))
        figures = crest(drags[steps])[0], crest(lifts)[0], SHEDDING.time / period, fallen
        return figures, seen.unsteadiness(periods)

    found, lines = over_places(grids, partial(channel, inflow=inflow), field, measure)
    return named(("cD max", "cL max", "St", "dp"), found, grids, lines)


def pulse(cells: int, place: Place, duration: float = DURATION) -> Array:
    """(n, 4) time in s, drag and lift coefficient, pressure drop in Pa, from a fluid at rest."""
    world = channel(cells, place, pulsed_inflow)
    steps, dt = whole_steps(duration, CFL * DIAMETER / cells / SHEDDING.fastest)

    def figures(report: StepReport) -> tuple[float, ...]:
        return (world.time, *SHEDDING.coefficients(report), pressure_drop(world))

    return recorded(world, dt, steps, figures)


def swelling_inflow(grids: Sequence[int]) -> Figures:
    """B3: largest drag and lift in the pulse, and the pressure drop at its end."""
    runs = [[pulse(n, place) for place in PLACES[: 1 if n in ONCE else None]] for n in grids]
    drags, lifts = ([[crest(run[:, c])[0] for run in some] for some in runs] for c in (1, 2))
    drops = [[float(run[-1, 3]) for run in some] for some in runs]
    rows = (  # s at which the published ones are reached
        ("cD max", drags, "drag coefficient", 3.93625),
        ("cL max", lifts, "lift coefficient", 5.693125),
        ("dp(t=8)", drops, "pressure drop (Pa)", DURATION),
    )
    last, found = runs[-1][0], {}
    thinned = last[:: max(1, len(last) // 400)]
    for column, (quantity, values, name, time) in enumerate(rows, 1):
        curves = (
            Curve("published", (time,), (reference("B3", quantity),), True),
            Curve("flowborne", thinned[:, 0], thinned[:, column]),
        )
        found[quantity] = Figure(values, grids, plot=Plot("t (s)", name, curves))
    return found
