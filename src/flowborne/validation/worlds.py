"""Small worlds for the cases, and running them."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypedDict, Unpack

import numpy as np

from flowborne.coupling.motion import JointCommand, Trajectory
from flowborne.coupling.report import Outcome, StepReport
from flowborne.coupling.step import step
from flowborne.coupling.world import Fluid, Setup, World
from flowborne.fluid.boundary import Boundaries, BoundaryPeriodic
from flowborne.fluid.grid import Array, Grid
from flowborne.solids.model import SolidModel
from flowborne.solids.wind import Wind

Field = Callable[[Array, Array, Array], tuple[Array, Array, Array]]
"""velocity(x, y, z) -> (u, v, w), broadcasting arrays in m to m/s."""

Vector = tuple[float, float, float]

EMPTY = "<mujoco/>"
NOWHERE: Vector = (0.0, 0.0, 0.0)
PERIODIC = BoundaryPeriodic()
RING = Boundaries(PERIODIC, PERIODIC, PERIODIC, PERIODIC)
"""Periodic in x and y."""


class FluidProperties(TypedDict, total=False):
    """Those of a `Fluid` that the cases set."""

    density: float
    viscosity: float
    boundaries: Boundaries
    body_force: Vector
    tolerance: float
    scalars: tuple[str, ...]


def mjcf(*elements: str, options: str = "") -> str:
    """An MJCF model of world-body elements; angles in radians, no contact."""
    return (
        '<mujoco><compiler angle="radian"/><default><geom contype="0" conaffinity="0"/></default>'
        f"{options}<worldbody>{''.join(elements)}</worldbody></mujoco>"
    )


def world_of(
    grid: Grid | None,
    model: str = EMPTY,
    *,
    slab: bool = True,
    gravity: Vector = NOWHERE,
    solid_density: float | None = None,
    motions: tuple[Trajectory, ...] = (),
    winds: tuple[Wind, ...] = (),
    **properties: Unpack[FluidProperties],
) -> World:
    """A world at rest. With a grid, `slab` follows the grid.

    solid_density  kg/m^3 of every geom, in place of the model's own
    properties     of the fluid; its density is 1 kg/m^3 unless another is given
    """
    flat = slab if grid is None else grid.is_slab
    solid = SolidModel.from_string(model, slab=flat, gravity=gravity, density=solid_density)
    properties.setdefault("density", 1.0)
    fluid = None if grid is None else Fluid(grid, **properties)
    return World.at_rest(Setup(solid, fluid, motions, winds))


def set_velocity(world: World, field: Field) -> None:
    """Give the fluid a velocity, as what it is and as what carries it."""
    fluid, state = world.flow()
    for axis in fluid.grid.axes:
        x, y, z = np.meshgrid(*fluid.grid.face_coordinates(axis), indexing="ij")
        values = np.broadcast_to(field(x, y, z)[axis], x.shape)
        state.velocity[axis][:] = values
        state.advecting_velocity[axis][:] = values


def advance(
    world: World, dt: float, steps: int = 1, command: JointCommand | None = None
) -> StepReport:
    """Take steps; gives the last report. Raises ArithmeticError when one fails."""
    assert steps > 0
    for _ in range(steps):
        report = step(world, dt, command)
        if report.outcome is not Outcome.DONE:
            raise ArithmeticError(f"step {world.steps}: {report.outcome.value}")
    return report


def start_at_once(world: World, dt: float) -> StepReport:
    """One step from a flow that does not yet know its bodies: the impulsive start.

    The pressure of this step is an impulse, which says nothing about the next step: it is cleared.
    """
    report = advance(world, dt)
    _, state = world.flow()
    for values in (*state.acceleration, state.pressure, state.earlier):
        values[:] = 0.0
    return report


def whole_steps(duration: float, longest: float) -> tuple[int, float]:
    """Number and length of equal steps, none longer than `longest`, that make up a duration."""
    count = max(1, int(np.ceil(duration / longest - 1e-9)))
    return count, duration / count
