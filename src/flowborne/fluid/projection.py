"""Divergence and gradient on cut cells: the two sides of the pressure equation.

With face areas A, open fractions a and p^ = p dt,

    net outflow of a cell   D u  = sum over its faces of a A (u . outward)
    velocity change         u   -= a A (p^_upper - p^_lower) / m
    weights of the matrix   w    = (a A)^2 / m

for the mass m of the fluid that belongs to a face, so that the momentum taken from it, m du, is
what its two cells push with.
"""

from __future__ import annotations

from dataclasses import dataclass

from flowborne.fluid.boundary import Boundaries
from flowborne.fluid.dipoles import Dipoles
from flowborne.fluid.ghosts import plane
from flowborne.fluid.grid import Grid
from flowborne.kernels.arrays import Array, Faces
from flowborne.kernels.faces import accelerate, weigh
from flowborne.kernels.projection import subtract_gradient

EVEN = 1e-9
"""Relative difference of masses of uncut faces: solves leave some 1e-12 in the volumes."""


def accelerated(
    opened: Faces, volumes: Faces, density: float, grid: Grid, boundaries: Boundaries
) -> Faces:
    """a A / m of each face: what a difference of pressures accelerates it by, 1/(kg/m^2); on the
    sides of the domain the part of it that they leave to the pressure.

    volumes  of the fluid (kg/m^3) that moves with each face, m^3; 0 where no pressure acts
    """
    rates = grid.empty_faces()
    for axis in grid.axes:
        accelerate(rates[axis], opened[axis], volumes[axis], density, grid.face_area)
    for place, weight in boundaries.pressure_weights(grid):
        rates[place.axis][place.layer] *= weight
    return rates


def face_weights(opened: Faces, rate: Faces, grid: Grid) -> Faces:
    """Weights w = a A rate of the pressure matrix, of a A / m; see the module."""
    weights = grid.empty_faces()
    for axis in grid.axes:
        weigh(weights[axis], opened[axis], rate[axis], grid.face_area)
    return weights


@dataclass(frozen=True)
class PressureGradient:
    """What pressure does to the velocity of faces.

    rate     Faces, see `accelerated`
    whole    rate of an uncut face on a side with p = 0 on it
    dipoles  what uncut faces of far sides answer besides; None without any
    """

    rate: Faces
    whole: float
    dipoles: Dipoles | None
    grid: Grid
    boundaries: Boundaries

    def subtract(
        self, velocity: Faces, pressure: Array, scale: float, out: Faces | None = None
    ) -> None:
        """Subtract scale rate (p_upper - p_lower) on every face, in place if there is no `out`; see
        `subtract_gradient`."""
        grid, periodic, out = self.grid, self.boundaries.periodic(), out or velocity
        p = plane(pressure, grid)
        for axis in grid.axes:
            later, u, rate = (plane(f[axis], grid) for f in (out, velocity, self.rate))
            subtract_gradient((later, u, rate), p, axis + grid.is_slab, scale, periodic[axis])
        for place, answer in self.dipoles.answer(pressure) if self.dipoles else ():
            change = scale * self.whole * answer
            out[place.axis][place.layer] += change if place.upper else -change


def pressure_gradient(
    opened: Faces, volumes: Faces, density: float, grid: Grid, boundaries: Boundaries
) -> PressureGradient:
    """What pressure does to faces of these open parts, and volumes (m^3) that move with them, of a
    fluid (kg/m^3)."""
    rate, dipoles = (
        accelerated(opened, volumes, density, grid, boundaries),
        boundaries.dipoles(grid),
    )
    held = 0.5 * density * grid.cell_volume
    if dipoles is not None:
        sides = [
            (opened[p.axis][p.layer], density * volumes[p.axis][p.layer]) for p in dipoles.places
        ]
        dipoles = dipoles.on([(o == 1.0) & (abs(m - held) < EVEN * held) for o, m in sides])
    return PressureGradient(rate, grid.face_area / held, dipoles, grid, boundaries)
