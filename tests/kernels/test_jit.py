"""Kernels and their parallel twins."""

import gc
import signal
from concurrent.futures import ThreadPoolExecutor
from contextlib import nullcontext

import numpy as np
import pytest
from numba import prange
from numba.core import event
from numba.core.registry import cpu_target

from flowborne.kernels import jit
from flowborne.kernels.jit import LARGE, allowed_threads, kernel, kernel_threads


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


def test_kernels_of_kernels_run_their_twins_inside_the_context_only(monkeypatch):
    monkeypatch.setattr(jit, "cores", lambda: 2)
    expected = 4.0 * np.arange(LARGE)
    for most in (1, 2):
        x = np.arange(float(LARGE))
        with kernel_threads(most):
            quadruple(x)
        np.testing.assert_array_equal(x, expected)
    assert quadruple.parallel is not quadruple
    assert quadruple.parallel.__wrapped__.__globals__["double"] is double.parallel


@pytest.mark.parametrize("size", [LARGE, LARGE - 1])
def test_threads_are_started_for_large_arrays_alone(monkeypatch, size):
    asked = []
    monkeypatch.setattr(
        jit, "numba_threads", lambda count: asked.append(count) or nullcontext(True)
    )
    monkeypatch.setattr(jit, "cores", lambda: 3)
    with kernel_threads():
        double(np.zeros(size))
        shift(np.zeros(size))
    double(np.zeros(size))
    assert asked == [3] * (size == LARGE)


def test_a_context_allows_no_more_than_the_one_around(monkeypatch):
    monkeypatch.setattr(jit, "cores", lambda: 8)
    assert allowed_threads() == 1
    with kernel_threads(3):
        with kernel_threads():
            assert allowed_threads() == 3
        with kernel_threads(2):
            assert allowed_threads() == 2
        assert allowed_threads() == 3
    assert allowed_threads() == 1


def test_several_threads_may_run_twins_at_once(monkeypatch):
    monkeypatch.setattr(jit, "cores", lambda: 2)

    def worked(n):
        x = np.full(LARGE, float(n))
        with kernel_threads():
            for _ in range(20):
                quadruple(x)
        return x[0] / 4.0**20, np.ptp(x)

    with ThreadPoolExecutor(4) as pool:
        assert list(pool.map(worked, range(4))) == [(float(n), 0.0) for n in range(4)]


def test_kernel_without_a_parallel_loop_has_no_twin():
    assert shift.parallel is shift


def test_no_garbage_is_collected_while_a_kernel_compiles():
    with event.trigger_event("numba:compile"):
        with event.trigger_event("numba:compile"):
            assert not gc.isenabled()
        assert not gc.isenabled()
    assert gc.isenabled()


@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
def test_ctrl_c_while_llvm_calls_python_interrupts_when_the_kernel_is_compiled():
    """Raised in such a call, an exception is printed and lost."""

    @jit.compiled
    def add(x):
        return x + 1.0

    def interrupted(module, buffer):
        signal.raise_signal(signal.SIGINT)
        calls.append(module)

    calls = []
    before = signal.getsignal(signal.SIGINT)
    codegen = cpu_target.target_context.codegen()
    library = codegen._library_class
    codegen._engine.set_object_cache(interrupted, library._object_getbuffer_hook)
    try:
        with pytest.raises(KeyboardInterrupt):
            add(1.0)
    finally:
        hooks = library._object_compiled_hook, library._object_getbuffer_hook
        codegen._engine.set_object_cache(*hooks)
    assert calls
    assert signal.getsignal(signal.SIGINT) is before
    assert add(1.0) == 2.0


@kernel
def positive(x):
    """x, which is to be positive."""
    if x < 0.0:
        raise ValueError("below 0:", x)
    return x


@kernel
def both_positive(x, y):
    """x + y."""
    return positive(x) + positive(y)


@kernel
def sum_of_roots(x, y):
    """The sum of two roots."""
    return np.sqrt(both_positive(x, y))


def test_a_chain_of_kernels_becomes_machine_code_once():
    codegen, made = cpu_target.target_context.codegen(), []
    library = codegen._library_class
    codegen._engine.set_object_cache(
        lambda module, code: made.append(module.name), library._object_getbuffer_hook
    )
    try:
        jit.compiled(sum_of_roots.__wrapped__)(4.0, 5.0)
    finally:
        hooks = library._object_compiled_hook, library._object_getbuffer_hook
        codegen._engine.set_object_cache(*hooks)
    assert {"positive", "both_positive", "sum_of_roots"}.intersection(made) == {"sum_of_roots"}


def test_what_a_kernel_of_a_kernel_raises_has_its_values():
    with pytest.raises(ValueError, match=r"below 0:.*-2\.0"):
        sum_of_roots(1.0, -2.0)
    assert sum_of_roots(4.0, 5.0) == 3.0


@kernel
def row_of(size, value):
    """A row of small numbers."""
    row = np.empty(size, np.int16)
    row[:] = value
    return row


@kernel
def three_rows(size):
    """The middle one of three rows."""
    first, last = row_of(size, 1), row_of(size, 3)
    between = np.empty(size, np.int16)
    for n in range(size):
        between[n] = (first[n] + last[n]) // 2
    return between


def test_constants_and_options_of_a_kernel_compile_nothing_anew():
    compiled = []

    class Listener(event.Listener):
        def on_start(self, started):
            compiled.append((started.data["dispatcher"].py_func.__qualname__, started.data["args"]))

        def on_end(self, ended):
            pass

    listener = Listener()
    event.register("numba:compile", listener)
    try:
        assert jit.compiled(three_rows.__wrapped__)(2).tolist() == [2, 2]
    finally:
        event.unregister("numba:compile", listener)
    assert len(row_of.inner.signatures) == 1
    assert sum("int16" in str(args) for name, args in compiled if "np_empty" in name) == 1


def test_context_is_left_after_an_error():
    with pytest.raises(RuntimeError), kernel_threads():
        raise RuntimeError("stop")
    assert allowed_threads() == 1
