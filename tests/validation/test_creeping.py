"""C1 to C4 on coarse grids; see tests/coupling/test_creeping.py for the rods."""

import pytest

from flowborne_validation.creeping import array_drag, scallop_drift


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
