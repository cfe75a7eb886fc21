"""Tasks in worker processes, one each at a time; a process that dies costs its task alone."""

from __future__ import annotations

import multiprocessing
import os
import signal
import sys
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import suppress
from typing import TypeVar

from threadpoolctl import threadpool_limits

Task = TypeVar("Task")
Answer = TypeVar("Answer")


class Worker:
    """A process that does one task after the other; a new one takes its place when it dies."""

    def __init__(self) -> None:
        self._pool = ProcessPoolExecutor(
            1, multiprocessing.get_context("spawn"), initializer=begin_worker
        )
        self._process = self._pool.submit(os.getpid)

    def submit(self, function: Callable[[Task], Answer], task: Task) -> Future[Answer]:
        """The answer to come; it raises BrokenProcessPool when the process dies on the way."""
        return self._pool.submit(function, task)

    def end(self) -> None:
        """End the process, what it is doing too."""
        with suppress(BrokenProcessPool, ProcessLookupError):
            os.kill(self._process.result(), signal.SIGTERM)
        self._pool.shutdown(cancel_futures=True)


def begin_worker() -> None:
    """Leave Ctrl-C to the parent, which ends its workers; small solves keep BLAS on one thread."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(1))
    threadpool_limits(limits=1, user_api="blas")


def side_by_side(
    function: Callable[[Task], Answer],
    tasks: Sequence[Task],
    workers: int,
    on_begin: Callable[[Task], None],
) -> Iterator[tuple[Task, Answer | None]]:
    """Do all tasks, so many at once, begun in their order; yields each as it ends.

    function  of a module that a new process can import; what it raises is raised here
    on_begin  called with every task as it begins
    yields    (task, its answer); None where the process died, killed or out of memory
    """
    waiting = deque(tasks)
    free = [Worker() for _ in range(min(workers, len(tasks)))]
    busy: dict[Future[Answer], tuple[Worker, Task]] = {}
    try:
        while waiting or busy:
            while waiting and free:
                worker, task = free.pop(), waiting.popleft()
                busy[worker.submit(function, task)] = worker, task
                on_begin(task)
            for future in wait(busy, return_when=FIRST_COMPLETED).done:
                worker, task = busy.pop(future)
                try:
                    answer = future.result()
                except BrokenProcessPool:
                    answer = None
                    worker.end()
                    worker = Worker()
                free.append(worker)
                yield task, answer
    finally:
        for worker in (*free, *(worker for worker, _ in busy.values())):
            worker.end()
