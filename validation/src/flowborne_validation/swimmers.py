"""Creatures that swim in still fluid: an eel in viscous fluid (S1), chains in ideal fluid (S5)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flowborne import Array, Grid, World
from flowborne.bodies import Trajectory, TrajectorySinusoid, halfway_momentum, kinematics
from flowborne.worlds import Boundaries, advance, make_world
from flowborne_validation.case import reference
from flowborne_validation.findings import Curve, Figure, Figures, Plot
from flowborne_validation.worlds import RING, at_start, chain, history, square, whole_steps

VISCOSITY = 1.4e-4
"""Pa s, of S1; the eel is 1 m long, its period is 1 s, fluid and eel have 1 kg/m^3."""

LINKS, TANK_LENGTH, TANK_WIDTH = 20, 8, 2
"""Rigid links of the eel, whose hinges follow its midline; m of S1's closed box along its path and
across."""

SPEED = "mean forward speed 2D"

SWAY, OFFSET = 0.125 / 1.03125, 0.03125
"""Of the midline's lateral displacement SWAY (s + OFFSET) sin 2 pi (s - t), m."""

BOX, LINK, WIDTH, PERIOD = 3.0, 0.4, 0.1, 1.0
"""S5: side of the box, length and width of a link, m; s of its gaits."""


def half_width(s: float) -> float:
    """Of the eel, s from its nose, m."""
    head, tail, end = 0.04, 0.01, 0.95
    if s < head:
        return float(np.sqrt(2.0 * head * s - s * s))
    if s < end:
        return head - (head - tail) * (s - head) / (end - head)
    return tail * (1.0 - s) / (1.0 - end)


@dataclass(frozen=True)
class Bend:
    """A hinge's angle: the change of the midline's direction between two points.

    dofs       (1,) of the hinge
    near, far  distance of the points from the nose, m
    """

    dofs: NDArray[np.int64]
    near: float
    far: float

    def position(self, time: float) -> Array:
        """(1,) rad."""
        return np.array([direction(self.far, time)[0] - direction(self.near, time)[0]])

    def velocity(self, time: float) -> Array:
        """(1,) rad/s."""
        return np.array([direction(self.far, time)[1] - direction(self.near, time)[1]])


def direction(s: float, time: float) -> tuple[float, float]:
    """Angle of the midline at s, rad, and its rate, rad/s, growing from 0 in the first second."""
    grown, growing = 1.0, 0.0
    if time < 1.0:
        grown, growing = np.sin(0.5 * np.pi * time) ** 2, 0.5 * np.pi * np.sin(np.pi * time)
    turn = 2.0 * np.pi
    angle, reach = turn * (s - time), s + OFFSET
    slope = SWAY * (np.sin(angle) + turn * reach * np.cos(angle))
    rate = SWAY * turn * (turn * reach * np.sin(angle) - np.cos(angle))
    bent = grown * slope
    return float(np.arctan(bent)), float((growing * slope + grown * rate) / (1.0 + bent**2))


def eel() -> str:
    """A free chain of capsules with its nose at the origin and its tail at x = 1 m. Neighbours
    overlap; each link has the mass of its part of the outline."""
    size, links = 1.0 / LINKS, []
    for k in range(LINKS):
        width = half_width((k + 0.5) * size)
        start = width if k == 0 else 0.0
        stop = size - width if k == LINKS - 1 else size
        half = 0.5 * (stop - start)
        density = 2.0 * width * size / (4.0 * width * half + np.pi * width**2)
        joint = f'<joint name="j{k}" axis="0 0 1"/>' if k else '<freejoint name="root"/>'
        links.append(
            f'{joint}<geom type="capsule" size="{width} {half}" pos="{start + half} 0 0" '
            f'zaxis="1 0 0" density="{density}"/>'
        )
    return chain(links, size)


def tank(cells: int) -> World:
    """The straight eel at rest near one end of the box, its nose towards the other, -x."""
    size = 1.0 / LINKS
    bends: tuple[Trajectory, ...] = tuple(
        Bend(np.array([5 + k]), (k - 0.5) * size, (k + 0.5) * size) for k in range(1, LINKS)
    )
    lower = (2.0 - TANK_LENGTH, -0.5 * TANK_WIDTH)
    return make_world(
        eel(),
        Grid.slab(TANK_LENGTH * cells, TANK_WIDTH * cells, 1.0 / cells, lower),
        viscosity=VISCOSITY,
        motions=bends,
        tolerance=1e-7,
    )


def swim(cells: int, periods: int) -> Array:
    """(n+1, 2) times in s and positions of the mass centre along -x in m."""
    world = tank(cells)
    # in a step the tail, at 2 pi / 8 m/s, moves to the side by at most half a cell
    count, dt = whole_steps(1.0, 0.5 / cells / (0.25 * np.pi))
    return history(world, dt, count * periods, lambda: (world.time, -mass_centre(world)[0]))


def swimming(grids: Sequence[int], periods: int) -> Figures:
    """S1: mean speed of the eel in its last period."""
    paths = [swim(n, periods) for n in grids]
    speeds = [path[-1, 1] - path[-1 - (len(path) - 1) // periods, 1] for path in paths]
    exact = float(reference("S1", SPEED).removesuffix(" L/T"))
    period = (len(paths[-1]) - 1) // periods
    mean = paths[-1][period:, 1] - paths[-1][:-period, 1]
    times = paths[-1][period:, 0] - 0.5
    curves = (
        Curve("published", (times[0], times[-1]), (exact, exact), True),
        Curve("flowborne, mean of a period", times[::8], mean[::8]),
    )
    plot = Plot("t/T", "forward speed (L/T)", curves)
    return {"mean forward speed, L/T": Figure(speeds, grids, exact, plot=plot)}


def capsules(links: int) -> str:
    """S5's free chain of capsules along x about the origin."""
    return chain(
        [
            (f'<joint name="j{k}" axis="0 0 1"/>' if k else '<freejoint name="root"/>')
            + f'<geom type="capsule" size="{0.5 * WIDTH} {0.5 * LINK - 0.02}" '
            f'pos="{0.5 * LINK} 0 0" zaxis="1 0 0"/>'
            for k in range(links)
        ],
        LINK,
        -0.5 * links * LINK,
    )


def swimmer(cells: int, gait: tuple[TrajectorySinusoid, ...], sides: Boundaries | None) -> World:
    """A neutrally buoyant chain at rest in still fluid, in the first pose of its gait.

    cells  across the box
    gait   motion of each joint
    """
    world = make_world(
        capsules(len(gait) + 1),
        square(cells, BOX),
        boundaries=sides or Boundaries(),
        solid_density=1.0,
        motions=gait,
        tolerance=1e-11,
    )
    world.solid.q[7:], _ = at_start(gait)
    return world


def mass_centre(world: World) -> Array:
    """(2,) m, of all bodies."""
    model = world.setup.solid
    centres = kinematics(model, world.solid.q).mass_centre
    return np.asarray((model.body_mass @ centres)[:2] / model.body_mass.sum())


def momentum_kept(cells: int, steps: int) -> tuple[float, float]:
    """A cycle of a three-link gait in a periodic box.

    returns  largest change of the total momentum over the creature's largest; largest relative
             error of the coupled solve's exchange
    """
    gait = tuple(
        TrajectorySinusoid(np.array([6 + k]), 0.8, PERIOD, 0.0, 0.5 * np.pi * k) for k in range(2)
    )
    world = swimmer(cells, gait, RING)
    model, dt = world.setup.solid, PERIOD / steps
    change = largest = exchange = 0.0
    for _ in range(steps):
        report = advance(world, dt)
        creature = halfway_momentum(model, world.solid, dt)[0]
        total = creature + report.momentum_fluid
        change = max(change, float(np.abs(total).max()))
        largest = max(largest, float(np.abs(creature).max()))
        exchange = max(exchange, report.momentum_exchange_error)
    return change / largest, exchange


def scallop(cells: int, steps: int, cycles: int) -> float:
    """Largest drift of the mass centre in a cycle of one hinge that opens and closes, over L."""
    hinge = TrajectorySinusoid(np.array([6]), 0.5, PERIOD, 0.7, -0.5 * np.pi)
    world = swimmer(cells, (hinge,), None)
    centres = [mass_centre(world)]
    for _ in range(cycles):
        advance(world, PERIOD / steps, steps)
        centres.append(mass_centre(world))
    drifts = np.linalg.norm(np.diff(centres, axis=0), axis=1)
    return float(drifts.max()) / (2.0 * LINK)


def invariants(cells: int, cycles: int) -> Figures:
    """S5: momentum in a periodic box, and the scallop, which does not advance."""
    change, exchange = momentum_kept(cells, 2 * cells)
    return {
        "change of the total momentum in a cycle, over the creature's": change,
        "momentum that a coupled solve makes or loses, relative": exchange,
        "drift of a one-hinge swimmer in a cycle over its length": scallop(cells, cells, cycles),
    }
