"""The grid around the bodies: where they cut it, how it follows them by whole cells, what mouths,
sources and thrusters do to it, and what a step starts from."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from flowborne.coupling.flesh import skins_on
from flowborne.coupling.fractions import Geometry, geometry
from flowborne.coupling.mouths import Jet, add_rates, jet_of
from flowborne.coupling.report import timed
from flowborne.coupling.thrusters import Disc, discs_of
from flowborne.coupling.world import Fluid, Setup, World
from flowborne.fluid.boundary import cells_in
from flowborne.fluid.control_volumes import (
    ControlVolumes,
    control_volumes,
    face_masses,
    fluid_momentum,
)
from flowborne.fluid.ghosts import edge
from flowborne.fluid.projection import PressureGradient, pressure_gradient
from flowborne.fluid.state import FluidState
from flowborne.fluid.window import Window, moved_fluid
from flowborne.kernels.arrays import Array, Faces
from flowborne.solids.dynamics import Kinematics, kinematics
from flowborne.solids.model import SolidModel, SolidState


def pose_and_cut(world: World) -> tuple[Kinematics, Geometry]:
    """The bodies and the cut grid at their positions: once for each, and kept in the world."""
    if world.cut is None or not stand_at(world, world.cut[0]):
        with timed("solids"):
            pose = kinematics(world.setup.solid, world.solid.q)
        with timed("geometry"):
            world.cut = world.solid.q.copy(), pose, cut_at(world.setup, pose)
    return world.cut[1:]


def stand_at(world: World, q: Array) -> bool:
    """Whether the bodies are exactly at the positions q (nq,)."""
    return q.tobytes() == world.solid.q.tobytes()


def cut_by_bodies(world: World) -> Geometry:
    """The grid cut by the bodies at their positions."""
    return pose_and_cut(world)[1]


def cut_at(setup: Setup, pose: Kinematics) -> Geometry:
    """The grid cut by the bodies in a pose."""
    assert setup.fluid is not None
    grid, sides = setup.fluid.grid, setup.fluid.boundaries
    flesh = None if setup.fluid.one_way else setup.solid.flesh
    return geometry(
        setup.shapes,
        pose.geom_position[setup.shapes.source],
        pose.geom_rotation[setup.shapes.source],
        skins_on(grid, sides, flesh, pose.vertices, setup.solid.nbody),
        setup.solid.nbody,
        grid,
        sides,
    )


def jets_at(world: World, time: float) -> tuple[Jet, ...]:
    """What the mouths expel at `time` (s) with the bodies at their positions.

    raises  ValueError when a mouth covers no cell
    """
    setup = world.setup
    if not setup.mouths:
        return ()
    pose, cut = pose_and_cut(world)
    given = cut, pose, world.solid.v, world.flow()[0].grid, time
    return tuple(jet_of(mouth, *given) for mouth in setup.mouths)


def discs_at(
    world: World, pose: Kinematics, volumes: ControlVolumes, time: float
) -> tuple[Disc, ...]:
    """What the thrusters do at `time` (s) with bodies in a pose, on these control volumes.

    raises  BreakdownError when one of them has no water
    """
    setup = world.setup
    if not setup.thrusters:
        return ()
    fluid, _ = world.flow()
    around = fluid.boundaries, fluid.grid, fluid.density
    return discs_of(setup.thrusters, world.told.settings, pose, volumes, *around, time)


def source_rate(fluid: Fluid, time: float, opened: Faces) -> Array:
    """(nx, ny, nz) volume that appears in each cell, m^3/s; none in cells wholly inside a body."""
    grid = fluid.grid
    rate = np.zeros(grid.shape)
    for source in fluid.sources:
        if source.volume_rate is None or not source.active(time):
            continue
        box = cells_in(source, grid)
        clear = np.ones(rate[box].shape, bool)
        for axis in grid.axes:
            wide = list(box)
            wide[axis] = slice(box[axis].start, box[axis].stop + 1)
            part = opened[axis][tuple(wide)] > 0.0
            clear &= part[edge(axis, slice(None, -1))] | part[edge(axis, slice(1, None))]
        if clear.any():
            rate[box][clear] += source.volume_rate / np.count_nonzero(clear)
    return rate


@dataclass(frozen=True)
class Departure:
    """Fluid and bodies at the start of a step, t^n.

    fluid    and its
    state
    cut      the cut grid
    volumes  control volumes
    jets     of the mouths
    sources  (nx, ny, nz) volume per time that sources bring into each cell, m^3/s
    rate     (nx, ny, nz) the same of sources and mouths
    bodies   their state
    """

    fluid: Fluid
    state: FluidState
    cut: Geometry
    volumes: ControlVolumes
    jets: tuple[Jet, ...]
    sources: Array
    rate: Array
    bodies: SolidState


@timed("geometry")
def departure(world: World) -> Departure:
    """Fluid and bodies at the start of a step."""
    fluid, state = world.flow()
    cut = cut_by_bodies(world)
    jets, sources = jets_at(world, world.time), source_rate(fluid, world.time, cut.open)
    rate = sources.copy() if jets else sources
    add_rates(rate, jets)
    volumes, bodies = volumes_of(world, cut), world.solid.copy()
    return Departure(fluid, state, cut, volumes, jets, sources, rate, bodies)


def volumes_of(world: World, cut: Geometry) -> ControlVolumes:
    """The control volumes of the fluid: of the cells as the last step left them, or of the cut
    where the bodies have been moved since. Those that the last step ended with are kept."""
    fluid, state = world.flow()
    cells = cut.volume if moved_since(world) else state.cell_volume
    kept = world.volumes
    if kept is not None and kept[0] is cut:
        known = kept[1].cells
        if known is cells or np.array_equal(known, cells):
            return kept[1]
    return control_volumes(cells, cut.open, fluid.grid, fluid.boundaries)


def gradient_on(world: World, cut: Geometry, volumes: ControlVolumes) -> PressureGradient:
    """The gradient of the pressure on the control volumes of a cut: on those that the last step
    ended with it is kept."""
    if world.pressed is not None and world.pressed[0] is volumes:
        return world.pressed[1]
    fluid, _ = world.flow()
    given = volumes.moving, fluid.density, fluid.grid, fluid.boundaries
    return pressure_gradient(cut.open, *given)


def moved_since(world: World) -> bool:
    """Whether the bodies have been moved since the last step, or there was none."""
    _, state = world.flow()
    return state.cell_volume.size == 0 or not stand_at(world, state.pose)


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
