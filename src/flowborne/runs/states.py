"""The files of states/: their arrays, read whole or lazily, and cell fields derived from them."""

from __future__ import annotations

import re
import zipfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from flowborne.base.given import check_file, read_arrays, said_of
from flowborne.fluid.grid import Grid
from flowborne.kernels.arrays import Array, Real, Single
from flowborne.runs.run_folder import RunFolder, RunFolderError, is_damage

IN_EVERY_STATE = "geom_position", "geom_rotation", "fluid_centre", "fluid_force"
"""Arrays of every state, which are needed to draw it."""

NUMBERS = "biuf"
"""Kinds of the NumPy types in a state."""

Arrays = Mapping[str, Real]


class Quantity(NamedTuple):
    """Meaning of an array of the states or of the history.

    dimensions  names of its axes in one state or frame
    unit        "1" without one, "" when it depends on an objective; in a slab forces are per metre
                of depth
    meaning     in a few words, "" when the name says it
    """

    dimensions: tuple[str, ...]
    unit: str
    meaning: str


QUANTITIES = {
    "time": Quantity((), "s", "time"),
    "grid_origin": Quantity(("axis",), "m", "lower corner of the grid"),
    "q": Quantity(("position_number",), "m, rad or 1", "generalised positions as MuJoCo has them"),
    "v": Quantity(("dof",), "m/s or rad/s", "generalised velocities as MuJoCo has them"),
    "geom_position": Quantity(("geom", "axis"), "m", "origin of each geometry"),
    "geom_rotation": Quantity(("geom", "row", "column"), "1", "geometry's frame to the world's"),
    "body_position": Quantity(("body", "axis"), "m", "origin of each body's frame"),
    "body_rotation": Quantity(("body", "row", "column"), "1", "body's frame to the world's"),
    "fluid_centre": Quantity(("body", "axis"), "m", "centroid of a body and its flesh"),
    "fluid_force": Quantity(
        ("body", "axis"),
        "N",
        "force of fluid and winds on a body, mean over the frame without the added-mass part",
    ),
    "flesh_vertices": Quantity(("vertex", "axis"), "m", "vertices on the skin of flesh"),
    "velocity_x": Quantity(("x_face", "y", "z"), "m/s", "velocity on the faces across x"),
    "velocity_y": Quantity(("x", "y_face", "z"), "m/s", "velocity on the faces across y"),
    "velocity_z": Quantity(("x", "y", "z_face"), "m/s", "velocity on the faces across z"),
    "pressure": Quantity(("x", "y", "z"), "Pa", "pressure in the cells"),
    "open": Quantity(("x", "y", "z"), "1", "part of each cell that no body takes up"),
}
"""The arrays of a state by name; `scalar_<dye>` are as `open`."""

DYE = re.compile(r"scalar_(.+)")


class StateArray:
    """One array of all states, read from the files lazily.

    `array[3]` and `array[-1]` are the array of one state; `array[2:9]` and `numpy.asarray(array)`
    stack those of several states along the first axis.

    quantity  meaning and unit
    shape     (n, ...), n the number of states
    dtype     of its numbers
    """

    def __init__(self, states: tuple[Path, ...], name: str, quantity: Quantity) -> None:
        self._states, self._name, self.quantity = states, name, quantity
        first = self._read(0)
        self.shape: tuple[int, ...] = (len(states), *first.shape)
        self.dtype = first.dtype

    def __len__(self) -> int:
        """Number of states."""
        return len(self._states)

    def __getitem__(self, number: int | slice) -> NDArray[Any]:
        """(...) of one state, or (k, ...) of a slice of states."""
        if isinstance(number, slice):
            chosen = range(len(self))[number]
            empty = np.empty((0, *self.shape[1:]), self.dtype)
            return np.stack([self._read(n) for n in chosen]) if chosen else empty
        return self._read(number)

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> NDArray[Any]:
        return self[:].astype(self.dtype if dtype is None else dtype, copy=False)

    def _read(self, number: int) -> NDArray[Any]:
        return read_state(self._states[number], (self._name,))[self._name]


def quantity(name: str) -> Quantity:
    """What an array of the states is."""
    if dye := DYE.fullmatch(name):
        return Quantity(("x", "y", "z"), "1", f"dye '{dye[1]}' in the cells")
    return QUANTITIES[name]


def read_state(path: Path, names: Sequence[str] | None = None) -> dict[str, NDArray[Any]]:
    """Arrays of a file of states/, all unless names are given.

    raises  RunFolderError when the file is missing or cut, has arrays without numbers, or lacks an
            array of IN_EVERY_STATE
    """
    try:
        arrays = read_arrays(path, names)
    except (OSError, ValueError) as error:
        raise _unreadable(path, error) from error
    for name, values in arrays.items():
        if values.dtype.kind not in NUMBERS:
            raise _unreadable(path, ValueError(f"its '{name}' holds no numbers"))
    _check_shapes(path, arrays)
    lacking = [] if names else [name for name in IN_EVERY_STATE if name not in arrays]
    if lacking:
        raise _unreadable(path, ValueError(f"it lacks {', '.join(lacking)}"))
    return arrays


def _check_shapes(path: Path, arrays: Arrays) -> None:
    """Raise RunFolderError unless arrays have their axes, with the same size along the same one."""
    sizes = {"axis": 3, "row": 3, "column": 3}
    for name, values in arrays.items():
        if name not in QUANTITIES:
            continue
        axes = QUANTITIES[name].dimensions
        shape = tuple(
            sizes.setdefault(axis, size) for axis, size in zip(axes, values.shape, strict=False)
        )
        if len(axes) != values.ndim or shape != values.shape:
            raise _unreadable(
                path,
                ValueError(f"its '{name}' has the shape {values.shape}, not ({', '.join(axes)})"),
            )


def check_states(folder: RunFolder, frame: int) -> None:
    """Raise RunFolderError when a state up to a frame is cut; missing states are allowed."""
    for path in folder.state_files():
        if int(path.stem) <= frame:
            try:
                check_file(path, None)
                zipfile.ZipFile(path).close()
            except (OSError, zipfile.BadZipFile) as error:
                raise _unreadable(path, error) from error


def _unreadable(path: Path, error: Exception) -> RunFolderError:
    remedy = "remove it, and films and exports go on without its frame"
    remedy = remedy if is_damage(error) else "make it readable"
    return RunFolderError(f"state {path} cannot be read ({said_of(error)}); {remedy}")


def cell_velocity(grid: Grid, state: Arrays) -> Single:
    """(nx, ny, nz, 3) mean of the faces, m/s; no z in a slab."""
    found = np.zeros((*grid.shape, 3), np.float32)
    for axis in grid.axes:
        faces = np.moveaxis(state[f"velocity_{'xyz'[axis]}"], axis, 0)
        found[..., axis] = np.moveaxis(0.5 * (faces[1:] + faces[:-1]), 0, axis)
    return found


def velocity_gradients(grid: Grid, state: Arrays) -> Array:
    """(3, 3, nx, ny, nz) derivative of each component of `cell_velocity` along each axis, 1/s.

    Central differences, one-sided at the sides; 0 along an axis of one cell.
    """
    velocity = np.moveaxis(cell_velocity(grid, state), -1, 0).astype(np.float64)
    found = np.zeros((3, 3, *grid.shape))
    for axis in range(3):
        if grid.shape[axis] > 1:
            found[:, axis] = np.gradient(velocity, grid.spacing, axis=1 + axis)
    return found


def cell_vorticity(grid: Grid, state: Arrays) -> Array:
    """(nx, ny, nz, 3) curl of `cell_velocity`, 1/s."""
    (_, uy, uz), (vx, _, vz), (wx, wy, _) = velocity_gradients(grid, state)
    return np.stack([wy - vz, uz - wx, vx - uy], axis=-1)
