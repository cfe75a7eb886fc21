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

from flowborne.coupling.fractions import Geometry
from flowborne.coupling.swept import swept_cells
from flowborne.coupling.world import Fluid
from flowborne.fluid.ghosts import edge, impose_sides
from flowborne.fluid.grid import Array, Faces, faces_of
from flowborne.fluid.projection import accelerated, face_weights, push
from flowborne.kernels.outflow import outflow
from flowborne.solvers.pressure import PressureSystem

TOLERANCE = 1e-9
"""Relative residual of the solve, of hypothetical steps too: what is left of it stays in the
volumes until the next step, and the smallest of them must not feel it."""

MOST = 2.0
"""Factor on the volumes of a closed region beyond which it is a pocket that bodies crush or open,
and is left to them."""


def leak_proof_flux(
    velocity: Faces,
    before: Geometry,
    after: Geometry,
    cells: Array,
    rate: Array,
    fluid: Fluid,
    time: float,
    dt: float,
) -> tuple[Faces, Array]:
    """Volume fluxes through all faces over a step, m^3/s, and the volumes that they lead to, m^3.

    velocity       Faces at the middle of the step, m/s
    before, after  the cut grid at both ends of the step
    cells          (nx, ny, nz) volumes at the start, m^3
    rate           (nx, ny, nz) what mouths and sources bring, m^3/s
    time           s at the middle of the step
    """
    grid, sides = fluid.grid, fluid.boundaries
    opened = faces_of([0.5 * (a + b) for a, b in zip(before.open, after.open, strict=True)])
    swept = swept_cells(before, after, cells, grid, sides)
    start, end = swept.set_aside(opened, cells, after.volume)
    mass = unit_mass(opened, fluid)
    system = PressureSystem(face_weights(opened, mass, grid, sides), sides.periodic())
    u = faces_of([values.copy() for values in velocity])
    impose_sides(u, grid, sides, time)
    rhs = volume_rates(system, start, end, rate, dt)
    net = np.empty(grid.shape)
    outflow(net, *u, *opened)
    rhs += grid.face_area * net
    solution = system.solve(-rhs, None, tolerance=TOLERANCE)
    push(u, accelerated(opened, mass, grid), solution.pressure, grid, sides, 1.0)
    flux = faces_of([grid.face_area * a * v for a, v in zip(opened, u, strict=True)])
    outflow(net, *u, *opened)
    later = start + dt * (rate - grid.face_area * net)
    swept.put_back(flux, later, dt)
    return flux, later


def unit_mass(opened: Faces, fluid: Fluid) -> Faces:
    """a V of every face, half of it on the sides of the domain."""
    masses = []
    for axis in range(3):
        mass = fluid.grid.cell_volume * opened[axis]
        if not fluid.boundaries.periodic()[axis]:
            mass[edge(axis, 0)] *= 0.5
            mass[edge(axis, -1)] *= 0.5
        masses.append(mass)
    return faces_of(masses)


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
        factor[(factor > MOST) | (factor * MOST < 1.0)] = 1.0
        target[inside] *= factor[number]
    return (target - cells) / dt - rate
