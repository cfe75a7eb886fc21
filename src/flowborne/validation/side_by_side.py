"""Tasks in worker processes, one each at a time; a process that dies costs its task alone."""

from __future__ import annotations

import multiprocessing
import signal
import sys
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from multiprocessing.connection import Connection, wait
from typing import Any, TypeVar

from threadpoolctl import threadpool_limits

from flowborne.machine import GRACE, end_with_parent

Task = TypeVar("Task")
Answer = TypeVar("Answer")


class DiedError(Exception):
    """The process died on the way, killed or out of memory."""


class Worker:
    """A process that does one task after the other, and ends with its parent."""

    def __init__(self) -> None:
        spawned = multiprocessing.get_context("spawn")
        self.pipe, theirs = spawned.Pipe()
        self._process = spawned.Process(target=serve, args=(theirs,))
        self._process.start()
        theirs.close()

    def begin(self, function: Callable[[Any], Any], task: object) -> None:
        """Let it do a task; `pipe` can be read when that has ended."""
        try:
            self.pipe.send((function, task))
        except BrokenPipeError:
            return  # it has died, which `answer` finds

    def answer(self) -> Any:
        """What the task gave. Raises what it raised, and DiedError when the process died on it."""
        try:
            answer, error = self.pipe.recv()
        except (EOFError, ConnectionResetError):
            raise DiedError from None
        if error is not None:
            raise error
        return answer

    def end(self) -> None:
        """End the process, what it is doing too."""
        self._process.terminate()
        self._process.join(GRACE)
        self._process.kill()
        self._process.join()
        self.pipe.close()


def serve(pipe: Connection) -> None:
    """What a worker does; small solves keep BLAS on one thread, and Ctrl-C is the parent's."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(1))
    end_with_parent()
    threadpool_limits(limits=1, user_api="blas")
    while True:
        try:
            function, task = pipe.recv()
        except EOFError:
            return
        try:
            pipe.send((function(task), None))
        except Exception as error:
            pipe.send((None, error))


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
    busy: dict[Any, tuple[Worker, Task]] = {}
    try:
        while waiting or busy:
            while waiting and free:
                worker, task = free.pop(), waiting.popleft()
                worker.begin(function, task)
                busy[worker.pipe] = worker, task
                on_begin(task)
            for pipe in wait(list(busy)):
                worker, task = busy[pipe]
                answer: Answer | None = None
                try:
                    answer = worker.answer()
                    free.append(worker)
                except DiedError:
                    worker.end()
                    free.append(Worker())
                del busy[pipe]
                yield task, answer
    finally:
        for worker in (*free, *(worker for worker, _ in busy.values())):
            worker.end()
