"""What mouths let through brings its momentum along, whatever the grid."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from flowborne import Array, Grid, World, step
from flowborne.coupling.mouths import Mouth
from flowborne.motion.inflow import FactorPulse
from flowborne.worlds import Boundaries, BoundaryOpen, make_world
from flowborne_validation.worlds import mjcf

RADIUS, HALF, RATE, DURATION = 0.2, 0.1, 0.1, 1.0
SQUARE = Grid.slab(48, 48, 2.0 / 48.0, (-1.0, -1.0))
CUBE = Grid((20, 20, 20), 1.0 / 20.0, (-0.5, -0.5, -0.5))


def with_mouths(grid: Grid, *angles: float, rate: float = RATE) -> World:
    """A held disc or ball in open surroundings, with mouths at angles to x."""
    ball = f'<body pos="0 0.007 0"><geom type="sphere" size="{RADIUS}"/></body>'
    sides = Boundaries(*(BoundaryOpen(),) * (4 if grid.is_slab else 6))
    world = make_world(mjcf(ball), grid, boundaries=sides)
    mouths = []
    for angle in angles:
        x, y = np.cos(angle), np.sin(angle)
        place = (RADIUS * x, RADIUS * y, 0.0)
        mouths.append(
            Mouth(
                "a mouth", 1, place, (x, y, 0.0), HALF, rate, FactorPulse(2.0 * DURATION, DURATION)
            )
        )
    return World.at_rest(replace(world.setup, mouths=tuple(mouths)))


def impulses(world: World) -> tuple[Array, Array, Array]:
    """(3,) each over one pulse: on the body by pressure and by the jets; made by advection."""
    area = 2.0 * HALF if world.flow()[0].grid.is_slab else np.pi * HALF**2
    steps = int(np.ceil(1.5 * DURATION * RATE / area / world.flow()[0].grid.spacing))
    pressed, blown, made = np.zeros(3), np.zeros(3), np.zeros(3)
    for _ in range(steps):
        report = step(world, DURATION / steps)
        pressed += report.momentum_exchanged
        blown += report.jet_wrench[1, :3] * report.dt
        made += report.momentum_advection
    return pressed, blown, made


def test_a_held_body_that_drinks_is_not_pushed_in_the_end() -> None:
    """Ideal fluid that flows into a sink from all sides and then rests again has no momentum: what
    the body swallows, rho Q w, its skin gives back by suction."""
    pressed, blown, _ = impulses(with_mouths(SQUARE, 0.0, rate=-RATE))
    assert abs(blown[0]) > 0.01
    assert np.abs(pressed + blown).max() < 0.1 * abs(blown[0])


@pytest.mark.parametrize("rate", [RATE, -RATE])
@pytest.mark.parametrize(
    ("grid", "angle"),
    [(SQUARE, 0.0), (SQUARE, 0.7), (CUBE, 0.7)],
    ids=["square", "square-askew", "cube"],
)
def test_the_flow_gets_the_momentum_of_a_pulse(grid: Grid, rate: float, angle: float) -> None:
    """From a mouth two cells in radius; interpolation alone loses a third to nine tenths of it."""
    _, blown, made = impulses(with_mouths(grid, angle, rate=rate))
    assert np.linalg.norm(made) < 0.1 * np.linalg.norm(blown)


def test_two_mouths_beside_each_other_keep_their_momentum() -> None:
    _, blown, made = impulses(with_mouths(SQUARE, 0.4, -0.4))
    assert np.linalg.norm(made) < 0.03 * np.linalg.norm(blown)
