"""Arrays of a run as variables of xarray, which read the states lazily."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import xarray
from numpy.typing import NDArray
from xarray.backends import BackendArray
from xarray.core import indexing

from flowborne.fluid.grid import Grid
from flowborne.kernels.arrays import Array, Integers
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


def state_variable(array: StateArray) -> xarray.Variable:
    """An array of the states with its unit and meaning, read lazily."""
    data = indexing.LazilyIndexedArray(LazyStates(array))
    about = {"units": array.quantity.unit, "long_name": array.quantity.meaning}
    return xarray.Variable(("time", *array.quantity.dimensions), data, about)


def history_variable(
    quantity: Quantity, known: Array, rows: Integers, frames: Sequence[int]
) -> xarray.Variable:
    """A quantity of the history at the times of the states, nan for states without a row."""
    values = np.full((len(frames), *known.shape[1:]), np.nan)
    _, here, there = np.intersect1d(np.array(frames), rows, return_indices=True)
    values[here] = known[there]
    about = {"units": quantity.unit, "long_name": quantity.meaning}
    return xarray.Variable(
        ("time", *quantity.dimensions), values, {key: text for key, text in about.items() if text}
    )


def cell_coordinates(grid: Grid, window_axes: Sequence[int]) -> dict[str, Any]:
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
