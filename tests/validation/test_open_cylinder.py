"""B4 on four cells across D, and how its figures are read."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest

from flowborne import Array
from flowborne.validation.fixed_bodies import STREAM, UNBOUNDED, open_water
from flowborne.validation.fixed_sphere import separation
from flowborne.validation.open_cylinder import bubble, numbers_of
from flowborne.worlds import advance, set_velocity

ASIDE = (0.0, 1.0, 0.0)


@dataclass(frozen=True)
class Turning:
    """A flow along circles about the origin that turns round at an angle from the front."""

    angle: float

    def __call__(self, x: Array, y: Array, z: Array) -> tuple[Array, Array, Array]:
        theta = np.arctan2(y, -x)
        along = np.sin(self.angle - theta)
        return along * np.sin(theta), along * np.cos(theta), 0.0 * along


def test_B4_repeats_its_own_drag_and_bubble_on_four_cells_across_D():
    """After ten times D/U; the drag is within the list's 1.48 to 1.62, the bubble still grows."""
    world = open_water(4, 1.0 / 40.0)
    set_velocity(world, STREAM)
    drag, lift = UNBOUNDED.coefficients(advance(world, 0.25, 40))
    assert drag == pytest.approx(1.588, rel=2e-3)
    assert abs(lift) < 0.01 * drag
    assert bubble(world) == pytest.approx(1.3625, rel=0.01)


def test_B4_figures_of_known_flows():
    world = open_water(8, 1.0 / 40.0)
    set_velocity(world, Turning(np.radians(130.0)))
    assert separation(world, ASIDE) == pytest.approx(130.0, abs=0.5)
    set_velocity(world, lambda x, y, z: (x - 2.8 + 0.0 * y, 0.0 * x, 0.0 * x))
    assert bubble(world) == pytest.approx(2.3, abs=0.01)
    set_velocity(world, STREAM)
    assert bubble(world) == 0.0
    assert separation(world, ASIDE) == 180.0


def test_V9_reads_the_list():
    assert numbers_of("Cd 1.287, Cl_rms 0.443") == {"Cd": 1.287, "Cl_rms": 0.443}
