"""Control volumes of the faces, the volumes that move with them, and their mass and momentum.

The control volume of a face reaches from the middle of one of its cells to that of the other,

    V_f = (V_L + V_R) / 2

so it obeys the same law as the cells, with the means of their fluxes through its sides (Verstappen
and Veldman 2003). A difference of pressures accelerates a face as it should where the volume M_f
that moves with it is near a h^3, of its open part a. So control volumes give parts of theirs to
their neighbours, in pairs, and sums stay: a face that is wholly closed gives all to the opposite
faces of its cells, so that what lies on either side of a thin body stays there; and open ones even
out what they have beyond a h^3, by diffusion along one axis after the other.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from flowborne.fluid.boundary import Boundaries
from flowborne.fluid.ghosts import edge, plane, planes
from flowborne.fluid.grid import Grid, faces_of, inner_product
from flowborne.kernels.arrays import LEAST, Array, Faces, Integers
from flowborne.kernels.control_volumes import Closed, Transfers, share_velocity
from flowborne.kernels.face_masses import find_moving
from flowborne.kernels.faces import weighted_sums

if TYPE_CHECKING:
    from flowborne.kernels.carry import Volumes

NOTHING = 1e-9
"""Part of a cell below which a control volume holds nothing."""

WHOLE = 1.0 - LEAST
"""Part of a cell from which on control volumes count as uncut."""

NONE = np.zeros(0, np.int64)
NONE_CLOSED = Closed(NONE, np.zeros((0, 6), np.int64), np.zeros((0, 6)))
NO_TRANSFERS = Transfers(NONE, NONE, np.zeros(0))


@dataclass(frozen=True)
class ControlVolumes:
    """The control volumes of one geometry.

    cells      (nx, ny, nz) open volume of each cell, m^3
    moving     Faces, M_f, what moves with each face, m^3; 0 at closed ones
    cut        of each axis, (n,) flat indices of those that are not whole
    closed     of each axis
    transfers  of each axis, from V_f to M_f
    staying    by component, dt and what `transport` makes of them for a step in which they stay
    """

    cells: Array
    moving: Faces
    cut: tuple[Integers, Integers, Integers]
    closed: tuple[Closed, Closed, Closed]
    transfers: tuple[Transfers, Transfers, Transfers]
    staying: dict[int, tuple[float, Volumes, Transfers]] = field(
        default_factory=dict, repr=False, compare=False
    )

    def follow(self, velocity: Faces, grid: Grid) -> None:
        """Give closed faces the velocity of their targets, in place."""
        for axis in grid.axes:
            share_velocity(velocity[axis], self.closed[axis])


def control_volumes(
    cells: Array, opened: Faces, grid: Grid, boundaries: Boundaries
) -> ControlVolumes:
    """Control volumes of cells with these open volumes (m^3) and open parts of faces."""
    cells = np.ascontiguousarray(cells)
    found = [moving_volumes(axis, cells, opened, grid, boundaries) for axis in grid.axes]
    if grid.is_slab:
        found.append((np.zeros(grid.face_shape(2)), NONE, NONE_CLOSED, NO_TRANSFERS))
    (u, v, w), cut, closed, transfers = zip(*found, strict=True)
    return ControlVolumes(cells, (u, v, w), cut, closed, transfers)


def moving_volumes(
    component: int, cells: Array, opened: Faces, grid: Grid, boundaries: Boundaries
) -> tuple[Array, Integers, Closed, Transfers]:
    """What moves with the faces across an axis, and what `ControlVolumes` has of them."""
    faces, found = boundaries.faces(component, grid), np.empty(grid.face_shape(component))
    ends, cell = boundaries.normal()[component], grid.cell_volume
    limits = cell, WHOLE, LEAST * cell, NOTHING * cell
    fields = plane(found, grid), plane(cells, grid), planes(opened, grid)
    cut, closed, given = find_moving(*fields, faces, ends, limits)
    if boundaries.periodic()[component]:
        found[edge(component, -1)] = found[edge(component, 0)]
    return found, cut, closed, given


def face_masses(volumes: ControlVolumes, density: float) -> Faces:
    """Mass of the fluid that pressure on each face accelerates, kg; 0 at closed ones."""
    return faces_of([density * v for v in volumes.moving])


def each_once(axis: int, sides: Boundaries) -> tuple[int | slice, ...]:
    """Index of the faces across an axis, without the last ones if they are the first ones."""
    return edge(axis, slice(None, -1 if sides.periodic()[axis] else None))


def fluid_momentum(velocity: Faces, mass: Faces, grid: Grid, sides: Boundaries) -> Array:
    """(3,) linear momentum of the fluid, N s; over the density if volumes are given for masses."""
    total = np.zeros(3)
    for axis in grid.axes:
        own = each_once(axis, sides)
        total[axis] = inner_product(mass[axis][own], velocity[axis][own])
    return total


def momentum_changes(
    fields: tuple[Faces, Faces, Faces],
    volumes: Faces,
    density: float,
    grid: Grid,
    sides: Boundaries,
) -> Array:
    """(5, 3) linear momentum with each of three velocities, what it changes by from the second to
    the third, and the sum of its parts' sizes, N s."""
    sums = np.zeros((5, 3))
    for axis in grid.axes:
        own = each_once(axis, sides)
        held, *flows = (np.ascontiguousarray(f[axis][own]) for f in (volumes, *fields))
        sums[:, axis] = weighted_sums(held, density, *flows)
    return sums


def kinetic_energy(velocity: Faces, mass: Faces, grid: Grid, sides: Boundaries) -> float:
    """Kinetic energy of the fluid, J."""
    squares = faces_of([0.5 * u * u for u in velocity])
    return float(fluid_momentum(squares, mass, grid, sides).sum())
