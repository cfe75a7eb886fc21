"""Flow past a fixed cylinder: B1, B2, B5."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from flowborne import Array, Grid, StepReport, World
from flowborne.boundaries import Boundaries, BoundaryInflow, BoundaryNoSlip, BoundaryOpen, Profile
from flowborne.validation.case import Case, Finding, GridSeries, Plot, Tier
from flowborne.validation.fluid_cases import Uniform
from flowborne.validation.reference import confirmed, reference
from flowborne.validation.shedding import Shedding, amplitude, crest
from flowborne.validation.worlds import mjcf
from flowborne.worlds import Field, advance, make_world, set_velocity, start_from

DIAMETER, CENTRE = 0.1, 0.2
"""m: of the channel's cylinder, and both coordinates of its centre."""

LENGTH, HEIGHT = 2.2, 0.41
"""m, of the channel."""

VISCOSITY = 1e-3
"""Pa s, in the channel; the fluid's density is 1 kg/m^3 everywhere."""

STEADY_GRIDS = {True: (10,), False: (20, 40, 80)}
SHEDDING_GRIDS = {True: (10,), False: (10, 20, 40)}
"""Cells across D of B1 and B2, by quick; multiples of 10 fit the channel."""

OPEN_GRIDS = {True: (4,), False: (8, 16, 24, 32)}
"""Cells across D of B5, by quick."""

STEADY = {True: 1e-2, False: 2e-5}
"""Change of a coefficient in a time D/U at which B1's flow is steady, by quick."""

LONGEST = 40
"""Most times D/U that B1 is given on one grid."""

BEFORE = {True: 20.0, False: 40.0}
AFTER = 15.0
"""Times D/U that a flow that sheds vortices is given before it is looked at: on the first grid, by
quick, where it has to begin, and on a grid that starts from the flow of a coarser one."""

PERIODS = {True: 2, False: 4}
"""Periods that are looked at, by quick."""

CFL = 1.0
"""Cells that the oncoming flow crosses in a step."""


@dataclass(frozen=True)
class Parabola:
    """Inflow of the channel with the largest velocity `peak` (m/s), as a profile and as a field."""

    peak: float

    def __call__(
        self, x: Array, y: Array, z: Array, time: float = 0.0
    ) -> tuple[Array, Array, Array]:
        none = 0.0 * (x + y + z)
        return 4.0 * self.peak * y * (HEIGHT - y) / HEIGHT**2 + none, none, none


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


def open_water(cells: int, viscosity: float) -> World:
    """B5's domain with the stream that enters it, the cylinder at the origin."""
    grid = Grid.slab(50 * cells, 60 * cells, 1.0 / cells, (-20.0, -30.0))
    return make_world(
        cylinder(1.0, 0.0, 0.0),
        grid,
        viscosity=viscosity,
        boundaries=Boundaries(BoundaryInflow(STREAM), BoundaryOpen()),
        tolerance=1e-7,
    )


def cylinder(diameter: float, x: float, y: float) -> str:
    """MJCF of a fixed cylinder, body 1."""
    return mjcf(
        f'<body name="cylinder" pos="{x} {y} 0">'
        f'<geom type="cylinder" size="{0.5 * diameter} 1"/></body>'
    )


@dataclass(frozen=True)
class Stream:
    """A flow past a cylinder, and what makes its figures dimensionless.

    diameter  m
    speed     U of the coefficients, m/s
    fastest   largest oncoming velocity, m/s
    """

    diameter: float
    speed: float
    fastest: float

    def coefficients(self, report: StepReport) -> tuple[float, float]:
        """Drag and lift coefficient, 2 F / (rho U^2 D)."""
        force = (report.pressure_wrench + report.viscous_wrench)[1]
        drag, lift = 2.0 * force[:2] / (self.speed**2 * self.diameter)
        return float(drag), float(lift)

    @property
    def time(self) -> float:
        """D / U, s."""
        return self.diameter / self.speed


CREEPING = Stream(DIAMETER, 0.2, 0.3)
SHEDDING = Stream(DIAMETER, 1.0, 1.5)
"""B1 and B2."""

UNBOUNDED, STREAM = Stream(1.0, 1.0, 1.0), Uniform((1.0, 0.0, 0.0))
"""B5, and what comes from upstream there."""


@dataclass(frozen=True)
class Kicked:
    """A field with a gust across the wake of the cylinder at (x, y), so that shedding begins."""

    field: Field
    stream: Stream
    x: float
    y: float

    def __call__(self, x: Array, y: Array, z: Array) -> tuple[Array, Array, Array]:
        u, v, w = self.field(x, y, z)
        size = self.stream.diameter
        away = ((x - self.x) / size - 1.5) ** 2 + ((y - self.y) / size) ** 2
        return u, v + 0.5 * self.stream.speed * np.exp(-away), w


def pressure_drop(world: World) -> float:
    """p between the foremost and the hindmost point of the channel's cylinder, Pa; extrapolated
    to them along the centre line, which runs between two rows of cells."""
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
    """Length of the backflow behind the channel's cylinder, m."""
    fluid, state = world.flow()
    h = fluid.grid.spacing
    j = round(CENTRE / h)
    row = 0.5 * (state.velocity[0][:, j - 1, 0] + state.velocity[0][:, j, 0])
    start = round((CENTRE + 0.5 * DIAMETER) / h) + 1
    i = start + int(np.argmax(row[start:] > 0.0))
    return float(h * (i - row[i] / (row[i] - row[i - 1])) - CENTRE - 0.5 * DIAMETER)


def steady_flow(world: World, change: float) -> tuple[float, float]:
    """March B1 until its coefficients change by less than `change` in a time D/U; gives them."""
    fluid, _ = world.flow()
    dt = CFL * fluid.grid.spacing / (CREEPING.fastest)
    old = np.full(2, np.inf)
    for _ in range(LONGEST):
        new = np.array(CREEPING.coefficients(advance(world, dt, round(CREEPING.time / dt))))
        if np.abs(new - old).max() < change:
            break
        old = new
    return float(new[0]), float(new[1])


def steady_cylinder(quick: bool) -> list[Finding]:
    """B1: from the undisturbed flow on the coarsest grid, from the coarser one's on the others."""
    grids = STEADY_GRIDS[quick]
    rows = []
    coarser = None
    for n in grids:
        world = channel(n, Parabola(CREEPING.fastest))
        begin(world, coarser, Parabola(CREEPING.fastest))
        forces = steady_flow(world, STEADY[quick])
        rows.append((*forces, pressure_drop(world), recirculation(world)))
        coarser = world
    drag, lift, drop, length = (
        series_of("B1", quantity, grids, values)
        for quantity, values in zip(("cD", "cL", "dp", "La"), zip(*rows, strict=True), strict=True)
    )
    return [
        within("B1", "cD", drag, (5.57, 5.59), falling=True),
        within("B1", "cL", lift, (0.0104, 0.0110), falling=True),
        within("B1", "dp", drop, (0.1172, 0.1176)),
        within("B1", "La", length, (0.0842, 0.0852)),
    ]


def begin(world: World, coarser: World | None, field: Field) -> None:
    """Start from the flow on a coarser grid, or from one that knows nothing of the cylinder."""
    if coarser is None:
        set_velocity(world, field)
    else:
        start_from(coarser, world)


def series_of(
    case: str, quantity: str, grids: Sequence[int], values: Sequence[float]
) -> GridSeries:
    """Values from grid to grid with their errors."""
    exact = reference(case, quantity)
    return GridSeries("cells across D", grids, values, [abs(v - exact) for v in values])


def within(
    case: str,
    quantity: str,
    series: GridSeries,
    interval: tuple[float, float],
    lines: Sequence[str] = (),
    plot: Plot | None = None,
    falling: bool = False,
) -> Finding:
    """Inside the list's interval; if `falling`, with an error that falls from grid to grid."""
    value, (low, high) = series.values[-1], interval
    return Finding(
        quantity,
        value,
        reference(case, quantity),
        f"[{low:g}, {high:g}]" + (", falling from grid to grid" if falling else ""),
        low <= value <= high and (series.falls or not falling),
        series,
        tuple(lines),
        plot,
        confirmed(case, quantity),
    )


def watch(world: World, stream: Stream, before: float, strouhal: float, periods: int) -> Shedding:
    """March and keep the coefficients of every step.

    before    times D/U until the flow repeats itself
    strouhal  about what frequency is expected
    """
    fluid, _ = world.flow()
    dt = CFL * fluid.grid.spacing / stream.fastest
    duration = (before + (periods + 1.5) / strouhal) * stream.time
    rows = []
    for _ in range(round(duration / dt)):
        drag, lift = stream.coefficients(advance(world, dt))
        rows.append((drag, lift, pressure_drop(world) if stream is SHEDDING else 0.0))
    drag, lift, drop = np.array(rows).T
    return Shedding(dt, drag, lift, drop)


def shedding_in_channel(quick: bool) -> list[Finding]:
    """B2: largest coefficients over some periods, frequency, and dp half a period after the
    largest lift."""
    grids, periods = SHEDDING_GRIDS[quick], PERIODS[quick]
    rows, lines = [], []
    coarser = None
    for n in grids:
        world = channel(n, Parabola(SHEDDING.fastest))
        begin(world, coarser, Kicked(Parabola(SHEDDING.fastest), SHEDDING, CENTRE, CENTRE))
        seen = watch(world, SHEDDING, AFTER if coarser else BEFORE[quick], 0.3, periods)
        steps, period = seen.last(periods)
        largest = crest(seen.drag[steps])[0], crest(seen.lift[steps])[0]
        half = crest(seen.lift[steps][: round(period / seen.dt)])[1] + 0.5 * period / seen.dt
        later = seen.drop[steps]
        fallen = float(np.interp(half, np.arange(later.size), later))
        rows.append((*largest, SHEDDING.time / period, fallen))
        lines.append(f"{n:>6g} cells across D: {seen.unsteadiness(periods)}")
        coarser = world
    drag, lift, strouhal, drop = (
        series_of("B2", quantity, grids, values)
        for quantity, values in zip(
            ("cD max", "cL max", "St", "dp"), zip(*rows, strict=True), strict=True
        )
    )
    return [
        within("B2", "cD max", drag, (3.22, 3.24), lines, falling=True),
        within("B2", "cL max", lift, (0.99, 1.01), falling=True),
        within("B2", "St", strouhal, (0.295, 0.305), falling=True),
        within("B2", "dp", drop, (2.46, 2.50)),
    ]


def shed_in_the_open(
    reynolds: float, strouhal: float, grids: Sequence[int], quick: bool
) -> tuple[list[list[float]], list[str]]:
    """Mean drag, amplitude of the lift and frequency from grid to grid, and lines for people.

    The domain reaches 20 D upstream and 30 D downstream and to each side, which slips; half as
    wide it would raise the drag at Re 100 by 0.8 %.

    strouhal  about what frequency is expected
    """
    periods = PERIODS[quick]
    rows, lines = [], []
    coarser = None
    for n in grids:
        world = open_water(n, 1.0 / reynolds)
        begin(world, coarser, Kicked(STREAM, UNBOUNDED, 0.0, 0.0))
        before = AFTER if coarser else 2.0 * BEFORE[quick]
        seen = watch(world, UNBOUNDED, before, strouhal, periods)
        steps, period = seen.last(periods)
        mean = float(seen.drag[steps].mean())
        rows.append((mean, amplitude(seen.lift[steps]), UNBOUNDED.time / period))
        lines.append(f"{n:>6g} cells across D: {seen.unsteadiness(periods)}")
        coarser = world
    return [list(column) for column in zip(*rows, strict=True)], lines


def shedding_in_the_open(quick: bool) -> list[Finding]:
    """B5: mean drag, amplitude of the lift and frequency at Re 100."""
    grids = OPEN_GRIDS[quick]
    columns, lines = shed_in_the_open(100.0, 0.165, grids, quick)
    drag, lift, strouhal = (
        series_of("B5", quantity, grids, values)
        for quantity, values in zip(("Cd mean", "Cl amplitude", "St"), columns, strict=True)
    )
    return [
        within("B5", "Cd mean", drag, (1.31, 1.39), lines, falling=True),
        within("B5", "Cl amplitude", lift, (0.30, 0.345), falling=True),
        within("B5", "St", strouhal, (0.160, 0.170), falling=True),
    ]


CASES = (
    Case("B1", steady_cylinder, coarse=True),
    Case("B2", shedding_in_channel, Tier.HALF_HOUR, coarse=True),
    Case("B5", shedding_in_the_open, Tier.HALF_HOUR, coarse=True),
)
