"""A flow on one grid as the start of the same flow on a finer one."""

from __future__ import annotations

import numpy as np
from scipy.interpolate import RegularGridInterpolator

from flowborne.coupling.world import World
from flowborne.fluid.grid import Array


def start_from(coarse: World, fine: World) -> None:
    """Give `fine` the flow of `coarse`, interpolated."""
    (fluid, to), (rough, of) = fine.flow(), coarse.flow()
    for axis in fluid.grid.axes:
        for kept, found in (
            (to.velocity, of.velocity),
            (to.advecting_velocity, of.advecting_velocity),
        ):
            known, wanted = (g.face_coordinates(axis) for g in (rough.grid, fluid.grid))
            kept[axis][:] = interpolated(found[axis], known, wanted)
    known, wanted = rough.grid.cell_coordinates(), fluid.grid.cell_coordinates()
    to.pressure[:] = interpolated(of.pressure, known, wanted)


def interpolated(
    values: Array, known: tuple[Array, Array, Array], wanted: tuple[Array, Array, Array]
) -> Array:
    """Values (nx, ny, nz) between the coordinates where they are known: trilinear, in a slab
    bilinear."""
    axes = 2 if values.shape[2] == 1 else 3
    table = RegularGridInterpolator(
        known[:axes], values if axes == 3 else values[:, :, 0], bounds_error=False, fill_value=None
    )
    places = np.meshgrid(*wanted[:axes], indexing="ij")
    found = np.asarray(table(tuple(places)))
    return found if axes == 3 else found[:, :, None]
