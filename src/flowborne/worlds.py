"""Worlds made and stepped in code, from a model, a grid and the properties of the fluid.

world = make_world("<mujoco>...</mujoco>", Grid.slab(64, 64, 1 / 64, (0, 0)), density=1000.0)
report = advance(world, 0.01, 20)

Also here: boundary conditions of the sides of a domain, and the operators of a step on plain
arrays, for research on the numerics; the operators change with the numerics.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TypedDict, Unpack

import numpy as np
from scipy.interpolate import RegularGridInterpolator

from flowborne.base.arguments import COUNT, POSITIVE, VECTOR, one_of, or_none, takes
from flowborne.coupling.cut import cut_by_bodies, following, volumes_of
from flowborne.coupling.report import Outcome, StepReport
from flowborne.coupling.start import set_going, start
from flowborne.coupling.step import step
from flowborne.coupling.stream import Sampled
from flowborne.coupling.world import Fluid, Setup, World
from flowborne.fluid.boundary import Boundaries, Source
from flowborne.fluid.control_volumes import control_volumes, face_masses
from flowborne.fluid.control_volumes import kinetic_energy as kinetic_energy_of_fluid
from flowborne.fluid.dye import Passage, nothing_brought
from flowborne.fluid.grid import Grid, faces_of
from flowborne.fluid.sides.far import BoundaryFar
from flowborne.fluid.sides.kinds import (
    BoundaryClosed,
    BoundaryInflow,
    BoundaryNoSlip,
    BoundaryOpen,
    BoundaryPeriodic,
)
from flowborne.fluid.sides.side import Boundary, Profile
from flowborne.fluid.transport import Transport
from flowborne.fluid.wake import resampled
from flowborne.kernels.arrays import Array
from flowborne.solids import momentum
from flowborne.solids.model import SolidModel
from flowborne.solids.trajectories import JointCommand, Trajectory
from flowborne.solids.wind import Wind
from flowborne.solvers.pressure import PressureSolution, PressureSystem

__all__ = [
    "Boundaries",
    "Boundary",
    "BoundaryClosed",
    "BoundaryFar",
    "BoundaryInflow",
    "BoundaryNoSlip",
    "BoundaryOpen",
    "BoundaryPeriodic",
    "Field",
    "FluidProperties",
    "Passage",
    "PressureSolution",
    "PressureSystem",
    "Profile",
    "Source",
    "Transport",
    "advance",
    "control_volumes",
    "cut_by_bodies",
    "faces_of",
    "follow_bodies",
    "kinetic_energy",
    "make_world",
    "nothing_brought",
    "set_going",
    "set_velocity",
    "start",
    "start_from",
    "velocity_at",
]

__dir__ = __all__.copy

Field = Callable[[Array, Array, Array], tuple[Array, Array, Array]]
"""velocity(x, y, z) -> (u, v, w), broadcasting arrays in m to m/s."""

EMPTY = "<mujoco/>"


class FluidProperties(TypedDict, total=False):
    """Properties of a fluid; see `Fluid`."""

    density: float
    viscosity: float
    boundaries: Boundaries
    sources: tuple[Source, ...]
    body_force: tuple[float, float, float]
    tolerance: float
    scalars: tuple[str, ...]


@takes(
    model=one_of(str, SolidModel, wanted="MJCF as text, or a SolidModel"),
    grid=or_none(one_of(Grid, wanted="a Grid")),
    gravity=VECTOR,
    solid_density=or_none(POSITIVE),
)
def make_world(
    model: str | SolidModel = EMPTY,
    grid: Grid | None = None,
    *,
    slab: bool | None = None,
    gravity: tuple[float, float, float] = (0.0, 0.0, 0.0),
    solid_density: float | None = None,
    motions: tuple[Trajectory, ...] = (),
    winds: tuple[Wind, ...] = (),
    **fluid: Unpack[FluidProperties],
) -> World:
    """A world at rest.

    model          MJCF as text, or a model
    grid           of the fluid; None for a world without fluid
    slab           whether the bodies move in the plane; that of the grid by default
    gravity        m/s^2, of a model given as text
    solid_density  kg/m^3 of every geom of a model given as text, in place of its own; a geom with a
                   mass keeps it
    motions        prescribed motions of joints
    winds          simple winds
    fluid          its properties; the density is 1 kg/m^3 by default
    raises         SceneError if the text is no model
    """
    if isinstance(model, str):
        flat = (grid is not None and grid.is_slab) if slab is None else slab
        model = SolidModel.from_string(model, slab=flat, gravity=gravity, density=solid_density)
    fluid.setdefault("density", 1.0)
    return World.at_rest(
        Setup(model, None if grid is None else Fluid(grid, **fluid), motions, winds)
    )


@takes(steps=COUNT)
def advance(
    world: World, dt: float, steps: int = 1, command: JointCommand | None = None
) -> StepReport:
    """Take equal steps of dt (s), in place; returns the last report.

    command  to joints without a trajectory
    raises   ArithmeticError if a step fails; SceneError for a wrong argument
    """
    for _ in range(steps):
        report = step(world, dt, command)
        if report.outcome is not Outcome.DONE:
            raise ArithmeticError(f"step {world.steps}: {report.outcome.value}")
    return report


def follow_bodies(world: World, bodies: Sequence[int], along: Sequence[int]) -> None:
    """Make the grid follow the centre of mass of some bodies by whole cells, from now on.

    along   axes along which it moves, 0 to 2
    raises  ValueError when beyond a side across one of them there is no fluid
    """
    fluid, _ = world.flow()
    followed = following(fluid, world.setup.solid, world.solid.q, bodies, along)
    world.setup = world.setup.but(fluid=followed)


def set_velocity(world: World, field: Field) -> None:
    """Set the velocity of the fluid, as if it had not changed in the last step."""
    fluid, state = world.flow()
    for axis in fluid.grid.axes:
        x, y, z = np.meshgrid(*fluid.grid.face_coordinates(axis), indexing="ij")
        values = np.broadcast_to(field(x, y, z)[axis], x.shape)
        state.velocity[axis][:] = values
        state.velocity_change[axis][:] = 0.0


def velocity_at(world: World, x: Array) -> Array:
    """(n, 3) velocity of the fluid at points x (n, 3), m/s, linear between faces."""
    fluid, state = world.flow()
    return Sampled(state.velocity, fluid.grid)(x, world.time)


def kinetic_energy(world: World) -> float:
    """Kinetic energy of fluid and bodies, J (J/m in a slab)."""
    energy = momentum.kinetic_energy(world.setup.solid, world.solid)
    if world.fluid is None:
        return energy
    fluid, state = world.flow()
    mass = face_masses(volumes_of(world, cut_by_bodies(world)), fluid.density)
    return energy + kinetic_energy_of_fluid(state.velocity, mass, fluid.grid, fluid.boundaries)


def start_from(coarse: World, fine: World) -> None:
    """Set velocity, pressure and wake of `fine` to those of `coarse`, interpolated."""
    (fluid, to), (rough, of) = fine.flow(), coarse.flow()
    for axis in fluid.grid.axes:
        known, wanted = (g.face_coordinates(axis) for g in (rough.grid, fluid.grid))
        to.velocity[axis][:] = _interpolated(of.velocity[axis], known, wanted)
        found = _interpolated(of.velocity_change[axis], known, wanted)
        to.velocity_change[axis][:] = found
    known, wanted = rough.grid.cell_coordinates(), fluid.grid.cell_coordinates()
    to.pressure[:] = _interpolated(of.pressure, known, wanted)
    to.wake, to.sea = resampled(of.wake, fluid.grid.spacing / rough.grid.spacing), of.sea.copy()


def _interpolated(
    values: Array, known: tuple[Array, Array, Array], wanted: tuple[Array, Array, Array]
) -> Array:
    """Values (nx, ny, nz) at known coordinates, interpolated at the wanted ones: trilinear, in a
    slab bilinear."""
    axes = 2 if values.shape[2] == 1 else 3
    table = RegularGridInterpolator(
        known[:axes], values if axes == 3 else values[:, :, 0], bounds_error=False, fill_value=None
    )
    found = np.asarray(table(tuple(np.meshgrid(*wanted[:axes], indexing="ij"))))
    return found if axes == 3 else found[:, :, None]
