"""Half of the last pressure acts before the flow is carried, the rest is solved for after it.

A pressure that turns the flow along with a body, dp, and acts at the end of each step alone, takes
|dp|^2 / (2 m) from the flow's energy every time. With half of that of the last step given to fluid
and bodies beforehand, a step changes their energy by

    K_n . (K_{n-1} - K_n) = (|K_{n-1}|^2 - |K_n|^2 - |K_n - K_{n-1}|^2) / 2

for the changes K of velocity that the pressures of two steps bring, in the norm of the masses:
what one step gains the next gives back, and the loss is one order smaller. What the reflection of
Zehnder, Narain and Thomaszewski (2018) does with two solves a step, this does with one, since the
solve still settles the whole: an estimate that is wrong is undone by it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flowborne.coupling.flow import moved_since
from flowborne.coupling.fractions import Geometry
from flowborne.coupling.operators import pressure_push, side_push
from flowborne.coupling.world import Fluid, World
from flowborne.fluid.control_volumes import ControlVolumes
from flowborne.fluid.grid import Array, Faces, faces_of
from flowborne.fluid.momentum import each_once, face_masses, fluid_momentum
from flowborne.fluid.projection import accelerated, subtract_pressure_gradient


@dataclass(frozen=True)
class Kick:
    """What the fluid and the bodies are given before a step.

    velocity  Faces of the fluid with it, m/s
    pressure  (nx, ny, nz) that gives it, Pa
    impulse   (k,) on the bodies, see `Projected`
    sides     (3,) impulse of the sides on the fluid, N s
    start     (3,) momentum of the fluid without it, N s
    """

    velocity: Faces
    pressure: Array
    impulse: Array
    sides: Array
    start: Array


def half_kick(world: World, cut: Geometry, volumes: ControlVolumes, dt: float) -> Kick:
    """Half of the last pressure, on the grid `cut` and its control volumes.

    None of it where the bodies have been put elsewhere since, in the paper's own scheme, and in a
    domain with a free side: what comes in there brings energy of its own, which the plain step
    damps and this one does not.

    What is left of it stays in the state, as what the solve is expected to find.
    """
    fluid, state = world.flow()
    grid, sides = fluid.grid, fluid.boundaries
    mass = face_masses(volumes, fluid.density)
    start = fluid_momentum(state.velocity, mass, grid, sides)
    size = 6 * world.setup.solid.nbody + cut.skins.vertices.size
    plain = sides.has_free_side(grid) or not fluid.advection.half_kick
    if plain or moved_since(world):
        return Kick(state.velocity, np.zeros(grid.shape), np.zeros(size), np.zeros(3), start)
    pressure, earlier = driving(state.pressure, fluid), driving(state.earlier, fluid)
    rate = accelerated(cut.open, mass, grid, sides)
    kick, before = grid.zeros_faces(), grid.zeros_faces()
    subtract_pressure_gradient(kick, rate, pressure, grid, sides, dt)
    subtract_pressure_gradient(before, rate, earlier, grid, sides, dt)
    own = [each_once(axis, sides) for axis in range(3)]
    fields = list(zip(own, mass, kick, before, strict=True))
    both = sum(float((m * k * b)[once].sum()) for once, m, k, b in fields)
    square = sum(float((m * k * k)[once].sum()) for once, m, k, _ in fields)
    part = 0.5 * likely(both / square) if square > 0.0 else 0.0
    half = part * pressure
    state.pressure -= half
    velocity = faces_of([u + part * k for u, k in zip(state.velocity, kick, strict=True)])
    volumes.follow(velocity, grid)
    pushed = dt * side_push(half, cut.open, grid, sides)
    return Kick(velocity, half, pressure_push(cut, dt * half, size), pushed, start)


def likely(earlier: float) -> float:
    """What part of a pressure the next one has at least, when the one before had `earlier` of it.

    All of it, or what the straight line through both comes to where it falls; no more than twice
    what it had. A sudden impulse, or one that has just ended, is not taken for what goes on.
    """
    return max(0.0, min(1.0, 2.0 - earlier, 2.0 * earlier))


def driving(pressure: Array, fluid: Fluid) -> Array:
    """The pressure without what balances the body force, which moves nothing, Pa."""
    grid, held = fluid.grid, pressure != 0.0
    rest = pressure
    for axis in grid.axes:
        slope = fluid.density * fluid.body_force[axis]
        if slope != 0.0 and not fluid.boundaries.periodic()[axis]:
            along = [-1 if a == axis else 1 for a in range(3)]
            rest = rest - np.where(held, slope * grid.cell_coordinates()[axis].reshape(along), 0.0)
    return rest
