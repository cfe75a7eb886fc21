"""The same answers, in the same order, whatever runs the tasks."""

from __future__ import annotations

import math
import pickle
import time
from concurrent.futures import ThreadPoolExecutor
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from flowborne.base.errors import SceneError
from flowborne.control import executors
from flowborne.control.executors import Foreign, Processes, Serial, Threads, mapper
from flowborne.kernels import jit
from flowborne.kernels.jit import allowed_threads, kernel_threads


class LikeDask:
    """Client whose futures know nothing but result and cancel; the last task ends first."""

    def submit(self, function: Any, task: Any) -> Any:
        return SimpleNamespace(result=lambda: function(task), cancel=lambda: None)


class MapOnly:
    """Pool with nothing but an ordered map."""

    def map(self, function: Any, tasks: Any) -> Any:
        return (function(task) for task in tasks)


def slow_first(task: int) -> int:
    time.sleep(0.02 if task == 0 else 0.0)
    return task * task


@pytest.mark.parametrize(
    "chosen", [Serial(), Threads(1), Threads(3), Foreign(LikeDask()), Foreign(MapOnly())]
)
def test_answers_come_in_the_order_of_the_tasks(chosen: executors.Mapper) -> None:
    assert chosen.map(slow_first, range(6)) == [0, 1, 4, 9, 16, 25]
    assert chosen.map(slow_first, []) == []
    chosen.close()
    assert chosen.map(slow_first, range(2)) == [0, 1]
    chosen.close()


def test_processes_answer_in_order() -> None:
    chosen, shared = Processes(2), np.arange(50_000.0)
    try:
        roots = chosen.map(math.sqrt, [4.0, 9.0, 16.0])
        sums = chosen.map(np.sum, [shared, shared[:2]])
    finally:
        chosen.close()
    assert roots == [2.0, 3.0, 4.0]
    assert sums == [shared.sum(), 1.0]


@pytest.mark.parametrize("chosen", [Serial(), Threads(2), Foreign(ThreadPoolExecutor(1))])
def test_an_exception_in_a_task_is_raised_here(chosen: executors.Mapper) -> None:
    with pytest.raises(ZeroDivisionError):
        chosen.map(lambda x: 1 // x, [1, 0, 2])
    chosen.close()


def test_pool_in_use_can_be_pickled() -> None:
    pool = Threads(2)
    pool.map(slow_first, [0, 1])
    restored = pickle.loads(pickle.dumps(pool))
    assert restored.workers == 2
    assert restored.map(slow_first, [3, 4]) == [9, 16]
    restored.close()
    pool.close()


def test_names_and_bad_names() -> None:
    assert isinstance(mapper("serial"), Serial)
    assert isinstance(mapper("threads", 3), Threads)
    assert mapper("processes", 2).workers == 2  # type: ignore[attr-defined]
    assert isinstance(mapper(LikeDask()), Foreign)
    with pytest.raises(SceneError, match="'cluster'"):
        mapper("cluster")
    with pytest.raises(SceneError, match="neither submit nor map"):
        mapper(3)
    with pytest.raises(ValueError, match="workers is 0"):
        Threads(0)


def test_evaluations_that_run_at_once_share_the_threads(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(jit, "cores", lambda: 8)
    pool = Threads(2)
    assert pool.map(threads_of, range(2)) == [1, 1]  # outside of any context
    with kernel_threads():
        assert pool.map(threads_of, range(1)) == [8]
        assert pool.map(threads_of, range(2)) == [4, 4]
        assert pool.map(threads_of, range(5)) == [4] * 5
        assert Threads(16).map(threads_of, range(16)) == [1] * 16
        with kernel_threads(2):
            assert pool.map(threads_of, range(2)) == [1, 1]
    pool.close()


def threads_of(task: int) -> int:
    return allowed_threads()
