"""A cylinder on a spring across a stream: V5."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flowborne import Array, Grid, World
from flowborne.boundaries import Boundaries, BoundaryInflow, BoundaryOpen
from flowborne.validation.case import Case, Finding, Tier
from flowborne.validation.fixed_bodies import STREAM, UNBOUNDED, Kicked
from flowborne.validation.reference import confirmed
from flowborne.validation.shedding import Shedding, amplitude
from flowborne.validation.worlds import mjcf
from flowborne.worlds import advance, make_world, set_velocity

REYNOLDS, MASS = 150.0, 2.0
"""Re, and the cylinder's mass over rho D^2; D = 1 m, U = 1 m/s."""

CELLS = {True: 4, False: 16}
"""Across D, by quick."""

SPEEDS = {True: (3.0, 5.0, 8.0), False: (3.0, 4.0, 5.0, 6.0, 7.0, 8.0)}
"""U / (f_n D), by quick; f_n is the frequency on the spring in vacuum."""

IN_STEP, OUT_OF_STEP = 5.0, 3.0
"""Of these, one at which the vortices keep step with the spring, and one at which they do not."""

DURATION, PERIODS = 120.0, 5
"""Times D/U, and periods at their end that are looked at."""

CFL = 1.0
"""Cells that the oncoming flow crosses in a step."""


def sprung(cells: int, speed: float) -> World:
    """The cylinder that may move across the stream only, held by its spring, without damping."""
    stiffness = MASS * (2.0 * np.pi / speed) ** 2
    body = (
        f'<body name="cylinder"><joint name="y" type="slide" axis="0 1 0" stiffness="{stiffness}"/>'
        '<geom type="cylinder" size="0.5 1"/></body>'
    )
    return make_world(
        mjcf(body),
        Grid.slab(40 * cells, 40 * cells, 1.0 / cells, (-15.0, -20.0)),
        solid_density=MASS / (0.25 * np.pi),
        viscosity=1.0 / REYNOLDS,
        boundaries=Boundaries(BoundaryInflow(STREAM), BoundaryOpen()),
        tolerance=1e-7,
    )


@dataclass(frozen=True)
class Vibration:
    """The cylinder's way in the last periods: A/D, and its frequency over that of its spring."""

    amplitude: float
    frequency: float


def vibration(cells: int, speed: float) -> Vibration:
    """The cylinder's way from a stream with a gust across its wake."""
    world = sprung(cells, speed)
    set_velocity(world, Kicked(STREAM, UNBOUNDED, 0.0, 0.0))
    dt = CFL / cells
    way: list[float] = []
    for _ in range(round(DURATION / dt)):
        advance(world, dt)
        way.append(float(world.solid.q[0]))
    places: Array = np.array(way[len(way) // 2 :])
    seen = Shedding(dt, places, places, places)
    steps, period = seen.last(PERIODS)
    return Vibration(amplitude(places[steps]), speed / period)


def vibrating(quick: bool) -> list[Finding]:
    """V5: how far the cylinder swings in step with its spring, how little out of step."""
    found = {speed: vibration(CELLS[quick], speed) for speed in SPEEDS[quick]}
    lines = tuple(
        f"U/(f_n D) = {speed:g}: A/D {seen.amplitude:.3f}, f/f_n {seen.frequency:.3f}"
        for speed, seen in found.items()
    )
    best, worst = found[IN_STEP], found[OUT_OF_STEP]
    drop = best.amplitude / worst.amplitude
    peak, lock = confirmed("V5", "(a) peak A/D"), confirmed("V5", "lock-in")
    at = f"at U/(f_n D) = {IN_STEP:g}"
    return [
        Finding(
            f"A/D {at}",
            best.amplitude,
            0.55,
            "[0.5, 0.6] with a margin of 0.05",
            0.45 <= best.amplitude <= 0.65,
            lines=lines,
            confirmed=peak,
        ),
        Finding(
            f"f/f_n {at}",
            best.frequency,
            1.0,
            "10 %",
            abs(best.frequency - 1.0) <= 0.1,
            confirmed=lock,
        ),
        Finding(
            f"A/D {at} over that at {OUT_OF_STEP:g}",
            drop,
            5.0,
            "more than 5",
            drop > 5.0,
            confirmed=lock,
        ),
    ]


CASES = (Case("V5", vibrating, Tier.HALF_HOUR),)
