"""The viscous system over all components and bodies, and its solution (see `viscosity`)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flowborne.fluid.boundary import Boundaries
from flowborne.fluid.ghosts import edge
from flowborne.fluid.grid import Array, Faces, Grid
from flowborne.fluid.jit import kernel
from flowborne.fluid.viscosity import TIED, UNKNOWN, ViscousFaces

Integers = NDArray[np.int64]


@kernel
def apply_component(
    out: Array,
    x: Array,
    kind: NDArray[np.uint8],
    diagonal: Array,
    links: Array,
    wraps: Integers,
) -> None:
    """out = diagonal x - sum of links to neighbours, for one component.

    wraps  (3,) number of distinct faces along each axis where the domain is periodic, else 0
    """
    ni, nj, nk = kind.shape
    for i in range(ni):
        for j in range(nj):
            for k in range(nk):
                out[i, j, k] = diagonal[i, j, k] * x[i, j, k] if kind[i, j, k] == UNKNOWN else 0.0
    for d in range(3):
        ei, ej, ek = int(d == 0), int(d == 1), int(d == 2)
        for i in range(ni):
            for j in range(nj):
                for k in range(nk):
                    coefficient = links[d, i, j, k]
                    if coefficient == 0.0:
                        continue
                    gi, gj, gk = i + ei, j + ej, k + ek
                    at = i if d == 0 else (j if d == 1 else k)
                    if wraps[d] and at == wraps[d] - 1:
                        gi, gj, gk = i - ei * at, j - ej * at, k - ek * at
                    out[i, j, k] -= coefficient * x[gi, gj, gk]
                    out[gi, gj, gk] -= coefficient * x[i, j, k]


@dataclass(frozen=True)
class Walls:
    """Faces beside bodies, listed over all components.

    index   (n,) position among the concatenated faces
    body    (n,) the body beside the face
    arm     (n, 6) velocity of the face for each component of that body's twist
    """

    index: Integers
    body: Integers
    arm: Array


def wall_faces(systems: list[ViscousFaces], nearest: Integers, grid: Grid) -> Walls:
    """Faces with a wall coefficient and faces tied to a body.

    nearest  (nx+1, ny+1, nz+1) nearest body at the nodes
    """
    index, body, arm = [], [], []
    first = 0
    for axis, system in zip(grid.axes, systems, strict=True):
        beside = (system.wall > 0.0) | (system.kind == TIED)
        at = np.nonzero(beside)
        coordinates = grid.face_coordinates(axis)
        places = np.stack([coordinates[d][at[d]] for d in range(3)], axis=1)
        if grid.is_slab:
            places[:, 2] = 0.0
        direction = np.zeros(3)
        direction[axis] = 1.0
        index.append(first + np.flatnonzero(beside))
        body.append(nearest[at])
        unit = np.broadcast_to(direction, places.shape)
        arm.append(np.concatenate([unit, np.cross(places, direction)], axis=1))
        first += system.kind.size
    return Walls(np.concatenate(index), np.concatenate(body), np.concatenate(arm))


def columns_of(body: Integers) -> Integers:
    """(n, 6) places of each entry's body components in the concatenated twist."""
    return 6 * body[:, None] + np.arange(6)


class ViscousSystem:
    """The assembled system over all components and bodies.

    systems   of each component (see `assemble_viscosity`)
    nearest   (nx+1, ny+1, nz+1) nearest body at the nodes
    response  (6 nb, 6 nb) M: twist that a unit wrench impulse gives, 1/kg; None without bodies
    """

    def __init__(
        self,
        systems: list[ViscousFaces],
        nearest: Integers,
        response: Array | None,
        grid: Grid,
        boundaries: Boundaries,
        dt: float,
    ) -> None:
        self.systems, self.grid, self.dt = systems, grid, dt
        periodic = boundaries.periodic()
        self.wraps = np.array([n if p else 0 for n, p in zip(grid.shape, periodic, strict=True)])
        self.kind = np.concatenate([system.kind.ravel() for system in systems])
        self.unknown = self.kind == UNKNOWN
        self.diagonal = np.concatenate([system.diagonal.ravel() for system in systems])
        self.walls = wall_faces(systems, nearest, grid)
        place = self.walls.index
        wall = np.concatenate([system.wall.ravel() for system in systems])[place]
        mass = dt * np.concatenate([system.mass.ravel() for system in systems])[place]
        self.tied = self.kind[place] == TIED
        self.weight = np.where(self.tied, mass / dt, wall)
        self.columns = columns_of(self.walls.body)
        size = 6 * (int(self.walls.body.max()) + 1) if place.size else 6
        self.size = size if response is None else response.shape[0]
        drag = np.zeros((self.size, self.size))
        blocks = dt * self.weight[:, None, None] * self.walls.arm[:, :, None]
        rows = self.columns[:, :, None], self.columns[:, None, :]
        np.add.at(drag, rows, blocks * self.walls.arm[:, None, :])
        self.response = np.zeros_like(drag) if response is None else response
        self.share = np.linalg.inv(np.eye(self.size) + self.response @ drag)
        self.low_rank = dt * self.share @ self.response
        self.drag = drag

    def wrench(self, velocity: Array, tied: bool) -> Array:
        """(6 nb,) sum of weight x velocity x arm over the tied or the other wall faces, N."""
        chosen = self.tied == tied
        total = np.zeros(self.size)
        force = (self.weight * velocity[self.walls.index])[chosen, None] * self.walls.arm[chosen]
        np.add.at(total, self.columns[chosen], force)
        return total

    def at_faces(self, twist: Array) -> Array:
        """(n,) rigid velocity of the bodies at the wall faces, m/s."""
        return np.einsum("nm,nm->n", self.walls.arm, twist[self.columns])

    def apply(self, x: Array) -> Array:
        """The matrix times x over the concatenated faces."""
        out = np.empty_like(x)
        first = 0
        for system in self.systems:
            shape, count = system.kind.shape, system.kind.size
            part = slice(first, first + count)
            apply_component(
                out[part].reshape(shape),
                x[part].reshape(shape),
                system.kind,
                system.diagonal,
                system.links,
                self.wraps,
            )
            first += count
        if self.low_rank.any():
            back = self.low_rank @ self.wrench(x, tied=False)
            pull = np.where(self.tied, 0.0, self.weight * self.at_faces(back))
            out[self.walls.index] -= pull
        return out

    def solve(self, velocity: Faces, twist: Array, tolerance: float) -> tuple[Faces, Array, int]:
        """Velocity after viscosity, and the impulse that it gave to each body.

        velocity   Faces u*, m/s
        twist      (6 nb,) s*: the bodies' twists without this impulse
        tolerance  relative residual
        returns    Faces; (6 nb,) wrench impulse about the origin, N s and N m s; iterations
        """
        start = np.concatenate([velocity[axis].ravel() for axis in self.grid.axes])
        mass = np.concatenate([system.mass.ravel() for system in self.systems])
        given = np.concatenate([system.given.ravel() for system in self.systems])
        turning = np.concatenate([system.turning.reshape(-1, 3) for system in self.systems])
        carried = self.dt * self.wrench(start, tied=True)
        rest = self.share @ (twist + self.response @ carried)
        expected = rest + self.low_rank @ self.wrench(start, tied=False)
        rhs = np.where(self.unknown, mass * start + given, 0.0)
        rhs[self.walls.index] += np.where(self.tied, 0.0, self.weight * self.at_faces(rest))
        spin = expected[self.columns[:, 3:]]
        turn_force = np.einsum("nm,nm->n", turning[self.walls.index], spin)
        rhs[self.walls.index] -= np.where(self.tied, 0.0, turn_force)
        x, iterations = self._conjugate_gradients(
            rhs, np.where(self.unknown, start, 0.0), tolerance
        )
        after = rest + self.low_rank @ self.wrench(x, tied=False)
        impulse = self.dt * self.wrench(x, tied=False) + carried - self.drag @ after
        result = np.where(self.unknown, x, start)
        fixed = self.walls.index[self.tied]
        result[fixed] = self.at_faces(after)[self.tied]
        return self._split(result, velocity), impulse, iterations

    def _conjugate_gradients(self, rhs: Array, x: Array, tolerance: float) -> tuple[Array, int]:
        inverse = np.where(self.unknown, 1.0 / np.where(self.unknown, self.diagonal, 1.0), 0.0)
        residual = rhs - self.apply(x)
        goal = tolerance * np.sqrt(rhs @ (inverse * rhs))
        direction = inverse * residual
        norm = residual @ direction
        iterations = 0
        while np.sqrt(norm) > goal and iterations < 10 * int(np.sqrt(rhs.size)) + 100:
            image = self.apply(direction)
            step = norm / (direction @ image)
            x = x + step * direction
            residual = residual - step * image
            scaled = inverse * residual
            previous, norm = norm, residual @ scaled
            direction = scaled + norm / previous * direction
            iterations += 1
        return x, iterations

    def _split(self, values: Array, like: Faces) -> Faces:
        """Concatenated components as faces; periodic ends joined; a slab's z as it was."""
        parts = [like[0], like[1], like[2].copy()]
        first = 0
        for axis in self.grid.axes:
            shape = self.grid.face_shape(axis)
            count = int(np.prod(shape))
            parts[axis] = values[first : first + count].reshape(shape)
            if self.wraps[axis]:
                parts[axis][edge(axis, -1)] = parts[axis][edge(axis, 0)]
            first += count
        return parts[0], parts[1], parts[2]
