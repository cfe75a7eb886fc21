"""Which coarse cell a fine cell goes with."""

import numpy as np

from flowborne.kernels.aggregates import OWN
from flowborne.kernels.levels import at_level, guests_at, weights_at
from flowborne.solvers.pressure import PressureSystem


def walled(n, wall):
    """Unit weights in a closed box with the faces x = `wall` shut."""
    weights = [np.ones((n + 1, n, 1)), np.ones((n, n + 1, 1)), np.zeros((n, n, 2))]
    weights[0][[0, wall, -1]] = 0.0
    weights[1][:, [0, -1]] = 0.0
    return PressureSystem(weights)


def test_every_cell_keeps_its_own_without_obstacles():
    b = walled(16, 8).buffers
    assert (at_level(b.marks, b.table, 0)[0, 1:-1, 1:-1] >= OWN).all()
    assert guests_at(b.guests, b.table, 0).size == 0


def test_wall_through_coarse_cells_stays_shut_on_all_levels():
    """Half of each coarse cell on the wall is a guest beyond, and no level leaks."""
    system = walled(16, 7)
    b = system.buffers
    assert system.regions == 2
    guests = guests_at(b.guests, b.table, 0)
    assert guests.size == 16
    for level in range(b.table.shape[0] - 1):
        across = weights_at(b.weights, b.table, level)[1][0, 2:-2, 1:-1]
        shut = (across == 0.0).all(axis=1)
        assert shut.sum() == 1, level
        scale = across[~shut]
        np.testing.assert_allclose(scale, scale[0, 0], rtol=0.6)


def test_hosts_lie_on_the_guests_side():
    b = walled(16, 7).buffers
    guests = guests_at(b.guests, b.table, 0)
    host = at_level(b.hosts, b.table, 0).reshape(-1)[guests]
    fine_x = guests // 18 - 1
    coarse_x = host // 10 - 1
    left = fine_x < 7
    assert (coarse_x[left] <= 2).all()
    assert (coarse_x[~left] >= 4).all()
