"""The frames of a film in order, drawn by one process per core. It runs as a process itself."""

from __future__ import annotations

import os
import pickle
import subprocess
import sys
from collections.abc import Generator, Sequence
from contextlib import closing
from time import perf_counter

import numpy as np

from flowborne.kernels.jit import cores as cores_here
from flowborne.view.pictures import Picture
from flowborne.view.run import Run
from flowborne.view.shot import Shot
from flowborne.view.style import Pixels

START_TIME = 4.0
"""Time that further processes take to start, s; they are used only if they save more."""

TIMED_FRAMES = 3
"""Frames drawn in this process before the time per frame is known; the first one fills caches."""


def drawn_frames(
    run: Run, shot: Shot, numbers: Sequence[int], cores: int | None = None
) -> Generator[Pixels, None, None]:
    """(height, width, 4) pictures of the states `numbers`, in order, each valid until the next.

    If it saves time, other processes draw them, each at most one frame ahead of the caller. They
    end when the generator is closed.

    cores   maximum number of processes; None is the number of cores available to this process
    raises  ValueError if the shot does not fit the run, or this machine cannot draw it
    """
    cores = cores_here() if cores is None else cores
    with closing(Picture(run, 1.0, shot)) as picture:
        for done, number in enumerate(numbers, start=1):
            start = perf_counter()
            frame = picture.draw(number)
            time_per_frame = perf_counter() - start
            yield frame
            saved = (len(numbers) - done) * time_per_frame * (1.0 - 1.0 / cores)
            if done >= TIMED_FRAMES and cores > 1 and saved > START_TIME:
                break
        else:
            return
    yield from _drawn_by_processes(run, shot, numbers[done:], frame.shape, cores)


def _drawn_by_processes(
    run: Run, shot: Shot, numbers: Sequence[int], shape: tuple[int, ...], cores: int
) -> Generator[Pixels, None, None]:
    """The same by `cores` processes, each of which draws every `cores`-th frame into a pipe."""
    paths = os.pathsep.join(path for path in sys.path if path)
    # one thread each for Mesa's software rasteriser and for BLAS
    single = {"LP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", "PYTHONPATH": paths}
    processes = []
    try:
        for first in range(cores):
            process = subprocess.Popen(
                [sys.executable, "-m", __spec__.name],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                env=os.environ | single,
                # Ctrl-C reaches the parent alone, which ends the others
                start_new_session=True,
            )
            processes.append(process)
            assert process.stdin is not None
            process.stdin.write(pickle.dumps((run, shot, list(numbers[first::cores]))))
            process.stdin.close()
        for index, number in enumerate(numbers):
            stream = processes[index % cores].stdout
            assert stream is not None
            frame = stream.read(int(np.prod(shape)))
            if len(frame) < np.prod(shape):
                raise ChildProcessError(f"drawing frame {number} failed")
            yield np.frombuffer(frame, np.uint8).reshape(shape)
    finally:
        for process in processes:
            process.kill()
            process.wait()
            for pipe in (process.stdin, process.stdout):
                assert pipe is not None
                pipe.close()


def _draw() -> None:
    """Draw frames into standard output; standard input has the pickled run, shot and numbers."""
    out = os.dup(sys.stdout.fileno())
    # output that a library prints must not end up between the frames
    os.dup2(sys.stderr.fileno(), sys.stdout.fileno())
    run, shot, numbers = pickle.load(sys.stdin.buffer)
    with open(out, "wb") as stream, closing(Picture(run, 1.0, shot)) as picture:
        for number in numbers:
            stream.write(picture.draw(number).tobytes())
            stream.flush()


if __name__ == "__main__":
    _draw()
