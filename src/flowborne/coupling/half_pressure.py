"""Half of the last pressure acts before the flow is advected; the solve computes the rest.

A pressure that acts only at the end of a step, and turns the flow along a body by the momentum dp,
takes |dp|^2 / (2 m) from the flow's energy in every step. With half of the last pressure given to
fluid and bodies beforehand, a step changes their energy by

    K_n . (K_{n-1} - K_n) = (|K_{n-1}|^2 - |K_n|^2 - |K_n - K_{n-1}|^2) / 2

for the changes K of velocity due to the pressures of two successive steps, in the norm of the
masses: one step returns what the last one took, and the loss is one order smaller. The reflection
of Zehnder, Narain and Thomaszewski (2018) does so with two solves a step. Here one is enough: the
solve still computes the whole, and corrects a wrong estimate.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flowborne.coupling.creeping import creeps
from flowborne.coupling.cut import Departure, gradient_on, moved_since
from flowborne.coupling.operators import pressure_push, side_push
from flowborne.coupling.world import Fluid, World
from flowborne.fluid.control_volumes import each_once, fluid_momentum
from flowborne.fluid.grid import faces_of
from flowborne.kernels.arrays import Array, Faces


@dataclass(frozen=True)
class HalfPressure:
    """What half of the last pressure gives to the fluid and the bodies before they move.

    velocity  Faces of the fluid with it, m/s
    pressure  (nx, ny, nz) of which it is made, Pa
    impulse   (k,) on the bodies, see `SolvedFlow`
    sides     (3,) impulse of the sides on the fluid, N s; nan without balances
    start     (3,) momentum of the fluid without it, N s; likewise
    """

    velocity: Faces
    pressure: Array
    impulse: Array
    sides: Array
    start: Array


def explicit_half_pressure(world: World, start: Departure, dt: float) -> HalfPressure:
    """Half of the last pressure, on the grid and the control volumes of the start.

    It is 0 if the bodies have been moved since, where the flow creeps and has no energy to keep,
    and in a domain with an open side: fluid that comes in there brings energy, which the step
    without it damps.
    Behind a far side there is a sea, and what comes in has no more energy than that has; the
    pressure that changes the sea's velocity is not half of it given beforehand.

    The rest of the last pressure stays in the state, as the first guess of the solve.
    """
    fluid, state = world.flow()
    grid, sides, opened = fluid.grid, fluid.boundaries, start.cut.open
    momentum, volumes = np.full(3, np.nan), start.volumes.moving
    if world.setup.balances:
        momentum = fluid.density * fluid_momentum(state.velocity, volumes, grid, sides)
    size = 6 * world.setup.solid.nbody + start.cut.skins.vertices.size
    acts = not (sides.gain_energy(grid) or sea_changes(world, dt) or creeps(fluid, dt))
    if not acts or moved_since(world):
        still = np.zeros(grid.shape), np.zeros(size), np.zeros(3)
        return HalfPressure(state.velocity, *still, momentum)
    gradient = gradient_on(world, start.cut, start.volumes)
    last, earlier = grid.zeros_faces(), grid.zeros_faces()
    pressure = dynamic_pressure(state.pressure, fluid)
    gradient.subtract(last, pressure, dt)
    before = dynamic_pressure(state.previous_pressure, fluid)
    gradient.subtract(earlier, before, dt)
    own = [each_once(axis, sides) for axis in range(3)]
    fields = list(zip(own, volumes, last, earlier, strict=True))
    both = sum(float((v * k * b)[once].sum()) for once, v, k, b in fields)
    square = sum(float((v * k * k)[once].sum()) for once, v, k, _ in fields)
    part = 0.5 * pressure_increment_ratio(both / square) if square > 0.0 else 0.0
    half = part * pressure
    state.pressure = state.pressure - half
    velocity = faces_of([u + part * k for u, k in zip(state.velocity, last, strict=True)])
    start.volumes.follow(velocity, grid)
    pushed = np.full(3, np.nan)
    if world.setup.balances:
        pushed = dt * side_push(half, opened, gradient)
    impulse = pressure_push(start.cut, dt * half, size)
    return HalfPressure(velocity, half, impulse, pushed, momentum)


def sea_changes(world: World, dt: float) -> bool:
    """Whether the sea around the domain has another velocity at the end of a step of dt (s) than at
    its start, or than a step before."""
    fluid, state = world.flow()
    sea = fluid.boundaries.sea(fluid.grid)
    if sea is None:
        return False
    before = sea.velocity(max(0.0, world.time - dt)), state.sea if state.sea.size else None
    after = sea.velocity(world.time + dt)
    return any(known is not None and not np.array_equal(known, after) for known in before)


def pressure_increment_ratio(earlier: float) -> float:
    """Part of a pressure that the next one has at least, when the one before had `earlier` of it.

    All of it, or the value of the straight line through both where it falls; no more than twice
    `earlier`. A sudden impulse, or one that has just ended, is not extrapolated.
    """
    return max(0.0, min(1.0, 2.0 - earlier, 2.0 * earlier))


def dynamic_pressure(pressure: Array, fluid: Fluid) -> Array:
    """The pressure without the part that balances the body force and moves nothing, Pa."""
    grid, held = fluid.grid, pressure != 0.0
    rest = pressure
    for axis in grid.axes:
        slope = fluid.density * fluid.body_force[axis]
        if slope != 0.0 and not fluid.boundaries.periodic()[axis]:
            along = [-1 if a == axis else 1 for a in range(3)]
            rest = rest - np.where(held, slope * grid.cell_coordinates()[axis].reshape(along), 0.0)
    return rest
