"""V2 on coarse grids."""

from dataclasses import replace

import pytest

from flowborne.validation import case
from flowborne.validation.settling import DENSITY, GRAVITY, OILS, quarter
from flowborne.worlds import advance


def test_V2_largest_velocities_are_measured_ones_and_the_curves_those_of_six_cells():
    """Largest velocities to the 3 % of the source. Six cells across a sphere are too few for the
    5 % that it asks of the curve: what they give is repeated."""
    findings = case("V2").run(quick=True)
    assert [result.verdict for result in findings] == ["pass", "coarse", "pass", "coarse"]
    curves = [result.value for result in findings[1::2]]
    assert curves == pytest.approx([0.12843, 0.081829], rel=0.01)


@pytest.mark.parametrize("oil", OILS, ids=lambda oil: oil.name)
def test_V2_without_friction_a_sphere_starts_with_its_added_mass(oil):
    """A quarter of the pull on a quarter of the masses; the box is wide enough for Ca = 1/2."""
    world = quarter(replace(oil, viscosity=0.0), 4)
    advance(world, 1e-4)
    free = (DENSITY - oil.density) * GRAVITY / (DENSITY + 0.5 * oil.density)
    assert -world.solid.v[0] / 1e-4 == pytest.approx(free, rel=0.01)
