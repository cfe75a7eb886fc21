"""A grid that moves by whole cells, and what the fluid is in the cells that come in."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from flowborne.fluid.boundary import Boundaries
from flowborne.fluid.ghosts import edge
from flowborne.fluid.grid import Grid, faces_of
from flowborne.fluid.sides.side import Boundary, Place, tangential_change
from flowborne.fluid.state import FluidState
from flowborne.fluid.wake import after_move
from flowborne.kernels.arrays import FREE, PRESCRIBED, Array, Faces


@dataclass(frozen=True)
class Window:
    """How a grid follows bodies.

    bodies  numbers of those whose common centre of mass it follows
    centre  (x, y, z) from the grid's lower corner to where that is at the start, m
    axes    along which the grid moves
    """

    bodies: tuple[int, ...]
    centre: tuple[float, float, float]
    axes: tuple[int, ...]


def crosses(side: Boundary | type[Boundary]) -> bool:
    """Whether a grid may move across a side: whether there is fluid beyond."""
    return side.normal == FREE or side.supplies


def moved_fluid(
    state: FluidState, grid: Grid, sides: Boundaries, axis: int, cells: int, time: float
) -> tuple[FluidState, Grid]:
    """State and grid after the grid has moved by some cells along an axis.

    Each layer of cells that comes in continues the fluid beyond the side: with the velocity that
    the side prescribes, else without vorticity and divergence where far sides answer the vorticity
    inside, else with that which the side has beyond it. Pressure and what the last step changed
    are those at the side; there is no dye but what the side lets in.
    """
    upper = cells > 0
    for _ in range(abs(cells)):
        beyond, grid = Place(grid, axis, upper), grid.moved(axis, 1 if upper else -1)
        place, side = Place(grid, axis, upper), sides.pair(axis)[upper]
        state = replace(
            state,
            velocity=_with_layer(state, sides, beyond, place, time),
            velocity_change=faces_of([shifted(u, axis, upper) for u in state.velocity_change]),
            acceleration=faces_of([shifted(u, axis, upper) for u in state.acceleration]),
            pressure=shifted(state.pressure, axis, upper),
            previous_pressure=shifted(state.previous_pressure, axis, upper),
            cell_volume=shifted(state.cell_volume, axis, upper),
            wake=after_move(state.wake, state.velocity, sides.sea(beyond.grid), sides.sea(grid)),
            scalars={
                name: shifted(dye, axis, upper, 0.0 if came is None else came)
                for name, dye in state.scalars.items()
                for came in [side.entering_scalar(name, place, time)]
            },
        )
    return state, grid


def _with_layer(
    state: FluidState, sides: Boundaries, beyond: Place, new: Place, time: float
) -> Faces:
    """Velocity on the faces of a grid that has moved by a cell beyond a side, then at `new`."""
    axis, upper, side = new.axis, new.upper, sides.pair(new.axis)[new.upper]
    # far sides that answer the vorticity inside hold what the next move starts from. Where they do
    # not, waves that grow outwards, by 1 + k h in a cell, would do so again with every move
    layers = (
        _irrotational(state.velocity, sides, beyond)
        if state.wake.size > 0
        else [
            side.velocity_beyond(state.velocity[component][beyond.layer], beyond, component, time)
            for component in new.grid.axes
        ]
    )
    found = list(state.velocity)
    for component, layer in enumerate(layers):
        if side.tangential == PRESCRIBED and component != axis:
            told = side.prescribed_velocity(new, component, time)
            layer = np.broadcast_to(told, layer.shape)
        found[component] = shifted(state.velocity[component], axis, upper, layer)
    if side.normal == PRESCRIBED:
        found[axis][new.layer] = side.prescribed_velocity(new, axis, time)
    return faces_of(found)


def _irrotational(velocity: Faces, sides: Boundaries, beyond: Place) -> list[Array]:
    """Layers of the components a cell beyond a side, without vorticity and divergence, m/s."""
    axis, upper = beyond.axis, beyond.upper
    through = velocity[axis][beyond.layer]
    layers, spread = [], np.zeros(through.shape)
    for component in beyond.grid.axes:
        layer = velocity[component][beyond.layer]
        if component != axis:
            change = tangential_change(through, beyond, component, sides.periodic()[component])
            for end, beside in zip((slice(1), slice(-1, None)), sides.pair(component), strict=True):
                if beside.normal == PRESCRIBED:
                    change[edge(component, end)] = 0.0
            layer = layer + change
            spread += np.diff(layer, axis=component)
        layers.append(layer)
    layers[axis] = through - spread if upper else through + spread
    return layers


def shifted(values: Array, axis: int, upper: bool, layer: Array | float | None = None) -> Array:
    """A field on a grid that has moved by a cell along an axis, towards its upper end or its lower.

    layer  what comes in; what was at that end when None
    """
    along = edge(axis, slice(None, -1)), edge(axis, slice(1, None))
    found = values.copy()
    found[along[not upper]] = values[along[upper]]
    if layer is not None:
        found[edge(axis, slice(-1, None) if upper else slice(1))] = layer
    return found
