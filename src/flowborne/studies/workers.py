"""Workers that run members: processes of this machine, or those of a Dask cluster."""

from __future__ import annotations

import multiprocessing
import signal
from collections import deque
from collections.abc import Iterator, Mapping
from concurrent.futures import (
    FIRST_COMPLETED,
    CancelledError,
    Executor,
    Future,
    ProcessPoolExecutor,
    wait,
)
from concurrent.futures.process import BrokenProcessPool
from typing import Any

from flowborne.base.errors import SceneError, said_by
from flowborne.base.extras import optional
from flowborne.kernels.jit import cores
from flowborne.machine import end_with_parent
from flowborne.studies.members import FAILED, Ended, run_member

Task = tuple[str, Mapping[str, str]]
"""Scene and settings of a member."""

Done = tuple[str, Ended, bytes]
"""Name of a member, how it ended, its history."""

DIED = "the process of this run died; perhaps memory was short"

IN_FLIGHT = 1000
"""Most members at once in a cluster whose number of workers is not limited."""

CONNECT_SECONDS = 10


def begin_worker() -> None:
    """Initialise a worker process: it ends with its parent, and Ctrl-C is for the parent alone."""
    end_with_parent()
    signal.signal(signal.SIGINT, signal.SIG_IGN)


class Workers:
    """Processes of this machine, spawned when the first member is run.

    workers  number of members at once; None is one per core
    raises   SceneError for fewer than one
    """

    def __init__(self, workers: int | None = None) -> None:
        if workers is not None and workers < 1:
            raise SceneError(f"workers is {workers}. Give 1 or more.")
        self.most = cores() if workers is None else workers
        self.threads = max(1, cores() // self.most)
        self._executor: Executor | None = None
        self._others: set[Any] = set()

    def done(self, tasks: Mapping[str, Task]) -> Iterator[Done]:
        """Run members, and give each when it has ended, in no particular order.

        raises  KeyboardInterrupt when a worker was interrupted
        """
        waiting, suspects = deque(tasks), list[str]()
        running: dict[Future[Any], str] = {}
        while waiting or running:
            while waiting and not suspects and len(running) < self.most:
                name = waiting.popleft()
                running[self._submit(tasks[name])] = name
            for future in wait(running, return_when=FIRST_COMPLETED).done:
                name = running.pop(future)
                try:
                    yield (name, *self._result(future))
                except BrokenProcessPool:
                    suspects.append(name)
            if suspects and not running:
                yield from self._one_by_one(suspects, tasks)
                suspects.clear()

    def _one_by_one(self, names: list[str], tasks: Mapping[str, Task]) -> Iterator[Done]:
        """Members that ran when a process died, each alone, which shows whose fault it was."""
        self.close()
        for name in names:
            try:
                yield (name, *self._result(self._submit(tasks[name])))
            except BrokenProcessPool:
                self.close()
                yield name, Ended(FAILED, DIED), b""

    def _submit(self, task: Task) -> Future[Any]:
        try:
            return self._start().submit(run_member, *task, self.threads)
        except BrokenProcessPool as error:
            broken: Future[Any] = Future()
            broken.set_exception(error)
            return broken

    def _start(self) -> Executor:
        if self._executor is None:
            self._others = set(multiprocessing.active_children())
            self._executor = ProcessPoolExecutor(
                self.most, mp_context=multiprocessing.get_context("spawn"), initializer=begin_worker
            )
        return self._executor

    def _result(self, future: Future[Any]) -> tuple[Ended, bytes]:
        found: tuple[Ended, bytes] | None = future.result()
        if found is None:
            raise KeyboardInterrupt
        return found

    def close(self) -> None:
        """Stop the workers; members that have not ended are given up."""
        if self._executor is not None:
            for process in set(multiprocessing.active_children()) - self._others:
                process.terminate()
            self._executor.shutdown(cancel_futures=True)
            self._executor = None


class DaskWorkers(Workers):
    """The workers of a Dask cluster, which may come and go.

    address  of its scheduler
    workers  most members at once; None is no limit
    raises   SceneError when distributed is not installed, or no scheduler answers
    """

    def __init__(self, address: str, workers: int | None = None) -> None:
        super().__init__(workers)
        self._distributed = optional("distributed", "Dask", "study", "studies on a cluster", "run")
        self.most = IN_FLIGHT if workers is None else workers
        self.threads = 1
        try:
            self._client = self._distributed.Client(address, timeout=CONNECT_SECONDS)
        except (OSError, TimeoutError, ValueError) as error:
            raise SceneError(
                f"no Dask scheduler answers at {address} ({said_by(error)}). Start one with: "
                "dask scheduler"
            ) from error

    def _start(self) -> Executor:
        if self._executor is None:
            self._executor = self._client.get_executor(pure=False)
        return self._executor

    def _result(self, future: Future[Any]) -> tuple[Ended, bytes]:
        try:
            return super()._result(future)
        except self._distributed.KilledWorker:
            return Ended(FAILED, DIED), b""
        except (CancelledError, OSError) as error:
            raise SceneError(
                "the Dask cluster was lost. Finished runs are kept; start a cluster, and give the "
                "same command with its address."
            ) from error
        except Exception as error:
            raise SceneError(
                f"the Dask workers cannot run flowborne ({said_by(error)}). Give them the same "
                "Python environment."
            ) from error

    def close(self) -> None:
        self._client.close()
