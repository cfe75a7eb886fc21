"""The grid around the bodies: where they cut it, what mouths and sources bring into it, and what
a step starts from."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flowborne.coupling.flesh import skins_on
from flowborne.coupling.fractions import Geometry, geometry
from flowborne.coupling.mouths import Jet, add_rates, jet_of
from flowborne.coupling.report import timed
from flowborne.coupling.world import Fluid, Setup, World
from flowborne.fluid.boundary import cells_in
from flowborne.fluid.control_volumes import ControlVolumes, control_volumes
from flowborne.fluid.ghosts import edge
from flowborne.fluid.grid import Array, Faces
from flowborne.fluid.state import FluidState
from flowborne.solids.dynamics import Kinematics, kinematics
from flowborne.solids.state import SolidState


@timed("geometry")
def cut_by_bodies(world: World, pose: Kinematics | None = None) -> Geometry:
    """The grid cut by the bodies at their positions: once for each pose, and kept in the world.

    pose  of the bodies at these positions, if it is known
    """
    if world.cut is None or not np.array_equal(world.cut[0], world.solid.q):
        if pose is None:
            pose = kinematics(world.setup.solid, world.solid.q)
        world.cut = world.solid.q.copy(), cut_at(world.setup, pose)
    return world.cut[1]


def cut_at(setup: Setup, pose: Kinematics) -> Geometry:
    """The grid cut by the bodies in a pose."""
    assert setup.fluid is not None
    flesh = None if setup.fluid.one_way else setup.solid.flesh
    return geometry(
        setup.shapes,
        pose.geom_position[setup.shapes.source],
        pose.geom_rotation[setup.shapes.source],
        skins_on(setup.fluid.grid, setup.fluid.boundaries, flesh, pose.vertices),
        setup.solid.nbody,
        setup.fluid.grid,
        setup.fluid.boundaries,
    )


def jets_at(
    world: World, cut: Geometry, time: float, pose: Kinematics | None = None
) -> tuple[Jet, ...]:
    """What the mouths expel at `time` (s) with the bodies at their positions.

    raises  ValueError when a mouth covers no cell
    """
    setup = world.setup
    if not setup.mouths:
        return ()
    if pose is None:
        pose = kinematics(setup.solid, world.solid.q)
    given = cut, pose, world.solid.v, world.flow()[0].grid, time
    return tuple(jet_of(mouth, *given) for mouth in setup.mouths)


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
    jets, sources = jets_at(world, cut, world.time), source_rate(fluid, world.time, cut.open)
    rate = sources.copy()
    add_rates(rate, jets)
    volumes, bodies = volumes_of(world, cut), world.solid.copy()
    return Departure(fluid, state, cut, volumes, jets, sources, rate, bodies)


def volumes_of(world: World, cut: Geometry) -> ControlVolumes:
    """The control volumes of the fluid: of the cells as the last step left them, or of the cut
    where the bodies have been moved since. Those that the last step ended with are kept."""
    fluid, state = world.flow()
    cells = cut.volume if moved_since(world) else state.cell_volume
    kept = world.volumes
    if kept is not None and kept[0] is cut and np.array_equal(kept[1].cells, cells):
        return kept[1]
    return control_volumes(cells, cut.open, fluid.grid, fluid.boundaries)


def moved_since(world: World) -> bool:
    """Whether the bodies have been moved since the last step, or there was none."""
    _, state = world.flow()
    return state.cell_volume.size == 0 or not np.array_equal(state.pose, world.solid.q)
