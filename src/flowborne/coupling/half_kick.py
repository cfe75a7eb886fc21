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

from flowborne.coupling.flow import face_masses, fluid_momentum, moved_since
from flowborne.coupling.fractions import Geometry
from flowborne.coupling.operators import pressure_push
from flowborne.coupling.world import Fluid, World
from flowborne.fluid.control_volumes import ControlVolumes
from flowborne.fluid.grid import Array, Faces, faces_of
from flowborne.fluid.projection import accelerated, push


@dataclass(frozen=True)
class Kick:
    """What the fluid and the bodies are given before a step.

    velocity  Faces of the fluid with it, m/s
    pressure  (nx, ny, nz) that gives it, Pa
    impulse   (k,) on the bodies, see `Projected`
    start     (3,) momentum of the fluid without it, N s
    """

    velocity: Faces
    pressure: Array
    impulse: Array
    start: Array


def half_kick(world: World, cut: Geometry, volumes: ControlVolumes, dt: float) -> Kick:
    """Half of the last pressure, on the grid `cut` and its control volumes; none of it where the
    bodies have been put elsewhere since, and in the paper's own scheme.

    What is left of it stays in the state, as what the solve is expected to find.
    """
    fluid, state = world.flow()
    grid, sides = fluid.grid, fluid.boundaries
    mass = face_masses(volumes, fluid.density)
    start = fluid_momentum(state.velocity, mass, grid, sides)
    size = 6 * world.setup.solid.nbody + cut.skins.vertices.size
    if fluid.advection == "semi-lagrangian" or moved_since(world):
        return Kick(state.velocity, np.zeros(grid.shape), np.zeros(size), start)
    half = 0.5 * likely(driving(state.pressure, fluid), driving(state.earlier, fluid))
    state.pressure -= half
    velocity = faces_of([u.copy() for u in state.velocity])
    push(velocity, accelerated(cut.open, mass, grid), half, grid, sides, dt)
    volumes.follow(velocity, grid)
    return Kick(velocity, half, pressure_push(cut, dt * half, size), start)


def driving(pressure: Array, fluid: Fluid) -> Array:
    """The pressure without what balances the body force, Pa; in a box without open sides with mean
    0 over the cells that have any, since its level means nothing there."""
    held = pressure != 0.0
    rest = pressure.copy()
    for axis, x in enumerate(fluid.grid.cell_coordinates()):
        if axis in fluid.grid.axes and not fluid.boundaries.periodic()[axis]:
            along = [1, 1, 1]
            along[axis] = -1
            rest -= fluid.density * fluid.body_force[axis] * x.reshape(along)
    if not any(side.kind == "open" for a in fluid.grid.axes for side in fluid.boundaries.pair(a)):
        rest -= rest.sum(where=held) / max(1, np.count_nonzero(held))
    return np.where(held, rest, 0.0)


def likely(pressure: Array, earlier: Array) -> Array:
    """What the pressure of the next step is at least, as the last two tell.

    The last one, or what the straight line through both comes to where it falls; no more than
    twice the earlier one, and 0 where they differ in sign. A sudden impulse, or one that has just
    ended, is not taken for what goes on.
    """
    ahead = 2.0 * pressure - earlier
    least = np.minimum(np.abs(pressure), np.minimum(np.abs(ahead), 2.0 * np.abs(earlier)))
    same = (pressure * earlier > 0.0) & (pressure * ahead > 0.0)
    return np.where(same, np.copysign(least, pressure), 0.0)
