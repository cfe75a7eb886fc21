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
from flowborne_validation.case import reference, table
from flowborne_validation.findings import Figure, Figures, GridSeries
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


def neutrally_buoyant(steps: int, dimensions: Sequence[int]) -> Figures:
    """I4: bodies of many shapes stay at rest, or move with the stream."""
    flat, solid = square(32, 2.0), Grid((16, 16, 16), 2.0 / 16, (-1.0, -1.0, -1.0))
    found = {}
    for count in dimensions:
        grid, bodies = (flat, FLAT_BODIES) if count == 2 else (solid, SOLID_BODIES)
        moved, fast = neutral(grid, bodies, 0.02, steps)
        found[f"displacement over {steps} steps at rest, {count}D, m"] = moved
        found[f"velocity after {steps} steps at rest, {count}D, m/s"] = fast
    moved, slip = neutral(flat, FLAT_BODIES, 5e-4, steps, (0.4, 0.23, 0.0))
    return found | {
        "displacement from the stream's, m": moved,
        "slip in a uniform stream of 0.46 m/s, m/s": slip,
    }


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


def munk_moment(cells: int, incidences: Sequence[float]) -> Figures:
    """I6: moment and force on the ellipse at some incidences, degrees."""
    found: dict[str, float | Figure] = {}
    for degrees in incidences:
        moment, force = held_ellipse(cells, np.radians(degrees))
        title = f"M over rho U^2 pi (a^2-b^2)/2 at {degrees:g} degrees"
        found[title] = Figure(moment, reference=float(np.sin(2.0 * np.radians(degrees))))
        found[f"force over rho U^2 2a at {degrees:g} degrees"] = force
    return found


RADIUS, ROD = 0.1, 0.5
"""Bob and rod of I7, m."""


def small_period(ratio: float, side: float) -> float:
    """I7's formula: s, for a density over the fluid's and a square of a side (m), in whose middle
    the bob has the Ca of I2's table."""
    added = float(table("I2", "cylinder in closed square, Ca vs D/L")[2.0 * RADIUS / side])
    inertia = (ratio + added) * ROD**2 + 0.5 * ratio * RADIUS**2
    return float(2.0 * np.pi * np.sqrt(inertia / (abs(ratio - 1.0) * G * ROD)))


def swing(
    side: float, above: float, cells: int, ratio: float, degrees: float, period: float
) -> float:
    """Period in s of the bob, released at an angle from its rest position.

    side    of the closed square in which it swings, m
    above   height of the pivot over the square's middle, m
    cells   across the square
    ratio   density over the fluid's: the rod stands on its pivot below 1, and hangs above
    period  expected, s; the step is a hundredth of it, and shorter for a fast bob
    """
    grid = square(cells, side)
    up = 1.0 if ratio > 1.0 else -1.0
    bob = f'<geom type="sphere" size="{RADIUS}" pos="0 {-up * ROD} 0" density="{ratio}"/>'
    body = f'<body pos="0 {up * above} 0"><joint name="pivot" axis="0 0 1"/>{bob}</body>'
    world = make_world(mjcf(body), grid, gravity=(0.0, -G, 0.0))
    world.solid.q[0] = np.radians(degrees)
    fastest = 2.0 * np.pi / period * ROD * np.radians(degrees)
    dt = min(0.01 * period, 0.5 * grid.spacing / fastest)
    times = passages(first_angle(world, dt, int(1.35 * period / dt)), dt)
    if times.size < 3:
        raise ArithmeticError(f"the pendulum let go at {degrees:g} degrees has no full swing")
    return float(times[2] - times[0])


def pendulum(cells: int, ratios: Sequence[float]) -> Figures:
    """I7: period of a heavy bob and of light ones, which stand up, by their density over the
    fluid's; at rest it is in the middle of a square of 2 m."""
    found = {}
    for ratio in ratios:
        exact = small_period(ratio, 2.0)
        title = f"period at rho_s/rho_f = {ratio:g} let go at 5 degrees, s"
        found[title] = Figure(swing(2.0, ROD, cells, ratio, 5.0, exact), reference=exact)
    return found


def wide_swings(cells: int, side: float, above: float, angles: Sequence[float]) -> Figures:
    """I7: period of wider swings. By more than 90 degrees the bob leaves the middle of a square."""
    exact, factors = small_period(2.0, side), table("I7", "amplitude factor")
    return {
        f"T/T0 at rho_s/rho_f = 2 let go at {degrees:g} degrees": Figure(
            swing(side, above, cells, 2.0, degrees, factors[degrees] * exact) / exact,
            reference=factors[degrees],
        )
        for degrees in angles
    }


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


def piston(grids: Sequence[int], steps: int) -> Figures:
    """I8: a plug between open ends and in a ring, in the first step and over many."""
    ends = BoundaryOpen()
    found = {}
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
        lines = ["a plug 0.53 m long, no whole number of cells, displaces whole faces:"]
        lines += GridSeries.toward("cells across", grids, between, 1.0).lines()
        title = f"largest error of (m + M_f) a / F, {label}, plug of whole cells"
        found[title] = Figure(wrong, lines=lines)
    return found


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


def free_turn(grids: Sequence[int]) -> Figures:
    """I9: a body that turns freely in a closed box, and the fluid around it, keep their energy."""
    name = "energy lost in half a turn, cells across the long axis: part"
    allowed = {int(cells): part for cells, part in reference("I9", name).items()}
    runs = [turning(n) for n in grids]
    lost = [float(1.0 - run[-1]) for run in runs]
    found: dict[str, float | Figure] = {}
    for n, part in zip(grids, lost, strict=True):
        lines = [] if part >= 0.0 else ["the energy is larger than at the start"]
        found[f"part of the energy lost in half a turn, {n} cells"] = Figure(
            lost, grids, value=part, lines=lines, judged={"absolute": allowed[n]}
        )
    return found | {"largest energy over that at the start": max(run.max() for run in runs)}
