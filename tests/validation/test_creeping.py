"""C1 to C5 on coarse grids; see tests/coupling/test_creeping.py for the rods."""

import numpy as np
import pytest

import purcell
from flowborne.worlds import advance, start
from flowborne_validation.case import reference
from flowborne_validation.creeping import BASIN, array_drag, scallop_drift, three_links


def test_C3_a_scallop_stays_where_it_is() -> None:
    """.65 mm in two cycles with one sweep a step."""
    (way,) = scallop_drift(45, 1, 1000.0).values()
    assert abs(way.values) < 0.1


def test_C4_spheres_in_a_cube() -> None:
    """A volume fraction of .064: 2.81, and first order in the cell."""
    coarse, fine = (array_drag(cells, 0.4962) / 2.81 for cells in (12, 24))
    assert coarse == pytest.approx(1.0, abs=0.08)
    assert fine == pytest.approx(1.0, abs=0.04)
    assert abs(fine - 1.0) < 0.6 * abs(coarse - 1.0)


def test_C5_velocity_of_purcells_swimmer() -> None:
    """Half a quarter of the cycle on two cells across a link, beside regularised Stokeslets."""
    world = three_links(2)
    start(world, 0.125)
    advance(world, 0.125)
    velocity = purcell.by_stokeslets(0.125, np.pi / 48.0, BASIN)
    known = velocity(world.solid.q[:3], world.solid.q[3:], world.solid.v[3:])
    assert np.linalg.norm(world.solid.v[:3] - known) < 0.05 * np.linalg.norm(known)


@pytest.mark.parametrize(
    ("half", "exact"), [(1.0, 6.0 * np.pi), (8.0, 8.0 * purcell.spheroid_drag(8.0))]
)
def test_C5_drag_by_regularised_stokeslets(half: float, exact: float) -> None:
    spacing = 2.0 * np.pi / 20.0
    found = purcell.drag(purcell.spheroid(half, 1.0, spacing), spacing)
    assert found / exact == pytest.approx(1.0, abs=0.01)


def test_C5_images_keep_the_fluid_inside() -> None:
    """No flow by a force inside through a point of each of three walls."""
    walls = [(1.999999, 0.2, 0.1), (0.5, 1.499999, 0.2), (0.2, -0.3, 0.499999)]
    x = np.array([(0.3, -0.2, 0.1), *walls])
    free = purcell.stokeslets(x, 1e-4)
    bounded = free + purcell.images(x, (4.0, 3.0, 1.0))
    for axis in range(3):
        assert abs(free[axis, axis + 1, :, 0]).max() > 0.01
        assert abs(bounded[axis, axis + 1, :, 0]).max() < 1e-4


def test_C5_resistive_force_theory_and_thick_links() -> None:
    """Stokes flow around links of 8:1 is between ratios of drags of 1.3 and 2."""
    known = reference("C5", "resistive-force theory, by ratio of drags")
    for ratio, displacement in known.items():
        found = purcell.cycle(purcell.by_resistive_forces(float(ratio)), 8)
        assert found == pytest.approx(displacement, rel=1e-2)
    points, thick = purcell.displacement(8.0, 8)
    assert points == 488
    assert known["1.3"] < thick < known["2"]
