"""One simulation in two threads, and in forks of its process."""

import copy
import os
import pickle
import threading
import time

import numpy as np
import pytest
from numba import prange

from flowborne.control.executors import Processes, Threads
from flowborne.kernels.jit import LARGE, kernel, kernel_threads, numba_layer
from flowborne.sim.simulation import Simulation

PATIENCE = 60.0
"""Longest time for a fork, s."""


def in_fork(action):
    """Exit code of a fork in which an action returns True; None if it hangs."""
    child = os.fork()
    if child == 0:
        try:
            os._exit(0 if action() is True else 1)
        finally:
            os._exit(2)
    end = time.monotonic() + PATIENCE
    while time.monotonic() < end:
        done, status = os.waitpid(child, os.WNOHANG)
        if done:
            return os.waitstatus_to_exitcode(status)
        time.sleep(0.01)
    os.kill(child, 9)
    os.waitpid(child, 0)
    return None


def bits(simulation):
    return {name: values.tobytes() for name, values in simulation.world.arrays().items()}


def test_a_second_thread_gets_an_error_and_no_frame_is_lost(small_scene, monkeypatch):
    with Simulation(small_scene, workers=1) as simulation, Simulation(small_scene) as alone:
        inside, go_on, frames = threading.Event(), threading.Event(), []
        advance = Simulation._advance

        def wait(*given):
            inside.set()
            assert go_on.wait(PATIENCE)
            return advance(*given)

        monkeypatch.setattr(Simulation, "_advance", wait)
        other = threading.Thread(target=lambda: frames.append(simulation.advance_frame().frame))
        other.start()
        assert inside.wait(PATIENCE)
        with pytest.raises(RuntimeError, match="is being advanced already, by another thread"):
            simulation.advance_frame()
        go_on.set()
        other.join()
        assert (frames, simulation.frame) == ([1], 1)
        assert simulation.advance_frame().frame == alone.advance_frame().frame + 1 == 2
        alone.advance_frame()
        assert bits(simulation) == bits(alone)


def test_a_copy_is_advanced_on_its_own(small_scene):
    with Simulation(small_scene, workers=1) as simulation:
        with simulation._turn:
            assert copy.deepcopy(simulation).advance_frame().frame == 1
        assert simulation.frame == 0


def test_a_simulation_is_not_pickled(small_scene):
    with (
        Simulation(small_scene, workers=1) as simulation,
        pytest.raises(TypeError, match="give the other process its scene"),
    ):
        pickle.dumps(simulation)


def test_a_fork_advances_to_the_same_bits(small_scene):
    with Simulation(small_scene, workers=2) as simulation:
        simulation.advance_frame()
        before = simulation.snapshot()
        simulation.advance_frame()
        expected = bits(simulation)
        simulation.restore(before)

        def same():
            with simulation:
                simulation.advance_frame()
                return bits(simulation) == expected

        assert in_fork(same) == 0
        simulation.advance_frame()
        assert bits(simulation) == expected


@pytest.mark.parametrize("pool", [Threads, Processes])
def test_workers_of_a_fork_are_its_own(pool):
    workers = pool(2)
    try:
        assert workers.map(abs, [-1, -2]) == [1, 2]
        assert in_fork(lambda: workers.map(abs, [-3, -4]) == [3, 4] and not workers.close()) == 0
        assert in_fork(lambda: workers.close() is None) == 0
        assert workers.map(abs, [-5, -6]) == [5, 6]
    finally:
        workers.close()


@kernel
def doubled(x):
    """x *= 2."""
    for n in prange(x.size):
        x[n] *= 2.0


def test_a_fork_runs_large_kernels_too():
    """GNU's OpenMP ends a fork that uses threads which the process of it has started."""
    values = np.arange(LARGE, dtype=float)
    with kernel_threads(2):
        doubled(values)
        assert numba_layer()

        def again():
            doubled(values)
            return np.array_equal(values, 4.0 * np.arange(LARGE))

        assert in_fork(again) == 0
        doubled(values)
    assert np.array_equal(values, 4.0 * np.arange(LARGE))
