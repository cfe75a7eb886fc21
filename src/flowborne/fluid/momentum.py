"""Mass, momentum and kinetic energy of the fluid on its control volumes."""

from __future__ import annotations

import numpy as np

from flowborne.fluid.boundary import Boundaries
from flowborne.fluid.control_volumes import ControlVolumes
from flowborne.fluid.ghosts import edge
from flowborne.fluid.grid import Array, Faces, Grid, faces_of, inner_product
from flowborne.kernels.faces import weighted_change


def face_masses(volumes: ControlVolumes, density: float) -> Faces:
    """Mass of the fluid that pressure on each face accelerates, kg; 0 at closed ones."""
    return faces_of([density * v for v in volumes.moving])


def each_once(axis: int, sides: Boundaries) -> tuple[int | slice, ...]:
    """Index of the faces across an axis, without the last ones if they are the first ones."""
    return edge(axis, slice(None, -1 if sides.periodic()[axis] else None))


def fluid_momentum(velocity: Faces, mass: Faces, grid: Grid, sides: Boundaries) -> Array:
    """(3,) linear momentum of the fluid, N s."""
    total = np.zeros(3)
    for axis in grid.axes:
        own = each_once(axis, sides)
        total[axis] = inner_product(mass[axis][own], velocity[axis][own])
    return total


def momentum_change(
    before: Faces, after: Faces, mass: Faces, grid: Grid, sides: Boundaries
) -> tuple[Array, float]:
    """(3,) what linear momentum changes by between two velocities, and the sum of its parts' sizes,
    N s."""
    total, size = np.zeros(3), 0.0
    for axis in grid.axes:
        own = each_once(axis, sides)
        fields = (np.ascontiguousarray(f[axis][own]) for f in (mass, before, after))
        total[axis], change = weighted_change(*fields)
        size += change
    return total, size


def kinetic_energy(velocity: Faces, mass: Faces, grid: Grid, sides: Boundaries) -> float:
    """Kinetic energy of the fluid, J."""
    squares = faces_of([0.5 * u * u for u in velocity])
    return float(fluid_momentum(squares, mass, grid, sides).sum())
