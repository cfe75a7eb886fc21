"""A run folder opened for reading: what holds for all frames at once, and frames as asked for."""

from __future__ import annotations

import json
import re
import tomllib
from collections.abc import Mapping
from functools import cached_property
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from flowborne.fluid.grid import Grid
from flowborne.io.history import history_columns, history_rows
from flowborne.io.optional import optional
from flowborne.io.run_folder import STATE_NAME, RunFolder, RunFolderError

if TYPE_CHECKING:
    import xarray

Array = NDArray[np.float64]


class Quantity(NamedTuple):
    """What an array of the states is.

    dimensions  names of its axes in one state
    unit        "1" where it has none; in a slab forces are per metre of depth
    meaning     in a few words
    """

    dimensions: tuple[str, ...]
    unit: str
    meaning: str


QUANTITIES = {
    "time": Quantity((), "s", "time"),
    "q": Quantity(("position_number",), "m, rad or 1", "generalised positions as MuJoCo has them"),
    "v": Quantity(("dof",), "m/s or rad/s", "generalised velocities as MuJoCo has them"),
    "geom_position": Quantity(("geom", "axis"), "m", "origin of each geometry"),
    "geom_rotation": Quantity(("geom", "row", "column"), "1", "geometry's frame to the world's"),
    "body_position": Quantity(("body", "axis"), "m", "origin of each body's frame"),
    "body_rotation": Quantity(("body", "row", "column"), "1", "body's frame to the world's"),
    "fluid_centre": Quantity(("body", "axis"), "m", "centroid of a body and its flesh"),
    "fluid_force": Quantity(("body", "axis"), "N", "force of fluid and winds on a body"),
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
    """One array of all states, read from the files as it is asked for.

    `array[3]` and `array[-1]` are those of one state; `array[2:9]` and `numpy.asarray(array)` those
    of several, one after the other along the first axis.

    quantity  what it is, in which unit
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
        """(...) of one state, or (k, ...) of a slice of them."""
        if isinstance(number, slice):
            chosen = range(len(self))[number]
            empty = np.empty((0, *self.shape[1:]), self.dtype)
            return np.stack([self._read(n) for n in chosen]) if chosen else empty
        return self._read(number)

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> NDArray[Any]:
        return self[:].astype(self.dtype if dtype is None else dtype, copy=False)

    def _read(self, number: int) -> NDArray[Any]:
        with np.load(self._states[number]) as file:
            return np.asarray(file[self._name])


class OpenRun:
    """What a run has left behind, read lazily and in its own units (SI, radians).

    folder  of the run
    raises  RunFolderError when it is none, or has no state yet

    scene              the scene as run: its file as nested dictionaries
    name               of the scene
    bodies             names of the bodies, the world's first
    joints             names of the joints
    dyes               names of the dyes
    frames             number of the frame of each state, 0 for the start
    frames_per_second  of the run
    """

    def __init__(self, folder: str | Path) -> None:
        files = RunFolder.existing(Path(folder))
        self.folder = files.path
        self._files = files
        try:
            self.scene: dict[str, Any] = tomllib.loads(files.scene.read_text(encoding="utf-8"))
            self._model = json.loads(files.model.read_text(encoding="utf-8"))
            names = sorted(p.name for p in files.states.iterdir() if STATE_NAME.fullmatch(p.name))
        except (OSError, ValueError) as error:
            raise RunFolderError(
                f"{folder} cannot be read ({error}); start the run again with --replace"
            ) from error
        if not names:
            raise RunFolderError(f"{folder} has no frame yet; let the run go on with --resume")
        self._states = tuple(files.states / name for name in names)
        self.name = str(self.scene.get("name", files.path.name))
        self.bodies: tuple[str, ...] = tuple(self._model["bodies"])
        self.joints: tuple[str, ...] = tuple(self._model["joints"])
        self.frames = tuple(int(path.stem) for path in self._states)
        self.frames_per_second = float(self._model["frames_per_second"])

    def __len__(self) -> int:
        """Number of states: that of the frames, and the start."""
        return len(self._states)

    @property
    def is_slab(self) -> bool:
        """Whether it is a run in two dimensions, in which forces are per metre of depth."""
        return bool(self._model["slab"])

    @property
    def dyes(self) -> tuple[str, ...]:
        found = (DYE.fullmatch(name) for name in self.arrays)
        return tuple(match[1] for match in found if match)

    @cached_property
    def grid(self) -> Grid | None:
        """The fluid's grid; None without a fluid."""
        entry = self._model["grid"]
        if entry is None:
            return None
        nx, ny, nz = entry["shape"]
        x, y, z = entry["origin"]
        return Grid((nx, ny, nz), float(entry["spacing"]), (x, y, z))

    @cached_property
    def skin(self) -> NDArray[np.int64] | None:
        """(m, 3) triangles of the `flesh_vertices` of a state, outward; None without flesh."""
        entry = self._model.get("flesh")
        return None if entry is None else np.asarray(entry["triangles"], np.int64)

    @cached_property
    def history(self) -> dict[str, Array]:
        """column -> (frames,) numbers, as history.csv has them; the unit ends the name."""
        columns = list(history_columns(self._files.history))
        rows = np.array(list(history_rows(self._files.history, columns)), float)
        return dict(zip(columns, rows.reshape(-1, len(columns)).T, strict=True))

    @cached_property
    def times(self) -> Array:
        """(n,) s of every state."""
        return self.every("time")

    @cached_property
    def arrays(self) -> Mapping[str, StateArray]:
        """Name -> array of all states, lazily; see QUANTITIES for shapes and units."""
        with np.load(self._states[0]) as file:
            names = tuple(file.files)
        return MappingProxyType(
            {name: StateArray(self._states, name, quantity(name)) for name in names}
        )

    def state(self, number: int) -> dict[str, NDArray[Any]]:
        """Arrays of a state by name, in single precision; negative numbers count from the end.

        time, q, v, body_position (nb, 3), body_rotation (nb, 3, 3), geom_position, geom_rotation,
        fluid_force (nb, 3), flesh_vertices (k, 3); of the fluid velocity_x, velocity_y, velocity_z
        on the faces, pressure, scalar_<dye>, and open, the part of each cell that no body takes up.
        """
        with np.load(self._states[number]) as file:
            return {name: file[name] for name in file.files}

    def every(self, name: str) -> Array:
        """(n, ...) one array of all states, such as "body_position".

        raises  KeyError when the states have none of that name
        """
        return np.asarray(self.arrays[name], float)

    def dataset(self) -> xarray.Dataset:
        """All arrays as an xarray data set, which reads a state when its numbers are asked for.

        Each has its dimensions, and its unit and meaning as attributes; times, bodies, and places
        of cells and faces are coordinates.
        raises  SceneError when xarray is not installed
        """
        optional("xarray", "xarray", "xarray", "data sets")
        from flowborne.io.dataset import dataset_of

        return dataset_of(self)


def open_run(folder: str | Path) -> OpenRun:
    """What a run has left behind: times, poses, skin of flesh, fields and history, read lazily.

    folder  of a run, which may still be going on
    raises  RunFolderError when it is none, or has no state yet
    """
    return OpenRun(folder)


def quantity(name: str) -> Quantity:
    """What an array of the states is."""
    if dye := DYE.fullmatch(name):
        return Quantity(("x", "y", "z"), "1", f"dye '{dye[1]}' in the cells")
    return QUANTITIES[name]
