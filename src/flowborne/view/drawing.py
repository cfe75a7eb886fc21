"""The frames of a film one after the other, drawn by as many processes as there are cores."""

from __future__ import annotations

import os
import pickle
import subprocess
import sys
from collections.abc import Generator, Sequence
from contextlib import closing
from time import perf_counter

import numpy as np
from numpy.typing import NDArray

from flowborne.kernels.jit import cores as cores_here
from flowborne.view.pictures import Picture
from flowborne.view.run import Run
from flowborne.view.shot import Shot

Pixels = NDArray[np.uint8]

STARTING = 4.0
"""s that further processes take to start: where less is left to draw, they do not pay."""

TRIED = 3
"""Frames drawn here before that is known; the first one also fills caches."""


def drawn_frames(
    run: Run, shot: Shot, numbers: Sequence[int], cores: int | None = None
) -> Generator[Pixels, None, None]:
    """(height, width, 4) pictures of the states `numbers`, in order, each valid until the next.

    Where it pays, other processes draw them, at most one frame each ahead of what is asked for.
    They end when the generator is closed.

    cores   processes at most; as many as this one may run on when None
    raises  ValueError when the shot does not suit the run, or nothing can draw it here
    """
    cores = cores_here() if cores is None else cores
    with closing(Picture(run, 1.0, shot)) as picture:
        for done, number in enumerate(numbers, start=1):
            began = perf_counter()
            frame = picture.draw(number)
            spent = perf_counter() - began
            yield frame
            left = (len(numbers) - done) * spent
            if done >= TRIED and cores > 1 and left * (1.0 - 1.0 / cores) > STARTING:
                break
        else:
            return
    yield from _drawn_elsewhere(run, shot, numbers[done:], frame.shape, cores)


def _drawn_elsewhere(
    run: Run, shot: Shot, numbers: Sequence[int], shape: tuple[int, ...], cores: int
) -> Generator[Pixels, None, None]:
    """The same by `cores` processes, each of which draws every `cores`-th frame into a pipe."""
    paths = os.pathsep.join(path for path in sys.path if path)
    # the rasteriser of a machine without a graphics card has threads of its own, and so has BLAS
    single = {"LP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", "PYTHONPATH": paths}
    artists = []
    try:
        for first in range(cores):
            artist = subprocess.Popen(
                [sys.executable, "-m", __spec__.name],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                env=os.environ | single,
                # Ctrl-C is for the process that asked, which ends the others
                start_new_session=True,
            )
            artists.append(artist)
            assert artist.stdin is not None
            artist.stdin.write(pickle.dumps((run, shot, list(numbers[first::cores]))))
            artist.stdin.close()
        for place in range(len(numbers)):
            stream = artists[place % cores].stdout
            assert stream is not None
            frame = stream.read(int(np.prod(shape)))
            if len(frame) < np.prod(shape):
                raise ChildProcessError(f"drawing frame {numbers[place]} failed")
            yield np.frombuffer(frame, np.uint8).reshape(shape)
    finally:
        for artist in artists:
            artist.kill()
            artist.wait()
            for pipe in (artist.stdin, artist.stdout):
                assert pipe is not None
                pipe.close()


def _draw() -> None:
    """Draw into standard output what standard input asks for."""
    out = os.dup(sys.stdout.fileno())
    # whatever a library prints must not get between the frames
    os.dup2(sys.stderr.fileno(), sys.stdout.fileno())
    run, shot, numbers = pickle.load(sys.stdin.buffer)
    with open(out, "wb") as stream, closing(Picture(run, 1.0, shot)) as picture:
        for number in numbers:
            stream.write(picture.draw(number).tobytes())
            stream.flush()


if __name__ == "__main__":
    _draw()
