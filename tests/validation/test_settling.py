"""V1 and V2 on coarse grids."""

from __future__ import annotations

import numpy as np
import pytest

from flowborne.worlds import advance
from flowborne_validation.cases import case
from flowborne_validation.settling import CYLINDER_GRAVITY, DENSITY, GRAVITY, box, fastest, quarter


def test_V2_largest_velocities_are_measured_ones_and_the_curves_those_of_six_cells():
    """Largest velocities to the 3 % of the source on both grids. Six cells across a sphere are too
    few for the 5 % that it asks of the curve: what they give is repeated."""
    findings = case("V2").run(quick=True)
    assert all(result.verdict != "fail" for result in findings)
    for result in findings[::2]:
        assert result.series.values == pytest.approx(2 * [result.reference], rel=0.03)
    curves = [result.value for result in findings[1::2]]
    assert curves == pytest.approx([0.1, 0.08469], rel=0.01)


@pytest.mark.parametrize("density", [970.0, 962.0])
def test_V2_without_friction_a_sphere_starts_with_its_added_mass(density):
    """A quarter of the pull on a quarter of the masses; the box is wide enough for Ca = 1/2."""
    world = quarter(4, density, 0.0)
    advance(world, 1e-4)
    free = (DENSITY - density) * GRAVITY / (DENSITY + 0.5 * density)
    assert -world.solid.v[0] / 1e-4 == pytest.approx(free, rel=0.01)


@pytest.mark.parametrize("density", [1.25, 1.5])
def test_V1_without_friction_a_cylinder_starts_with_its_added_mass(density):
    """In a box 8 D wide Ca is 1.03: the mean over four places in its cell, each within 2 %."""
    free, found = (density - 1.0) * CYLINDER_GRAVITY / (density + 1.03), []
    for place in ((0.0, 0.0), (0.5, 0.0), (0.0, 0.5), (0.5, 0.5)):
        world = box(6, density, 0.0)
        world.solid.q[:2] += np.array(place) * world.flow()[0].grid.spacing
        advance(world, 1e-4)
        found.append(-world.solid.v[1] / 1e-4)
        assert abs(world.solid.v[0]) < 1e-3 * abs(world.solid.v[1])
    assert np.mean(found) == pytest.approx(free, rel=0.01)
    assert found == pytest.approx([free] * 4, rel=0.02)


def test_V1_the_slow_cylinder_repeats_its_own_speed_on_four_cells():
    """1.5 % below the reference, for which the list has 17.2 to 17.5."""
    largest, course = fastest(4, 1.25, 0.1, 17.3, 0.6)
    assert largest == pytest.approx(17.1408, rel=1e-3)
    assert course[-1, 1] > 0.9 * largest
