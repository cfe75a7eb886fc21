"""checkpoint.npz: the whole world in double precision, to go on from bit for bit."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from flowborne.coupling.world import Setup, World
from flowborne.io.arrays_file import read_arrays
from flowborne.io.atomic import write_atomically


def save_checkpoint(path: Path, world: World, frame: int) -> None:
    """Write the state after `frame` frames; an earlier checkpoint is replaced in one go.

    The file depends on the state and the frame alone: two runs that agree write the same bytes.
    Since the history has a row per frame, `frame` is also its length.
    """
    arrays = world.arrays()
    write_atomically(path, lambda file: np.savez(file, frame=np.int64(frame), **arrays))  # type: ignore[arg-type]


def load_checkpoint(path: Path, setup: Setup) -> tuple[World, int]:
    """World of `setup` as it was saved, and the number of frames that it had done.

    raises  ValueError when the file is not a checkpoint, or is one of another setup
    """
    try:
        arrays = read_arrays(path)
        frame = int(arrays.pop("frame"))
        world = World.from_arrays(setup, arrays)
    except (KeyError, OSError, TypeError, ValueError) as error:
        raise ValueError(f"{path} is not a checkpoint of this scene ({error})") from error
    return world, frame


def state_bytes(world: World) -> int:
    """Bytes of memory that one copy of the state takes."""
    return sum(values.nbytes for values in world.arrays().values())
