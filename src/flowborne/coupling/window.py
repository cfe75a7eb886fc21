"""The grid follows bodies by whole cells."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from flowborne.coupling.cut import cut_by_bodies, volumes_of
from flowborne.coupling.world import Fluid, World
from flowborne.fluid.control_volumes import face_masses, fluid_momentum
from flowborne.fluid.ghosts import edge
from flowborne.fluid.grid import Array
from flowborne.fluid.window import Window, moved_fluid
from flowborne.solids.dynamics import kinematics
from flowborne.solids.model import SolidModel


def follow(world: World) -> Array:
    """Move the grid, in place, where the centre of mass of what it follows has moved by a cell.

    returns  (3,) the fluid's momentum that came in with new cells, less what fell out, N s
    """
    moves = cells_to_follow(world)
    if not any(moves):
        return np.zeros(3)
    fluid, state = world.flow()
    grid, before = fluid.grid, momentum(world)
    for axis, cells in enumerate(moves):
        state, grid = moved_fluid(state, grid, fluid.boundaries, axis, cells, world.time)
    world.setup, world.fluid, world.cut = world.setup.on(grid), state, None
    for axis, cells in enumerate(moves):
        cut_new_cells(world, axis, cells)
    return momentum(world) - before


def cells_to_follow(world: World) -> list[int]:
    """Whole cells along each axis by which the centre has moved from its place in the grid."""
    fluid, model = world.setup.fluid, world.setup.solid
    if fluid is None or fluid.window is None:
        return [0, 0, 0]
    window, grid = fluid.window, fluid.grid
    moved = centre_of(window, model, world.solid.q) - np.array(grid.origin) - window.centre
    cells = moved / grid.spacing
    return [int(cells[axis]) if axis in window.axes else 0 for axis in range(3)]


def following(
    fluid: Fluid, model: SolidModel, q: Array, bodies: Sequence[int], axes: Sequence[int]
) -> Fluid:
    """The fluid with a grid that follows bodies along some axes, from the positions q (nq,) on.

    raises  ValueError when beyond a side across one of the axes there is no fluid
    """
    window = Window(tuple(bodies), (0.0, 0.0, 0.0), tuple(axes))
    x, y, z = (centre_of(window, model, q) - fluid.grid.origin).tolist()
    return replace(fluid, window=replace(window, centre=(x, y, z)))


def centre_of(window: Window, model: SolidModel, q: Array) -> Array:
    """(3,) centre of mass of what a window follows, at the positions q (nq,), m."""
    bodies = list(window.bodies)
    centres = kinematics(model, q).mass_centre[bodies]
    return np.asarray(np.average(centres, axis=0, weights=model.mj.body_mass[bodies]))


def cut_new_cells(world: World, axis: int, cells: int) -> None:
    """Cut the cells that came in along an axis by the bodies that are there, in place."""
    cut, (fluid, state) = cut_by_bodies(world), world.flow()
    if cells == 0:
        return
    new = edge(axis, slice(-cells, None) if cells > 0 else slice(-cells))
    if state.cell_volume.size > 0:
        state.cell_volume[new] = cut.volume[new]
    for component in fluid.grid.axes:
        state.velocity[component][new][cut.open[component][new] == 0.0] = 0.0


def momentum(world: World) -> Array:
    """(3,) linear momentum of the fluid, N s. The control volumes are kept."""
    cut, (fluid, state) = cut_by_bodies(world), world.flow()
    world.volumes = cut, volumes_of(world, cut)
    mass = face_masses(world.volumes[1], fluid.density)
    return fluid_momentum(state.velocity, mass, fluid.grid, fluid.boundaries)
