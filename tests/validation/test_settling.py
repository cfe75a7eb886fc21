"""V2 on coarse grids."""

from dataclasses import replace

import pytest

from flowborne.validation import case
from flowborne.validation.settling import DENSITY, GRAVITY, OILS, quarter
from flowborne.worlds import advance


def test_V2_spheres_settle_near_their_speed():
    findings = case("V2").run(quick=True)
    for peak, curve in (findings[:2], findings[2:]):
        assert peak.series.falls, peak.lines
        assert peak.series.errors[-1] < 0.12, peak.lines
        assert curve.value < 0.15, curve.lines


@pytest.mark.parametrize("oil", OILS, ids=lambda oil: oil.name)
def test_V2_without_friction_a_sphere_starts_with_its_added_mass(oil):
    """A quarter of the pull on a quarter of the masses; the box is wide enough for Ca = 1/2."""
    world = quarter(replace(oil, viscosity=0.0), 4)
    advance(world, 1e-4)
    free = (DENSITY - oil.density) * GRAVITY / (DENSITY + 0.5 * oil.density)
    assert -world.solid.v[0] / 1e-4 == pytest.approx(free, rel=0.015)
