"""Which coarse cell a fine cell goes with."""

import numpy as np
import pytest

from flowborne.kernels.aggregates import (
    OWN,
    mark_leaning,
    mark_leaning_reference,
    mark_own,
    mark_own_reference,
)
from flowborne.kernels.guests import (
    add_guest_weights,
    add_guest_weights_reference,
    seat_guests,
    seat_guests_reference,
)
from flowborne.kernels.levels import S0, at_level, guests_at, leaning_at, weights_at, wrap_ghosts
from flowborne.kernels.vectors import cells_of
from flowborne.solvers.pressure import PressureSystem

from .test_multigrid import SHAPES, system_of

LARGER = [((40, 30, 1), (True, True, False)), ((14, 13, 12), (True, False, True))]


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


@pytest.mark.parametrize(("shape", "periodic"), [*SHAPES, *LARGER])
@pytest.mark.parametrize("seed", [0, 1])
def test_marks_guests_and_their_weights_are_what_numpy_says(shape, periodic, seed):
    system = system_of(shape, periodic, seed)
    b, around = system.buffers, system.periodic
    table, marks = b.table, at_level(b.marks, b.table, 0).copy()
    w, inverse = weights_at(b.weights, table, 0), at_level(b.inverse, table, 0)
    factor = table[1, S0 : S0 + 3] // table[0, S0 : S0 + 3]
    mark_own(marks, w, inverse, factor)
    np.testing.assert_array_equal(marks[cells_of(marks)], mark_own_reference(w, inverse, factor))
    wrap_ghosts(marks, around)
    lean = leaning_at(b.lean, table, 0)
    expected = mark_leaning_reference(marks, w, inverse, lean)
    mark_leaning(marks, w, inverse, lean)
    np.testing.assert_array_equal(marks, expected)
    wrap_ghosts(marks, around)
    coarse = tuple(values.copy() for values in weights_at(b.weights, table, 1))
    guests, hosts = np.zeros(marks.size, np.int32), np.zeros(marks.shape, np.int32)
    given = marks, w, inverse, factor, around, np.array(coarse[0].shape)
    count = seat_guests(*given, guests, hosts)
    seated, host = seat_guests_reference(*given)
    assert 0 < count < (inverse[cells_of(marks)] > 0.0).sum() / 4
    np.testing.assert_array_equal(guests[:count], seated)
    np.testing.assert_array_equal(hosts.ravel()[guests[:count]], host)
    assert np.count_nonzero(hosts) == count
    ratio = np.random.default_rng(seed).random((3, max(coarse[0].shape)))
    given = factor, ratio, around, guests[:count], hosts
    expected = add_guest_weights_reference(marks, w, coarse, *given)
    change = max(float(np.abs(a - b).max()) for a, b in zip(coarse, expected, strict=True))
    assert change > 0.01 or marks.size < 1000
    add_guest_weights(marks, w, coarse, *given)
    for one, other in zip(coarse, expected, strict=True):
        np.testing.assert_allclose(one, other, rtol=1e-5, atol=1e-6)
