"""Momentum in flux form on moving control volumes: kept exactly (see `fluid.transport`)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flowborne.coupling.advection.scheme import Advection, AdvectionResult, Departure
from flowborne.coupling.inlets import (
    after_drinking,
    cells_with_inlets,
    inlets_across,
    taken_by,
)
from flowborne.fluid.eddies import damp_eddies
from flowborne.fluid.grid import Faces, faces_of
from flowborne.fluid.transport import Transport, carry_component
from flowborne.kernels.faces import still_to_come


@dataclass(frozen=True)
class FluxForm(Advection):
    """Every component on its moving control volumes; nothing is lost."""

    explicit_half_pressure = True

    def carry(self, start: Departure, velocity: Faces, transport: Transport) -> AdvectionResult:
        grid, sides, state, jets = start.grid, start.sides, start.state, start.jets
        dt, arrived = transport.dt, [np.zeros(u.shape) for u in velocity[len(grid.axes) :]]
        crossed, stopped, gained = np.zeros((3, 3))
        drunk = [np.zeros(3) for _ in jets]
        cells = cells_with_inlets(jets, start.sources)
        for axis in grid.axes:
            inlets = inlets_across(axis, cells, jets, start.sources, grid, sides)
            along = np.empty(velocity[axis].shape)
            still_to_come(along, state.acceleration[axis], velocity[axis], state.velocity[axis], dt)
            carried = carry_component(velocity[axis], along, axis, transport, inlets, grid, sides)
            arrived.insert(axis, carried.velocity)
            crossed[axis] = start.density * carried.crossed
            stopped[axis] = start.density * carried.held
            brought = dt * float(inlets.gain @ inlets.velocity)
            gained[axis] = start.density * (brought - float(carried.drained.sum()))
            for jet, taken in zip(jets, drunk, strict=True):
                taken[axis] = taken_by(jet, axis, inlets, carried.drained, grid, sides)
        if start.inviscid:
            damp_eddies(faces_of(arrived), transport, grid, sides)
        for place, side in sides.around(grid):
            u = arrived[place.axis]
            before = u[place.layer].copy()
            side.impose(u, place, transport.time + dt)
            if not side.joined:
                mass = start.density * transport.after.moving[place.axis][place.layer]
                stopped[place.axis] += float((mass * (u[place.layer] - before)).sum())
        return AdvectionResult(
            faces_of(arrived),
            transport.after,
            np.zeros(3),
            crossed,
            stopped,
            gained,
            tuple(after_drinking(jet, taken, dt) for jet, taken in zip(jets, drunk, strict=True)),
        )
