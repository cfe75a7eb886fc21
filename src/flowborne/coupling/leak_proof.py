"""The leak-proof field (paper, section 6, item 4): it carries the fluid past moving bodies.

The bodies go from x^n to x^{n+1} in a step, and what they leave or take up of each cell flows
through its faces:

    sum over the faces of a cell of q  =  -(V^{n+1} - V^n) / dt + sources

One Poisson solve on the mean open parts of both ends makes the fluxes q = a A u of the velocity
half a step on do that, exactly where the paper projects with the bodies' effective velocity
(x^{n+1} - x^n) / dt.

A cell that a thin body passes over is set aside, so that nothing flows through the body (`swept`).

A closed region of fluid keeps its volume, but that of the cells around a moving body wavers a
little on any grid: there all volumes at the end are scaled alike, by 1e-5 to 1e-3.
"""

from __future__ import annotations

import numpy as np

from flowborne.coupling.cut import Departure
from flowborne.coupling.fractions import Geometry
from flowborne.coupling.operators import beyond_sides
from flowborne.coupling.swept import swept_cells
from flowborne.fluid.boundary import Boundaries
from flowborne.fluid.ghosts import impose_sides
from flowborne.fluid.grid import Array, Faces, Grid
from flowborne.fluid.projection import PressureGradient
from flowborne.kernels.faces import mean_flux
from flowborne.kernels.projection import net_out
from flowborne.solvers.pressure import PressureSystem

TOLERANCE = 1e-9
"""Relative residual at which the solve ends, of hypothetical steps too: what is left of it stays in
the volumes until the next step, and the smallest of them must not feel it."""

LEFT = 1e-10
"""Parts of a whole cell that may be left of the volume of all cells (the root of the sum of their
squares), where that is reached first."""

MOST = 2.0
"""Factor on the volumes of a closed region beyond which it is a pocket that bodies crush, and is
left to them. One that they open holds nothing until it is reached."""

FILLED = 1e-300
"""Part of a whole cell that is left where a body fills it and rounding leaves exactly nothing: one
of volume 0 counts as never filled with fluid, and would not pass on what flows into it."""


def leak_proof_flux(
    departure: Departure, after: Geometry, time: float, dt: float
) -> tuple[Faces, Array]:
    """Volume fluxes through all faces over a step, m^3/s, and the volumes that they lead to, m^3.

    departure  the start of the step
    after      the cut grid at its end
    time       s in its middle
    """
    state, before, cells = departure.state, departure.cut, departure.volumes.cells
    grid, sides = departure.fluid.grid, departure.fluid.boundaries
    flux, weights = grid.zeros_faces(), grid.zeros_faces()
    for axis in grid.axes:
        ends = before.open[axis], after.open[axis]
        moving = state.velocity[axis], state.velocity_change[axis]
        mean_flux(flux[axis], weights[axis], *moving, *ends, grid.face_area, stiffness(grid))
    dipoles = sides.dipoles(grid)
    places = [] if dipoles is None else dipoles.places
    uncut = [weights[p.axis][p.layer] == stiffness(grid) for p in places]
    drive_sides(flux, weights, grid, sides, time)
    swept = swept_cells(before, after, cells, grid, sides)
    start, end = swept.set_aside(flux, weights, cells, after.volume)
    if dipoles is not None:
        through = [weights[p.axis][p.layer] > 0.0 for p in places]  # not of cells set aside
        dipoles = dipoles.on([a & b for a, b in zip(uncut, through, strict=True)])
    gradient = PressureGradient(weights, 2.0 * stiffness(grid), dipoles, grid, sides)
    beyond = beyond_sides(dipoles, gradient.whole)
    system = PressureSystem(weights, sides.periodic(), beyond=beyond)
    rhs, net = volume_rates(system, start, end, departure.rate, dt), np.empty(grid.shape)
    net_out(net, *flux)
    rhs += net
    left = LEFT * grid.cell_volume / dt
    solution = system.solve(-rhs, None, tolerance=TOLERANCE, absolute=left)
    gradient.subtract(flux, solution.pressure, 1.0)
    net_out(net, *flux)
    later = start + dt * (departure.rate - net)
    swept.put_back(flux, later, end, dt)
    later[(later == 0.0) & (cells != 0.0)] = FILLED * grid.cell_volume
    return flux, later


def stiffness(grid: Grid) -> float:
    """Weight of a wholly open face, (a A)^2 / (a V): of unit density."""
    return grid.face_area**2 / grid.cell_volume


def drive_sides(flux: Faces, weights: Faces, grid: Grid, sides: Boundaries, time: float) -> None:
    """Set what the sides of the domain let through, and the weights there, in place.

    Half a control volume belongs to a face on a side; one whose flux is prescribed has no weight.
    """
    impose_sides(flux, grid, sides, time)
    for place, side in sides.around(grid):
        through, weight = (field[place.axis][place.layer] for field in (flux, weights))
        if side.prescribes:
            through *= weight * (grid.face_area / stiffness(grid))
        if not side.joined:
            weight *= 2.0 * side.pressure_weight(place)


def volume_rates(
    system: PressureSystem, cells: Array, later: Array, rate: Array, dt: float
) -> Array:
    """(nx, ny, nz) what the volume of each cell grows by less what is brought into it, m^3/s; sums
    to 0 over every closed region."""
    target = later.copy()
    if system.regions:
        label = system.closed_regions()
        inside = label >= 0
        number = label[inside]
        held = np.bincount(number, cells[inside] + dt * rate[inside], system.regions)
        wanted = np.bincount(number, later[inside], system.regions)
        factor = np.divide(held, wanted, out=np.ones(system.regions), where=wanted > 0.0)
        factor[factor > MOST] = 1.0
        target[inside] *= factor[number]
    return (target - cells) / dt - rate
