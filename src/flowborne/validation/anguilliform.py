"""An eel that swims by itself: S1, in two dimensions."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flowborne import Array, Grid, World
from flowborne.motions import Trajectory
from flowborne.validation.case import Case, Curve, Finding, GridSeries, Plot, Tier
from flowborne.validation.reference import confirmed, reference
from flowborne.validation.swimmers import mass_centre
from flowborne.validation.worlds import mjcf, whole_steps
from flowborne.worlds import advance, make_world

VISCOSITY = 1.4e-4
"""Pa s; the eel is 1 m long and beats once in 1 s, fluid and eel have 1 kg/m^3."""

LINKS = 20
"""Rigid links whose hinges follow the midline."""

LENGTH, WIDTH = 8, 2
"""m, of the closed box along the eel's way and across."""

GRIDS = {True: (48, 64), False: (64, 128, 256)}
"""Cells in the eel's length, by quick."""

PERIODS = {True: 6, False: 8}
"""That the eel is given from rest, by quick; the last one is looked at."""

CFL = 0.5
"""Cells that the tail moves to the side in a step at most, at 2 pi / 8 m/s."""

SPEED = "mean forward speed 2D"

SWAY, OFFSET = 0.125 / 1.03125, 0.03125
"""Of the midline's lateral way SWAY (s + OFFSET) sin 2 pi (s - t), m."""


def half_width(s: float) -> float:
    """Of the eel, at s from its nose, m."""
    head, tail, end = 0.04, 0.01, 0.95
    if s < head:
        return float(np.sqrt(2.0 * head * s - s * s))
    if s < end:
        return head - (head - tail) * (s - head) / (end - head)
    return tail * (1.0 - s) / (1.0 - end)


@dataclass(frozen=True)
class Bend:
    """A hinge's angle: by how much the midline's direction differs between two places.

    dofs       (1,) the hinge's
    near, far  the places, m from the nose
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
    """Angle of the midline at s in rad, and its rate in rad/s; grown from 0 in the first second."""
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
    """A free chain of capsules with its nose at the origin and its tail at x = 1 m.

    Neighbours overlap; a link has the mass of its part of the outline.
    """
    size = 1.0 / LINKS
    body = ""
    for k in reversed(range(LINKS)):
        width = half_width((k + 0.5) * size)
        start = width if k == 0 else 0.0
        stop = size - width if k == LINKS - 1 else size
        half = 0.5 * (stop - start)
        density = 2.0 * width * size / (4.0 * width * half + np.pi * width**2)
        joint = f'<joint name="j{k}" axis="0 0 1"/>' if k else '<freejoint name="root"/>'
        body = (
            f'<body name="link{k}" pos="{size if k else 0.0} 0 0">{joint}'
            f'<geom type="capsule" size="{width} {half}" pos="{start + half} 0 0" zaxis="1 0 0" '
            f'density="{density}"/>{body}</body>'
        )
    return mjcf(body)


def tank(cells: int) -> World:
    """The eel straight and at rest near one end of the box, its nose towards the other, -x."""
    size = 1.0 / LINKS
    bends: tuple[Trajectory, ...] = tuple(
        Bend(np.array([5 + k]), (k - 0.5) * size, (k + 0.5) * size) for k in range(1, LINKS)
    )
    return make_world(
        eel(),
        Grid.slab(LENGTH * cells, WIDTH * cells, 1.0 / cells, (2.0 - LENGTH, -0.5 * WIDTH)),
        viscosity=VISCOSITY,
        motions=bends,
        tolerance=1e-7,
    )


def swim(cells: int, periods: int) -> Array:
    """(n+1, 2) times in s and places of the mass centre along -x in m."""
    world = tank(cells)
    count, dt = whole_steps(1.0, CFL / cells / (0.25 * np.pi))
    rows = [(0.0, -float(mass_centre(world)[0]))]
    for _ in range(count * periods):
        advance(world, dt)
        rows.append((world.time, -float(mass_centre(world)[0])))
    return np.array(rows)


def last_speed(way: Array, periods: int) -> float:
    """Mean speed in the last period, m/s."""
    return float(way[-1, 1] - way[-1 - (len(way) - 1) // periods, 1])


def swimming(quick: bool) -> list[Finding]:
    """S1: mean speed of the eel in its last period."""
    grids, periods = GRIDS[quick], PERIODS[quick]
    ways = [swim(n, periods) for n in grids]
    speeds = [last_speed(way, periods) for way in ways]
    exact = float(reference("S1", SPEED).removesuffix(" L/T"))
    series = GridSeries("cells in the length", grids, speeds, [abs(v - exact) for v in speeds])
    period = (len(ways[-1]) - 1) // periods
    mean = ways[-1][period:, 1] - ways[-1][:-period, 1]
    times = ways[-1][period:, 0] - 0.5
    curves = (
        Curve("published", (times[0], times[-1]), (exact, exact), True),
        Curve("flowborne, mean of a period", times[::8], mean[::8]),
    )
    return [
        Finding(
            "mean forward speed, L/T",
            speeds[-1],
            exact,
            "10 %",
            abs(speeds[-1] / exact - 1.0) <= 0.1,
            series,
            plot=Plot("t/T", "forward speed (L/T)", curves),
            confirmed=confirmed("S1", SPEED),
        )
    ]


CASES = (Case("S1", swimming, Tier.HALF_HOUR, coarse=True),)
