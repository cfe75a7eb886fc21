"""Cells that have opened in a step get the pressure around them."""

from __future__ import annotations

import numpy as np

from flowborne.kernels.projection import fill_fresh


def row(pressures: list[float], opened: list[float], ring: bool = False) -> list[float]:
    """Pressures in a row of cells along y, whose faces across y are open in these parts."""
    pressure = np.array(pressures).reshape(1, -1, 1)
    count = pressure.size
    faces = np.zeros((2, count, 1)), np.array(opened).reshape(1, -1, 1), np.zeros((1, count, 2))
    wraps = np.array([0, count if ring else 0, 0])
    fill_fresh(pressure, faces, np.flatnonzero(pressure == 0.0), wraps)
    return [float(p) for p in pressure.ravel()]


def test_a_fresh_cell_has_the_mean_of_those_beside_it_by_how_open_the_way_is() -> None:
    assert row([3.0, 0.0, 6.0], [0.0, 0.25, 0.5, 0.0]) == [3.0, 5.0, 6.0]


def test_cells_behind_fresh_ones_follow_and_closed_ones_stay_without() -> None:
    found = row([2.0, 0.0, 0.0, 0.0, 5.0], [0.0, 0.1, 0.3, 0.0, 0.0, 0.0])
    assert found == [2.0, 2.0, 2.0, 0.0, 5.0]


def test_across_a_periodic_side() -> None:
    assert row([0.0, 1.0, 4.0], [1.0, 0.0, 1.0, 1.0], ring=True) == [4.0, 1.0, 4.0]


def test_nothing_is_made_where_no_cell_has_a_pressure() -> None:
    assert row([0.0, 0.0], [1.0, 1.0, 1.0]) == [0.0, 0.0]
