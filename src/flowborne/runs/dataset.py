"""A run as an xarray data set that reads its states lazily."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import xarray
from numpy.typing import NDArray
from xarray.backends import BackendArray
from xarray.core import indexing

from flowborne.fluid.grid import Array, Grid
from flowborne.runs.states import Quantity, StateArray


class LazyStates(BackendArray):
    """A `StateArray` as a lazy array of xarray."""

    def __init__(self, array: StateArray) -> None:
        self._array = array
        self.shape, self.dtype = array.shape, array.dtype

    def __getitem__(self, key: Any) -> Any:
        return indexing.explicit_indexing_adapter(
            key, self.shape, indexing.IndexingSupport.BASIC, self._chosen
        )

    def _chosen(self, key: tuple[Any, ...]) -> NDArray[Any]:
        first, rest = key[0], key[1:]
        if isinstance(first, slice):
            return self._array[first][(slice(None), *rest)]
        return np.asarray(self._array[int(first)][rest])


def dataset_of(
    arrays: Mapping[str, StateArray],
    frames: Sequence[int],
    history: Mapping[str, tuple[Quantity, Array]],
    rows: NDArray[np.int64],
    bodies: Sequence[str],
    joints: Sequence[str],
    cells: Mapping[str, Any],
    about: Mapping[str, Any],
) -> xarray.Dataset:
    """The arrays of a run, see `OpenRun.dataset`.

    frames   frame number of each state
    history  name -> quantity of the history, and its values
    rows     (k,) frame of each of its rows
    bodies   names of the bodies
    joints   names of the joints
    cells    coordinates of cells and faces; none without a fluid
    about    attributes of the data set
    """
    variables = {name: _of_history(*array, rows, frames) for name, array in history.items()}
    for name, array in arrays.items():
        if name != "time":
            data = indexing.LazilyIndexedArray(LazyStates(array))
            meaning = {"units": array.quantity.unit, "long_name": array.quantity.meaning}
            variables[name] = xarray.Variable(("time", *array.quantity.dimensions), data, meaning)
    coordinates: dict[str, Any] = {
        "time": ("time", np.asarray(arrays["time"]), {"units": "s"}),
        "frame": ("time", np.array(frames)),
        "body": ("body", list(bodies)),
        "joint": ("joint", list(joints)),
        "axis": ("axis", list("xyz")),
        **cells,
    }
    return xarray.Dataset(variables, coordinates, about)


def _of_history(
    quantity: Quantity, known: Array, rows: NDArray[np.int64], frames: Sequence[int]
) -> xarray.Variable:
    """A quantity of the history at the times of the states, nan for states without a row."""
    values = np.full((len(frames), *known.shape[1:]), np.nan)
    _, here, there = np.intersect1d(np.array(frames), rows, return_indices=True)
    values[here] = known[there]
    about = {"units": quantity.unit, "long_name": quantity.meaning}
    return xarray.Variable(
        ("time", *quantity.dimensions), values, {key: text for key, text in about.items() if text}
    )


def cell_coordinates(grid: Grid, window_axes: Sequence[int] = ()) -> dict[str, Any]:
    """Coordinates of cells and faces along the axes that have them.

    window_axes  along which the grid moves: coordinates are offsets from its lower corner
    """
    found: dict[str, Any] = {}
    for axis, name in enumerate("xyz"):
        start, about = 0.0, {"units": "m"}
        if axis in window_axes:
            start, about["long_name"] = grid.origin[axis], "offset from grid_origin"
        found[name] = (name, grid.cell_coordinates()[axis] - start, about)
        if axis in grid.axes:
            face = f"{name}_face"
            found[face] = (face, grid.face_coordinates(axis)[axis] - start, about)
    return found
