"""Bodies coupled to an ideal fluid: I4, I6, I7, I8, I9."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from flowborne import Array, Grid
from flowborne.bodies import WindForce
from flowborne.worlds import (
    Boundaries,
    BoundaryOpen,
    advance,
    kinetic_energy,
    make_world,
    set_velocity,
)
from flowborne_validation.articulated import first_angle, passages
from flowborne_validation.case import Case, Tier, reference, table
from flowborne_validation.findings import Finding, Grids, GridSeries, at_most, falling, near
from flowborne_validation.worlds import (
    PERIODIC,
    RING,
    Uniform,
    Vector,
    all_inflow,
    mjcf,
    square,
    start_at_once,
)

G = 9.81

FLAT_BODIES = (
    ((-0.5, -0.5, 0.0), '<geom type="sphere" size=".2"/>'),
    ((0.5, -0.47, 0.0), '<geom type="ellipsoid" size=".3 .15 1" euler="0 0 .4"/>'),
    ((-0.49, 0.5, 0.0), '<geom type="box" size=".25 .12 1" euler="0 0 -.7"/>'),
    ((0.5, 0.5, 0.0), '<geom type="capsule" size=".1 .2" zaxis="1 1 0"/>'),
)
SOLID_BODIES = (
    ((-0.5, -0.5, -0.5), '<geom type="sphere" size=".3"/>'),
    ((0.4, 0.4, 0.3), '<geom type="box" size=".3 .2 .25" euler=".3 .5 .7"/>'),
    ((0.4, -0.4, -0.3), '<geom type="ellipsoid" size=".3 .2 .25" euler=".3 .5 .7"/>'),
    ((-0.4, 0.45, 0.4), '<geom type="cylinder" size=".2 .25" euler=".3 .5 .7"/>'),
)
"""Position and shape of the free bodies of I4, in boxes of 2 m about the origin."""


def neutral(
    grid: Grid,
    bodies: Sequence[tuple[Vector, str]],
    dt: float,
    steps: int,
    stream: Vector | None = None,
) -> tuple[float, float]:
    """Largest displacement (m, quaternions) and change of velocity (m/s, rad/s) of bodies with the
    fluid's density, under gravity.

    stream  of fluid and bodies through a periodic box; None for a closed box at rest
    """
    elements = (
        f'<body pos="{at[0]} {at[1]} {at[2]}"><freejoint/>{geom}</body>' for at, geom in bodies
    )
    world = make_world(
        mjcf(*elements),
        grid,
        gravity=(0.0, -G, 0.0),
        solid_density=1.0,
        boundaries=Boundaries() if stream is None else RING,
    )
    state = world.solid
    start = state.q.copy()
    if stream is not None:
        set_velocity(world, Uniform(stream))
        state.v.reshape(-1, 6)[:, :3] = stream
    first = state.v.copy()
    advance(world, dt, steps)
    start.reshape(-1, 7)[:, :3] += steps * dt * first.reshape(-1, 6)[:, :3]
    moved = world.solid.q - start
    return float(np.abs(moved).max()), float(np.abs(world.solid.v - first).max())


def neutrally_buoyant(quick: bool) -> list[Finding]:
    """I4: bodies of many shapes stay at rest, or move with the stream."""
    steps = 100 if quick else 1000
    flat = square(32, 2.0)
    solid = Grid((16, 16, 16), 2.0 / 16, (-1.0, -1.0, -1.0))
    findings = []
    for label, grid, bodies in (("2D", flat, FLAT_BODIES), ("3D", solid, SOLID_BODIES)):
        if quick and grid is solid:
            continue
        moved, fast = neutral(grid, bodies, 0.02, steps)
        findings += [
            at_most(f"displacement over {steps} steps at rest, {label}, m", moved, 1e-8),
            at_most(f"velocity after {steps} steps at rest, {label}, m/s", fast, 1e-8),
        ]
    stream = (0.4, 0.23, 0.0)
    moved, slip = neutral(flat, FLAT_BODIES, 5e-4, steps, stream)
    findings.append(at_most("displacement from the stream's, m", moved, 1e-8))
    findings.append(at_most("slip in a uniform stream of 0.46 m/s, m/s", slip, 1e-8))
    return findings


LONGWISE = "cells along the long axis"

LONG, SHORT = 0.5, 0.25
"""Semi-axes of I6's ellipse, m."""


@dataclass(frozen=True)
class PotentialFlow:
    """Flow of 1 m/s round the ellipse without circulation, as a profile.

    incidence  angle of the stream above the long axis, which is x, rad
    """

    incidence: float

    def __call__(
        self, x: Array, y: Array, z: Array, time: float = 0.0
    ) -> tuple[Array, Array, Array]:
        point = x + 1j * y + 0.0 * z
        focus, radius = np.sqrt(LONG**2 - SHORT**2), 0.5 * (LONG + SHORT)
        circle = 0.5 * (point + np.sqrt(point - focus) * np.sqrt(point + focus))
        onward, back = np.exp(-1j * self.incidence), np.exp(1j * self.incidence)
        velocity = onward - back * (radius / circle) ** 2
        velocity /= 1.0 - (0.5 * focus / circle) ** 2
        return velocity.real, -velocity.imag, 0.0 * velocity.real


def held_ellipse(
    cells: int, incidence: float, place: tuple[float, float] = (0.0, 0.0)
) -> tuple[float, float]:
    """Moment (nose-up) over pi (a^2 - b^2)/2 and force over its chord, both over rho U^2.

    The first projection makes the potential flow; the pressure is Bernoulli's a few steps later.

    cells  across the long axis, in a box of 3 m whose sides have the unbounded flow's velocity
    place  of the ellipse in its cell, cells
    """
    h = 1.0 / cells
    grid = Grid.slab(3 * cells, 3 * cells, h, tuple(-1.5 - h * np.array(place)))
    model = mjcf(f'<geom type="ellipsoid" size="{LONG} {SHORT} 1"/>')
    world = make_world(model, grid, boundaries=all_inflow(PotentialFlow(incidence)))
    dt = 0.25 * grid.spacing
    start_at_once(world, dt)
    wrench = advance(world, dt, 4).pressure_wrench[0]
    moment = -wrench[5] / (0.5 * np.pi * (LONG**2 - SHORT**2))
    return float(moment), float(np.hypot(wrench[0], wrench[1]) / (2.0 * LONG))


def munk_moment(quick: bool) -> list[Finding]:
    """I6: moment and force on the ellipse at three incidences."""
    grids = Grids(LONGWISE, (32, 64, 128) if quick else (16, 32, 64, 128, 256))
    findings = []
    for degrees in (45.0,) if quick else (10.0, 30.0, 45.0):
        exact = float(np.sin(2.0 * np.radians(degrees)))
        runs = [held_ellipse(n, np.radians(degrees)) for n in grids.cells]
        moments, forces = zip(*runs, strict=True)
        series = GridSeries.toward(grids, moments, exact, relative=True)
        title = f"M over rho U^2 pi (a^2-b^2)/2 at {degrees:g} degrees"
        findings.append(falling(near(title, series, exact, relative=0.01)))
        title = f"force over rho U^2 2a at {degrees:g} degrees"
        findings.append(at_most(title, forces, 0.02, grids))
    return findings


RADIUS, ROD = 0.1, 0.5
"""Bob and rod of I7, m."""


@dataclass(frozen=True)
class PendulumBox:
    """The closed square in which I7's bob swings.

    side   m
    above  height of the pivot over the square's middle, m
    grids  cells across it for the wider swings
    """

    side: float
    above: float
    grids: tuple[int, ...]

    @property
    def added(self) -> float:
        """Ca of the bob in the middle, by I2's table."""
        return float(table("I2", "cylinder in closed square, Ca vs D/L")[2.0 * RADIUS / self.side])


NARROW, WIDE = PendulumBox(2.0, ROD, (64, 128, 256, 384)), PendulumBox(4.0, 0.0, (128, 256, 512))
"""With the bob at rest in the middle; for swings by more than 90 degrees, which leave it."""


def small_period(ratio: float, added: float) -> float:
    """I7's formula: s, for a density over the fluid's and a Ca."""
    inertia = (ratio + added) * ROD**2 + 0.5 * ratio * RADIUS**2
    return float(2.0 * np.pi * np.sqrt(inertia / (abs(ratio - 1.0) * G * ROD)))


def swing(box: PendulumBox, cells: int, ratio: float, degrees: float, period: float) -> float:
    """Period in s of the bob, released at an angle from its rest position.

    cells   across the box
    ratio   density over the fluid's: the rod stands on its pivot below 1, and hangs above
    period  expected, s; the step is a hundredth of it, and shorter for a fast bob
    """
    grid = square(cells, box.side)
    up = 1.0 if ratio > 1.0 else -1.0
    bob = f'<geom type="sphere" size="{RADIUS}" pos="0 {-up * ROD} 0" density="{ratio}"/>'
    body = f'<body pos="0 {up * box.above} 0"><joint name="pivot" axis="0 0 1"/>{bob}</body>'
    world = make_world(mjcf(body), grid, gravity=(0.0, -G, 0.0))
    world.solid.q[0] = np.radians(degrees)
    fastest = 2.0 * np.pi / period * ROD * np.radians(degrees)
    dt = min(0.01 * period, 0.5 * grid.spacing / fastest)
    times = passages(first_angle(world, dt, int(1.35 * period / dt)), dt)
    if times.size < 3:
        raise ArithmeticError(f"the pendulum let go at {degrees:g} degrees has no full swing")
    return float(times[2] - times[0])


def pendulum(quick: bool) -> list[Finding]:
    """I7: period of a heavy bob and of light ones, which stand up, and of wider swings."""
    grids = (32, 64) if quick else (64, 128, 256)
    findings = []
    for ratio in (2.0, 0.5) if quick else (2.0, 0.5, 0.01):
        exact = small_period(ratio, NARROW.added)
        found = [swing(NARROW, n, ratio, 5.0, exact) for n in grids]
        series = GridSeries.toward(Grids("cells a side", grids), found, exact, relative=True)
        title = f"period at rho_s/rho_f = {ratio:g} let go at 5 degrees, s"
        findings.append(near(title, series, exact, relative=0.02))
    if quick:
        return findings
    for degrees, factor in table("I7", "amplitude factor").items():
        if not 5.0 < degrees <= 150.0:
            continue
        box = NARROW if degrees <= 90.0 else WIDE
        exact = small_period(2.0, box.added)
        values = [swing(box, n, 2.0, degrees, factor * exact) / exact for n in box.grids]
        title = f"T/T0 at rho_s/rho_f = 2 let go at {degrees:g} degrees"
        on = Grids("cells a side", box.grids)
        findings.append(near(title, values, factor, on, relative=0.02))
    return findings


LENGTH = 4.0
"""Of the channel of I8, whose width is 1 m, m."""


def slug(cells: int, plug: float, mass: float, sides: Boundaries, steps: int, solid: bool) -> float:
    """Mean acceleration of a plug that fills the channel, under 1 N, times all mass in it.

    cells  across the channel
    plug   its length, m
    mass   its mass, kg
    """
    h, long = 1.0 / cells, round(LENGTH) * cells
    if solid:
        grid = Grid((long, cells, cells), h, (-0.5 * LENGTH, -0.5, -0.5))
    else:
        grid = Grid.slab(long, cells, h, (-0.5 * LENGTH, -0.5))
    geom = f'<geom type="box" size="{0.5 * plug} 1 1" mass="{mass}"/>'
    body = f'<body name="plug" pos=".0123 0 0"><joint type="slide" axis="1 0 0"/>{geom}</body>'
    force = WindForce((1.0, 0.0, 0.0))
    world = make_world(mjcf(body), grid, boundaries=sides, tolerance=1e-12, winds=(force,))
    dt = 0.01
    advance(world, dt, steps)
    return float(world.solid.v[0]) / (steps * dt) * (mass + LENGTH - plug)


def piston(quick: bool) -> list[Finding]:
    """I8: a plug between open ends and in a ring, in the first step and over many."""
    grids = (8, 16) if quick else (8, 16, 32, 64)
    steps = 10 if quick else 100
    ends = BoundaryOpen()
    findings = []
    for label, sides in (
        ("open channel", Boundaries(ends, ends)),
        ("ring", Boundaries(PERIODIC, PERIODIC)),
    ):
        wrong = 0.0
        for mass in (0.01, 1.0, 100.0):
            for count in (1, steps):
                for n in grids:
                    wrong = max(wrong, abs(slug(n, 0.5, mass, sides, count, False) - 1.0))
                wrong = max(wrong, abs(slug(8, 0.5, mass, sides, min(count, 10), True) - 1.0))
        between = [slug(n, 0.53, 1.0, sides, 1, False) for n in grids]
        series = GridSeries.toward(Grids("cells across", grids), between, 1.0)
        lines = ["a plug 0.53 m long, no whole number of cells, displaces whole faces:"]
        lines += series.lines()
        title = f"largest error of (m + M_f) a / F, {label}, plug of whole cells"
        findings.append(at_most(title, wrong, 1e-6, lines=lines))
    return findings


TURNING = (0.5, 0.35)
"""Semi-axes of I9's ellipse, which has the fluid's density, m."""

SPIN, DRIFT = 1.0, (0.1, 0.06)
"""rad/s and m/s of the ellipse before the start, which gives part of its momentum to the fluid."""


def turning(cells: int) -> Array:
    """Kinetic energy after every step of half a turn, over that at its start.

    cells  along the long axis; a tip moves half a cell a step
    """
    grid = square(3 * cells, 3.0)
    geom = f'<geom type="ellipsoid" size="{TURNING[0]} {TURNING[1]} 1"/>'
    world = make_world(mjcf(f"<body><freejoint/>{geom}</body>"), grid, solid_density=1.0)
    world.solid.q[:2] = -0.0123, 0.0177
    world.solid.v[[0, 1, 5]] = *DRIFT, SPIN
    start_at_once(world, 1e-9)
    dt = 0.5 * grid.spacing / (SPIN * TURNING[0])
    energies, turned = [kinetic_energy(world)], 0.0
    while turned < np.pi:
        advance(world, dt)
        turned += dt * abs(world.solid.v[5])
        energies.append(kinetic_energy(world))
    return np.array(energies) / energies[0]


def free_turn(quick: bool) -> list[Finding]:
    """I9: a body that turns freely in a closed box, and the fluid around it, keep their energy."""
    name = "energy lost in half a turn, cells across the long axis: part"
    allowed = {int(cells): part for cells, part in reference("I9", name).items()}
    grids = tuple(allowed)[:2] if quick else tuple(allowed)
    runs = [turning(n) for n in grids]
    lost = [float(1.0 - run[-1]) for run in runs]
    series = GridSeries(LONGWISE, grids, lost, lost)
    findings = []
    for n, part in zip(grids, lost, strict=True):
        title = f"part of the energy lost in half a turn, {n} cells"
        lines = [] if part >= 0.0 else ["the energy is larger than at the start"]
        findings.append(at_most(title, part, allowed[n], lines=lines, series=series))
    most = float(max(run.max() for run in runs))
    return [*findings, at_most("largest energy over that at the start", most, 1.0)]


CASES = (
    Case("I4", neutrally_buoyant),
    Case("I6", munk_moment),
    Case("I7", pendulum),
    Case("I8", piston),
    Case("I9", free_turn, full=Tier.HALF_HOUR),
)
