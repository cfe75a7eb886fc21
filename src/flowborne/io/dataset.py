"""A run as an xarray data set that reads its states when their numbers are asked for."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import xarray
from numpy.typing import NDArray
from xarray.backends import BackendArray
from xarray.core import indexing

from flowborne.io.open_run import StateArray

if TYPE_CHECKING:
    from flowborne.fluid.grid import Grid
    from flowborne.io.open_run import OpenRun


class LazyStates(BackendArray):
    """A `StateArray` as xarray asks for it."""

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


def dataset_of(run: OpenRun) -> xarray.Dataset:
    """All arrays of a run; see `OpenRun.dataset`."""
    variables = {}
    for name, array in run.arrays.items():
        if name != "time":
            data = indexing.LazilyIndexedArray(LazyStates(array))
            about = {"units": array.quantity.unit, "long_name": array.quantity.meaning}
            dimensions = ("time", *array.quantity.dimensions)
            variables[name] = xarray.Variable(dimensions, data, about)
    coordinates: dict[str, Any] = {
        "time": ("time", run.times, {"units": "s"}),
        "frame": ("time", np.array(run.frames)),
        "body": ("body", list(run.bodies)),
        "axis": ("axis", list("xyz")),
    }
    if run.grid is not None:
        coordinates |= _places(run.grid)
    whole: dict[str, Any] = {"scene": run.name, "frames_per_second": run.frames_per_second}
    return xarray.Dataset(variables, coordinates, whole | {"slab": int(run.is_slab)})


def _places(grid: Grid) -> dict[str, Any]:
    """Places of cells and faces along the axes on which there are some."""
    found: dict[str, Any] = {}
    for axis, name in enumerate("xyz"):
        found[name] = (name, grid.cell_coordinates()[axis], {"units": "m"})
        if axis in grid.axes:
            face = f"{name}_face"
            found[face] = (face, grid.face_coordinates(axis)[axis], {"units": "m"})
    return found
