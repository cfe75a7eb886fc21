"""Regions of the fluid and the pressures that push nothing."""

import numpy as np
import pytest

from flowborne.solvers.mobility import dense_mobility
from flowborne.solvers.pressure import PressureSystem, null_basis


def boxes(shape, walls, periodic=(False, False, False)):
    """Unit weights in a closed box, shut at the planes x in `walls`."""
    weights = []
    for axis in range(3):
        size = list(shape)
        size[axis] += 1
        w = np.ones(size)
        if not periodic[axis]:
            np.moveaxis(w, axis, 0)[[0, -1]] = 0.0
        weights.append(w)
    weights[0][list(walls)] = 0.0
    return weights


@pytest.mark.parametrize("shape", [(12, 7, 1), (12, 5, 6)])
def test_closed_regions_are_counted(shape):
    closed = (False, False, False)
    around = (True, False, False)
    assert PressureSystem(boxes(shape, [])).regions == 1
    assert PressureSystem(boxes(shape, [3, 8])).regions == 3
    assert PressureSystem(boxes(shape, [3, 8], around), around).regions == 2
    opened = boxes(shape, [3, 8])
    opened[0][0] = 2.0
    system = PressureSystem(opened, closed)
    assert system.regions == 2
    assert sorted(system.buffers.count[:2]) == [n * shape[1] * shape[2] for n in (4, 5)]


def test_null_basis_is_orthonormal_and_moves_nothing():
    rng = np.random.default_rng(0)
    count = np.array([5, 9, 2, 30, 7], np.int32)
    loads = rng.standard_normal((5, 6))
    loads[3] = 0.0
    half = rng.standard_normal((6, 2))
    mobility = half @ half.T
    basis = null_basis(count, loads, dense_mobility(mobility))
    assert basis.shape == (5, 3)
    np.testing.assert_allclose(basis.T @ (count[:, None] * basis), np.eye(3), atol=1e-12)
    np.testing.assert_allclose(half.T @ loads.T @ basis, 0.0, atol=1e-12)


def test_rounding_of_a_wrench_that_cancels_is_no_push():
    """Constant pressure around a body that the fluid surrounds."""
    from flowborne.kernels.regions import region_loads

    label = np.zeros((1, 4, 4), np.int32)
    cells = np.array([5, 6, 9])
    rows = (cells, np.arange(4), np.zeros(3, np.int64), np.array([0.1, 0.2, -0.3]))
    assert not region_loads(label, 1, 6, rows).any()
