"""Kernels and their parallel twins."""

import numpy as np
from numba import prange

from flowborne.fluid.jit import kernel, parallel_kernels


@kernel
def double(x):
    """x *= 2."""
    for n in prange(x.size):
        x[n] *= 2.0


@kernel
def quadruple(x):
    """x *= 4 by another kernel."""
    double(x)
    double(x)


@kernel
def shift(x):
    """x += 1, nothing to share out."""
    for n in range(x.size):
        x[n] += 1.0


def test_kernels_of_kernels_run_their_twins_inside_the_context_only():
    expected = 4.0 * np.arange(5.0)
    for wanted in (False, True):
        x = np.arange(5.0)
        with parallel_kernels(wanted):
            quadruple(x)
        np.testing.assert_array_equal(x, expected)
    assert quadruple.parallel is not quadruple.serial
    assert quadruple.parallel.py_func.__globals__["double"] is double.parallel


def test_kernel_without_a_parallel_loop_has_no_twin():
    assert shift.parallel is shift.serial


def test_context_is_left_after_an_error():
    try:
        with parallel_kernels():
            raise RuntimeError("stop")
    except RuntimeError:
        pass
    x = np.ones(3)
    shift(x)
    np.testing.assert_array_equal(x, 2.0)
