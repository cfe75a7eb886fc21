"""Executors of the evaluations of a decision: serial, threads, processes, or a foreign one.

Each evaluation only depends on its own task, and results are in the order of the tasks, so that a
decision is the same, bit for bit, with any executor. Concurrent evaluations share the threads of
the caller's kernels. The interfaces are those of `concurrent.futures`.
"""

from __future__ import annotations

import math
import multiprocessing
import os
import signal
import threading
import time
from collections.abc import Callable, Sequence
from concurrent.futures import Executor, ProcessPoolExecutor, ThreadPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from functools import partial
from typing import Any, Protocol, TypeVar

from flowborne.base.errors import SceneError, WorkerError
from flowborne.kernels.jit import allowed_threads, cores, kernel_threads

Task = TypeVar("Task")
Answer = TypeVar("Answer")

GRACE = 10.0
"""Time between the signal that ends a process and its forced exit, s."""


class Mapper(Protocol):
    """Applies a function to every task."""

    def map(self, function: Callable[[Task], Answer], tasks: Sequence[Task]) -> list[Answer]:
        """Results in the order of the tasks; an exception in one is raised here."""
        ...

    def close(self) -> None:
        """Stop the workers, if it has any; a later `map` starts new ones."""
        return


class Serial(Mapper):
    """One evaluation after the other, in the calling thread."""

    def map(self, function: Callable[[Task], Answer], tasks: Sequence[Task]) -> list[Answer]:
        return [function(task) for task in tasks]


class Pool:
    """Workers of `concurrent.futures` that start at the first use and are not pickled.

    workers  number of workers; None is one per core
    raises   ValueError for fewer than one
    """

    def __init__(self, workers: int | None = None) -> None:
        self.workers = cores() if workers is None else workers
        if self.workers < 1:
            raise ValueError(f"number of workers is {workers}: give at least 1")
        self._executor: Executor | None = None
        self._process = 0

    def __reduce__(self) -> tuple[type[Pool], tuple[int]]:
        return type(self), (self.workers,)

    def share(self, tasks: int) -> int:
        """Number of threads for the kernels of each of some tasks."""
        return max(1, allowed_threads() // max(1, min(self.workers, tasks)))

    def executor(self, start: Callable[[], Executor]) -> Executor:
        """That of this process. A fork has no threads of the process that it is of: it starts its
        own."""
        if self._executor is None or self._process != os.getpid():
            self._executor, self._process = start(), os.getpid()
        return self._executor

    def close(self) -> None:
        """Stop the workers; a later `map` starts new ones."""
        if self._executor is not None and self._process == os.getpid():
            self._executor.shutdown()
        self._executor = None


class Threads(Pool):
    """Threads of this process: a physics step releases the interpreter lock."""

    def map(self, function: Callable[[Task], Answer], tasks: Sequence[Task]) -> list[Answer]:
        if self.workers == 1 or len(tasks) == 1:
            return [function(task) for task in tasks]
        start = partial(ThreadPoolExecutor, self.workers, "evaluation")
        on_share = partial(run_on, self.share(len(tasks)), function)
        return list(self.executor(start).map(on_share, tasks))


class Processes(Pool):
    """Other processes of this machine, spawned: a fork would not copy the threads.

    The tasks of a worker are pickled together, so that their common objects are sent once.
    The main script must guard its start by `__name__ == "__main__"`. If a worker dies, all are
    started again, once.
    """

    def map(self, function: Callable[[Task], Answer], tasks: Sequence[Task]) -> list[Answer]:
        try:
            return self._map(function, tasks)
        except BrokenProcessPool:
            self.close()
        try:
            return self._map(function, tasks)
        except BrokenProcessPool as error:
            self.close()
            raise WorkerError(
                f"of {self.workers} worker processes one died, and again after a new start: give "
                "fewer workers if memory is short, and guard the start of a script by "
                'if __name__ == "__main__"'
            ) from error

    def _map(self, function: Callable[[Task], Answer], tasks: Sequence[Task]) -> list[Answer]:
        spawn = multiprocessing.get_context("spawn")
        start = partial(ProcessPoolExecutor, self.workers, spawn, end_with_parent)
        size = max(math.ceil(len(tasks) / self.workers), 1)
        on_share = partial(run_on, self.share(math.ceil(len(tasks) / size)), function)
        return list(self.executor(start).map(on_share, tasks, chunksize=size))


class Foreign(Mapper):
    """Any object with `submit` (giving futures with `result`) or else an ordered `map`.

    For example an executor of `concurrent.futures` or mpi4py, or a client of `dask.distributed`;
    its owner closes it.

    raises  SceneError if the object has neither
    """

    def __init__(self, executor: Any) -> None:
        if not (hasattr(executor, "submit") or hasattr(executor, "map")):
            raise SceneError(
                f"executor {executor!r} has neither submit nor map: give 'serial', 'threads', "
                "'processes' or an object like concurrent.futures.Executor"
            )
        self.executor = executor

    def map(self, function: Callable[[Task], Answer], tasks: Sequence[Task]) -> list[Answer]:
        if not hasattr(self.executor, "submit"):
            return list(self.executor.map(function, tasks))
        futures = [self.executor.submit(function, task) for task in tasks]
        try:
            return [future.result() for future in futures]
        except BaseException:
            for future in futures:
                future.cancel()
            raise


def mapper(executor: str | object = "threads", workers: int | None = None) -> Mapper:
    """The mapper of a name, or one for any executor.

    executor  "serial", "threads", "processes", or an object with `submit` or `map`
    workers   for threads and processes; None is one per core
    raises    SceneError for another name or object
    """
    if not isinstance(executor, str):
        return Foreign(executor)
    if executor == "serial":
        return Serial()
    if executor == "threads":
        return Threads(workers)
    if executor == "processes":
        return Processes(workers)
    raise SceneError(
        f"executor is {executor!r}: give 'serial', 'threads', 'processes' or an executor object"
    )


def run_on(threads: int, function: Callable[[Task], Answer], task: Task) -> Answer:
    """Apply the function to a task, with a limit on the threads of its kernels."""
    with kernel_threads(threads):
        return function(task)


def end_with_parent() -> None:
    """Make this child process of multiprocessing end after its parent.

    A worker that waits for work would otherwise wait for ever: it holds both ends of the queue.
    """
    threading.Thread(target=_outlive_no_parent, daemon=True).start()


def _outlive_no_parent() -> None:
    parent = multiprocessing.parent_process()
    assert parent is not None, "this process is not a worker"
    parent.join()
    os.kill(os.getpid(), signal.SIGTERM)
    time.sleep(GRACE)
    os._exit(1)
