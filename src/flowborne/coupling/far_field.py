"""The velocity that the sea around a domain gives to its far sides.

At the start of a step, from the state alone (after Weymouth and Lauber 2024, without their
iteration): the leak-proof field, in which bodies move as they do, is the sea's stream, plus what
its own circulation induces, that of the wake beyond the exit included (`fluid.wake`), plus what
mouths, sources and flesh that swells bring. The sides have that normal velocity before the solve,
which adds what happens in the step itself (`fluid.sides.far`, `fluid.dipoles`). In a step after the
bodies or the flow have been set by hand the sides keep their velocity, as the circulation is not
yet that of a flow around the bodies. Where the sea's velocity U changes, p is the pressure without
that which moves the sea, -rho x.dU/dt.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from flowborne.coupling.cut import Departure, moved_since, pose_and_cut
from flowborne.coupling.flow import AdvectionResult
from flowborne.coupling.operators import boundary_velocity, leak_proof
from flowborne.coupling.world import Fluid, World
from flowborne.fluid.grid import faces_of
from flowborne.fluid.potential import Normal, brought
from flowborne.fluid.projection import accelerated
from flowborne.fluid.wake import induced
from flowborne.kernels.arrays import Array, Faces


@dataclass(frozen=True)
class FarField:
    """What the sea does in a step.

    normal    of each far side but the exit, before the solve
    wake      at the end of the step, see `FluidState`
    velocity  (3,) of the sea then, m/s; empty without a sea
    gained    (3,) what that has changed by, m/s
    """

    normal: Normal
    wake: Array
    velocity: Array
    gained: Array

    def drive(self, advected: AdvectionResult, opened: Faces, fluid: Fluid) -> AdvectionResult:
        """The fluid after advection where the sides have their velocity; what that took they gave.

        Where the sea's velocity changes, its pressure acts at the end of the columns behind the
        sides, so that a uniform flow changes alike.

        opened  Faces, open parts at the end of the step
        """
        grid, sea = fluid.grid, fluid.boundaries.sea(fluid.grid)
        if sea is None:
            return advected
        velocity, stopped = faces_of([u.copy() for u in advected.velocity]), advected.stopped.copy()
        for place, across in self.normal.items():
            velocity[place.axis][place.layer] = across
        if self.gained.any():
            moving = advected.volumes.moving
            rate = accelerated(opened, moving, fluid.density, grid, fluid.boundaries)
            for place in sea.far:
                outward, at = 1.0 if place.upper else -1.0, list(place.cell_coordinates())
                if place in self.normal:
                    at[place.axis] = at[place.axis] - 0.5 * outward * grid.spacing
                against = fluid.density * sum(x * u for x, u in zip(at, self.gained, strict=True))
                velocity[place.axis][place.layer] += (
                    outward * rate[place.axis][place.layer] * against
                )
        for place in sea.far:
            change = (velocity[place.axis] - advected.velocity[place.axis])[place.layer]
            held = fluid.density * advected.volumes.moving[place.axis][place.layer]
            stopped[place.axis] += float((held * change).sum())
        return replace(advected, velocity=velocity, stopped=stopped)


def far_field(world: World, start: Departure, dt: float) -> FarField:
    """What the sea does in a step of dt (s) from `start`."""
    fluid, state = world.flow()
    sea = fluid.boundaries.sea(fluid.grid)
    if sea is None:
        return FarField({}, state.wake, state.sea, np.zeros(3))
    velocity = sea.velocity(world.time + dt)
    gained = velocity - (state.sea if state.sea.size else sea.velocity(world.time))
    if moved_since(world):
        kept = {
            place: state.velocity[place.axis][place.layer] + gained[place.axis]
            for place in sea.driven
        }
        return FarField(kept, state.wake, velocity, gained)
    moving = boundary_velocity(pose_and_cut(world)[0], start.bodies.v)
    field = leak_proof(state.velocity, start.cut, moving, fluid.grid)
    normal, wake = induced(field, sea, state.wake, dt)
    for place, values in brought(field, sea).items():
        normal[place] = normal[place] + values
    return FarField(
        {place: values + velocity[place.axis] for place, values in normal.items()},
        wake,
        velocity,
        gained,
    )
