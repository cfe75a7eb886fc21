"""checkpoint.npz: the whole world in double precision, for a bit-identical resume."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flowborne.base.atomic import write_atomically
from flowborne.base.given import FileError, read_arrays
from flowborne.coupling.world import Setup, World
from flowborne.fluid.state import under
from flowborne.solids.sensed import Sensed

SENSED = "sensed/"
"""Beginning of the names of arrays that say what bodies and joints felt."""


def save_checkpoint(path: Path, world: World, frame: int, sensed: Sensed | None = None) -> None:
    """Write the state after `frame` frames; an earlier checkpoint is replaced atomically.

    The file depends only on the state and the frame: equal runs write equal bytes. The history has
    a row per frame, so `frame` is also its length.
    """
    arrays = world.arrays()
    if sensed is not None:
        arrays |= {f"{SENSED}{name}": values for name, values in sensed.arrays().items()}
    write_atomically(path, lambda file: np.savez(file, frame=np.int64(frame), **arrays))  # type: ignore[arg-type]


def load_checkpoint(
    path: Path, setup: Setup, memory: Mapping[str, tuple[int, ...]] | None = None
) -> tuple[World, int, Sensed | None]:
    """The saved world of `setup`, its number of frames, and what its bodies and joints felt.

    memory  shapes of the controller's arrays; none without a controller
    raises  ValueError when the file is not a checkpoint, or belongs to another setup; OSError when
            it cannot be read
    """
    try:
        arrays = read_arrays(path)
        frame = arrays.pop("frame")
        if frame.dtype != np.int64 or frame.shape != () or frame < 0:
            raise ValueError("its 'frame' is no number of frames")
        _check_arrays(arrays, setup, memory or {})
        world, felt = World.from_arrays(setup, arrays), under(SENSED, arrays)
        kept = Sensed.from_arrays(setup.solid, world.solid.q, felt) if felt else None
    except KeyError as error:
        raise ValueError(f"{path} is not a checkpoint of this scene (it lacks {error})") from error
    except (FileError, TypeError, ValueError) as error:
        raise ValueError(f"{path} is not a checkpoint of this scene ({error})") from error
    return world, int(frame), kept


def _check_arrays(
    arrays: Mapping[str, NDArray[Any]], setup: Setup, memory: Mapping[str, tuple[int, ...]]
) -> None:
    """Raise KeyError or ValueError unless these are the arrays of a world of `setup`."""
    at_rest = World.at_rest(setup).arrays()
    for name, like in at_rest.items():
        shapes = {like.shape}
        if setup.fluid is not None and like.size == 0:  # the first step fills it
            shapes |= {setup.fluid.grid.shape, (setup.solid.nq,), (3,)}
        _check_array(name, arrays[name], shapes, like.dtype)
    for own, shape in memory.items():
        name = f"memory/{own}"
        if name in arrays:
            _check_array(name, arrays[name], {shape}, np.dtype(np.float64))


def _check_array(
    name: str, found: NDArray[Any], shapes: set[tuple[int, ...]], dtype: np.dtype[Any]
) -> None:
    if found.shape not in shapes or found.dtype != dtype:
        wanted = " or ".join(str(list(shape)) for shape in sorted(shapes))
        raise ValueError(
            f"its '{name}' is {list(found.shape)} of {found.dtype} in place of {wanted} of {dtype}"
        )
    if not np.isfinite(found).all():
        raise ValueError(f"its '{name}' has a number that is not finite")


def state_bytes(world: World) -> int:
    """Bytes of one copy of the state."""
    return sum(values.nbytes for values in world.arrays().values())
