"""A run folder read lazily: common data of all frames, and single frames on request."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from flowborne.base.arguments import INDEX, PATH, TEXT, read, takes
from flowborne.base.errors import SceneError
from flowborne.base.extras import optional
from flowborne.base.given import read_json
from flowborne.base.phrases import suggestion
from flowborne.fluid.grid import Grid
from flowborne.kernels.arrays import Array, Integers
from flowborne.runs.history import HistoryColumns, history_arrays, history_columns, read_history
from flowborne.runs.run_folder import RunFolder, RunFolderError, reading
from flowborne.runs.states import DYE, Arrays, StateArray, quantity, read_state

if TYPE_CHECKING:
    import xarray


class StoredRun:
    """The results of a run, with the attributes of `view.open_run.OpenRun`.

    raises  RunFolderError when it is not the folder of a run, or has no state yet
    """

    @takes(folder=PATH)
    def __init__(self, folder: str | Path) -> None:
        files = RunFolder.existing(Path(folder))
        self.folder = files.path
        self.tables = files.read_scene()
        with reading(self.folder):
            self._model: dict[str, Any] = read_json(files.model)
            self.name = str(self.tables.get("name", files.path.name))
            self.bodies: tuple[str, ...] = tuple(self._model["bodies"])
            self.joints: tuple[str, ...] = tuple(self._model["joints"])
            self.frames_per_second = float(self._model["frames_per_second"])
            self.is_slab = bool(self._model["slab"])
            self.grid = _grid(self._model["grid"])
            self._states = tuple(files.state_files())
        if not self._states:
            raise RunFolderError(f"{folder} has no frame yet; continue the run with resume=True")
        self.frames: Sequence[int] = tuple(int(path.stem) for path in self._states)

    def __len__(self) -> int:
        """Number of states: one per frame, and the start."""
        return len(self._states)

    @cached_property
    def dyes(self) -> tuple[str, ...]:
        found = (DYE.fullmatch(name) for name in self.state(0))
        return tuple(match[1] for match in found if match)

    @cached_property
    def skin(self) -> Integers | None:
        """(m, 3) triangles of the `flesh_vertices` of a state, outward; None without flesh."""
        entry = self._model.get("flesh")
        return None if entry is None else np.asarray(entry["triangles"], np.int64)

    @cached_property
    def history(self) -> HistoryColumns:
        """column -> (frames,) numbers of history.csv; the column name ends with the unit.

        raises  KeyError for an unknown column, with the one that was probably meant
        """
        with reading(self.folder):
            path = RunFolder(self.folder).history
            return read_history(path, history_columns(path))

    @cached_property
    def times(self) -> Array:
        """(n,) s of every state."""
        return self.every("time")

    @cached_property
    def arrays(self) -> Mapping[str, StateArray]:
        """Name -> array of all states, read lazily; see states.QUANTITIES for shapes and units."""
        names = read_state(self._states[0])
        return {name: StateArray(self._states, name, quantity(name)) for name in names}

    def state(self, number: int) -> dict[str, NDArray[Any]]:
        """Arrays of a state by name, in single precision; negative numbers count from the end.
        Raises SceneError for a number without a state.

        time, q, v, body_position (nb, 3), body_rotation (nb, 3, 3), geom_position, geom_rotation,
        fluid_force (nb, 3), flesh_vertices (k, 3); with a fluid, velocity_x, velocity_y, velocity_z
        on the faces, pressure, scalar_<dye>, and open, the part of each cell outside all bodies.
        """
        if not -len(self) <= read(INDEX, number, "number") < len(self):
            raise SceneError(f"{self.folder} has no state {number}; give 0 to {len(self) - 1}")
        return read_state(self._states[number])

    def grid_at(self, state: Arrays) -> Grid:
        """The grid in a state: where the window is then, if the domain follows bodies.

        raises  ValueError without a fluid
        """
        if self.grid is None:
            raise ValueError(f"{self.folder} has no grid, as its scene has no fluid")
        x, y, z = np.asarray(state.get("grid_origin", self.grid.origin)).tolist()
        return replace(self.grid, origin=(x, y, z))

    @property
    def window_axes(self) -> tuple[int, ...]:
        """Axes along which the domain follows bodies; none if it stays where it is."""
        domain = self.tables.get("domain", {})
        if self.grid is None or domain.get("follow", "nothing") == "nothing":
            return ()
        along = domain.get("along")
        return self.grid.axes if along is None else tuple(sorted({"xyz".index(a) for a in along}))

    def origins(self) -> Array:
        """(n, 3) m, lower corner of the grid in each state; see `grid_at`.

        raises  ValueError without a fluid
        """
        if self.window_axes:
            return self.every("grid_origin")
        return np.broadcast_to(self.grid_at({}).origin, (len(self), 3))

    @takes(name=TEXT)
    def every(self, name: str) -> Array:
        """(n, ...) one array of all states, such as "body_position".

        raises  KeyError when the states have no such array
        """
        if name not in self.arrays:
            end = suggestion(name, self.arrays, "They have")
            raise KeyError(f"the states have no '{name}'{end}")
        return np.asarray(self.arrays[name], float)

    def dataset(self) -> xarray.Dataset:
        """All arrays and the history as an xarray data set; states are read lazily.

        Each array has its dimensions, and its unit and meaning as attributes; times, bodies,
        joints, and positions of cells and faces are coordinates. Along an axis on which the domain
        follows bodies, these positions are offsets from `grid_origin`. The history gives `torque`,
        `force`, `power`, `angle`, `position`, `target_angle` and `target_position` of joints,
        `torque_xyz` and `force_xyz` of ball and free joints, `body_force` and so on of the bodies
        that the scene names, and other columns by their names without the unit. They are nan at the
        start, where the history has no row.
        raises  SceneError when xarray is not installed
        """
        library = optional("xarray", "xarray", "xarray", "data sets")
        from flowborne.runs.dataset import cell_coordinates, history_variable, state_variable

        rows = self.history["frame"].astype(np.int64)
        history = history_arrays(self.history, self.bodies, self.joints)
        variables = {n: history_variable(*array, rows, self.frames) for n, array in history.items()}
        variables |= {n: state_variable(array) for n, array in self.arrays.items() if n != "time"}
        coordinates: dict[str, Any] = {
            "time": ("time", self.times, {"units": "s"}),
            "frame": ("time", np.array(self.frames)),
            "body": ("body", list(self.bodies)),
            "joint": ("joint", list(self.joints)),
            "axis": ("axis", list("xyz")),
        }
        if self.grid is not None:
            coordinates |= cell_coordinates(self.grid, self.window_axes)
        rate = self.frames_per_second
        about = {"scene": self.name, "frames_per_second": rate, "slab": int(self.is_slab)}
        found: xarray.Dataset = library.Dataset(variables, coordinates, about)
        return found


def _grid(entry: dict[str, Any] | None) -> Grid | None:
    if entry is None:
        return None
    nx, ny, nz = entry["shape"]
    x, y, z = entry["origin"]
    return Grid((nx, ny, nz), float(entry["spacing"]), (x, y, z))
