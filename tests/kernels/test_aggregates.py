"""Which coarse cell a fine cell goes with."""

import numpy as np
import pytest

from flowborne.kernels.aggregates import (
    OWN,
    add_orphan_weights,
    assign_orphans,
    mark_interpolated,
    mark_own,
)
from flowborne.kernels.levels import (
    S0,
    at_level,
    interpolation_at,
    orphans_at,
    weights_at,
    wrap_ghosts,
)
from flowborne.solvers.pressure import PressureSystem

from .padded import cells_of
from .references.aggregates import mark_interpolated_reference, mark_own_reference
from .references.orphans import add_orphan_weights_reference, assign_orphans_reference
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
    assert orphans_at(b.orphans, b.table, 0).size == 0


def test_wall_through_coarse_cells_stays_shut_on_all_levels():
    """Half of each coarse cell on the wall is a orphan beyond, and no level leaks."""
    system = walled(16, 7)
    b = system.buffers
    assert system.regions == 2
    orphans = orphans_at(b.orphans, b.table, 0)
    assert orphans.size == 16
    for level in range(b.table.shape[0] - 1):
        across = weights_at(b.weights, b.table, level)[1][0, 2:-2, 1:-1]
        shut = (across == 0.0).all(axis=1)
        assert shut.sum() == 1, level
        scale = across[~shut]
        np.testing.assert_allclose(scale, scale[0, 0], rtol=0.6)


def test_aggregates_lie_on_the_orphans_side():
    b = walled(16, 7).buffers
    orphans = orphans_at(b.orphans, b.table, 0)
    aggregate = at_level(b.aggregates, b.table, 0).reshape(-1)[orphans]
    fine_x = orphans // 18 - 1
    coarse_x = aggregate // 10 - 1
    left = fine_x < 7
    assert (coarse_x[left] <= 2).all()
    assert (coarse_x[~left] >= 4).all()


@pytest.mark.parametrize(("shape", "periodic"), [*SHAPES, *LARGER])
@pytest.mark.parametrize("seed", [0, 1])
def test_marks_orphans_and_their_weights_are_what_numpy_says(shape, periodic, seed):
    system = system_of(shape, periodic, seed)
    b, around = system.buffers, system.buffers.periodic
    table, marks = b.table, at_level(b.marks, b.table, 0).copy()
    w, inverse = weights_at(b.weights, table, 0), at_level(b.inverse, table, 0)
    factor = table[1, S0 : S0 + 3] // table[0, S0 : S0 + 3]
    mark_own(marks, w, inverse, factor)
    np.testing.assert_array_equal(marks[cells_of(marks)], mark_own_reference(w, inverse, factor))
    wrap_ghosts(marks, around)
    interpolation = interpolation_at(b.interpolation, table, 0)
    expected = mark_interpolated_reference(marks, w, inverse, interpolation)
    mark_interpolated(marks, w, inverse, interpolation)
    np.testing.assert_array_equal(marks, expected)
    wrap_ghosts(marks, around)
    coarse = tuple(values.copy() for values in weights_at(b.weights, table, 1))
    orphans, aggregates = np.zeros(marks.size, np.int32), np.zeros(marks.shape, np.int32)
    given = marks, w, inverse, factor, around, np.array(coarse[0].shape)
    count = assign_orphans(*given, orphans, aggregates)
    seated, aggregate = assign_orphans_reference(*given)
    assert 0 < count < (inverse[cells_of(marks)] > 0.0).sum() / 4
    np.testing.assert_array_equal(orphans[:count], seated)
    np.testing.assert_array_equal(aggregates.ravel()[orphans[:count]], aggregate)
    assert np.count_nonzero(aggregates) == count
    ratio = np.random.default_rng(seed).random((3, max(coarse[0].shape)))
    given = factor, ratio, around, orphans[:count], aggregates
    expected = add_orphan_weights_reference(marks, w, coarse, *given)
    change = max(float(np.abs(a - b).max()) for a, b in zip(coarse, expected, strict=True))
    assert change > 0.01 or marks.size < 1000
    add_orphan_weights(marks, w, coarse, *given)
    for one, other in zip(coarse, expected, strict=True):
        np.testing.assert_allclose(one, other, rtol=1e-5, atol=1e-6)
