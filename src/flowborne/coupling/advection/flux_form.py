"""Momentum in flux form on moving control volumes: kept exactly (see `fluid.transport`)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flowborne.coupling.advection.scheme import Advection, AdvectionResult, Departure
from flowborne.coupling.inlets import after_drinking, inlets_across, taken_by
from flowborne.fluid.ghosts import impose_sides
from flowborne.fluid.grid import Faces
from flowborne.fluid.momentum import face_masses, fluid_momentum
from flowborne.fluid.transport import Transport, beside_faces, carry_component
from flowborne.kernels.faces import still_to_come


@dataclass(frozen=True)
class FluxForm(Advection):
    """Every component on its moving control volumes; nothing is lost."""

    explicit_half_pressure = True

    def carry(self, start: Departure, velocity: Faces, transport: Transport) -> AdvectionResult:
        grid, sides, state, jets = start.grid, start.sides, start.state, start.jets
        dt, arrived = transport.dt, grid.zeros_faces()
        crossed, held, gained = np.zeros((3, 3))
        drunk = [np.zeros(3) for _ in jets]
        lasting = transport.lasting(grid)
        for axis in grid.axes:
            inlets = inlets_across(axis, jets, start.sources, grid, sides)
            along = np.empty_like(arrived[axis])
            still_to_come(along, state.acceleration[axis], velocity[axis], state.velocity[axis], dt)
            if lasting is not None:
                along *= beside_faces(lasting, axis, sides)
            carried = carry_component(velocity[axis], along, axis, transport, inlets, grid, sides)
            arrived[axis][:] = carried.velocity
            crossed[axis] = start.density * carried.crossed
            held[axis] = start.density * carried.held
            brought = dt * float(inlets.gain @ inlets.velocity)
            gained[axis] = start.density * (brought - float(carried.drained.sum()))
            for jet, taken in zip(jets, drunk, strict=True):
                taken[axis] = taken_by(jet, axis, inlets, carried.drained, grid, sides)
        masses = face_masses(transport.after, start.density)
        reached = fluid_momentum(arrived, masses, grid, sides)
        impose_sides(arrived, grid, sides, transport.time + dt)
        return AdvectionResult(
            arrived,
            transport.after,
            np.zeros(3),
            crossed,
            held + fluid_momentum(arrived, masses, grid, sides) - reached,
            gained,
            tuple(after_drinking(jet, taken, dt) for jet, taken in zip(jets, drunk, strict=True)),
        )
