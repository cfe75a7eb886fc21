"""Friction between fluid and bodies: the viscous system over all components and bodies, and its
solution (see `fluid.viscosity`).

With B the velocity of the wall points and C the couple of the bodies' own rotation,

    (m/dt + L + W) u - W B s = m u*/dt + given          s = s* + M dt (B^T W (u - B s) - C s)

where L are the links and M the motion that a unit impulse gives. W is diagonal but at corners. The
bodies are eliminated exactly,

    s = s* + N dt (B^T W (u - B s*) - C s*)             N = (M^-1 + dt (B^T W B + C))^-1

and what is left for u is symmetric positive definite, with a term of low rank (Robinson-Mosher,
Schroeder and Fedkiw 2011 do the same).

Method: docs/method/viscosity.md.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, fields, replace
from functools import partial

import numpy as np
from scipy.sparse import block_diag, csr_array

from flowborne.coupling.creeping import creeps
from flowborne.coupling.flesh import skin_at
from flowborne.coupling.fractions import Geometry
from flowborne.coupling.mouths import Jet, skin_slip
from flowborne.coupling.operators import boundary_velocity, generalised, pressure_push
from flowborne.coupling.report import timed
from flowborne.coupling.world import World
from flowborne.fluid.boundary import Boundaries
from flowborne.fluid.control_volumes import ControlVolumes, face_masses
from flowborne.fluid.ghosts import edge
from flowborne.fluid.grid import Grid, faces_of
from flowborne.fluid.projection import PressureGradient
from flowborne.fluid.viscosity import OpenParts, ViscousFaces, assemble_viscosity
from flowborne.kernels.arrays import Array, Faces, Integers
from flowborne.kernels.corner_friction import AROUND
from flowborne.kernels.sparse_rows import add_rows, sum_rows
from flowborne.kernels.viscosity import apply_component
from flowborne.solids.driven import Driven
from flowborne.solids.dynamics import Kinematics
from flowborne.solids.scratch import cross
from flowborne.solvers.conjugate_gradients import conjugate_gradients, spread
from flowborne.solvers.mobility import Answering, Drag
from flowborne.solvers.v_cycle import VCycle

TOLERANCE = 1e-12
"""Relative residual of the viscous solve."""

MOST = 20
"""Iterations for each cell along the longest edge of the domain, at most; and at least as many as
for a domain of MOST cells."""


@dataclass(frozen=True)
class Walls:
    """Pieces of wall beside faces, and faces around corners, listed over all components.

    index   (n,) position among the concatenated faces; a face may have several pieces
    weight  (n, n) W, kg/s
    body    (n,) the body
    columns (n, m) entries of the motion that move the point, the twist of its body unless told
    arm     (n, m) velocity of the point along the face's axis for each of them
    across  (n, 3) unit vector of the axis that the face is across
    point   (n, 3) middle of the piece, or centre of the open part of a face around a corner, m
    gap     (n, 3) from there to the centre of the face's open part, m
    """

    index: Integers
    weight: csr_array
    body: Integers
    columns: Integers
    arm: Array
    across: Array
    point: Array
    gap: Array

    def couples(self, bodies: int) -> Array:
        """(bodies, 3, 3) C: couple that each body feels for unit spin about each axis, N m s.

        Friction in proportion to the velocity relative to the body at the face, instead of that
        at the wall point, is larger by this; about any point for a closed surface, else about
        the middle of its wall points. Symmetric but for the coarseness of the cells, and made so.
        """
        own = self.body < bodies
        body, point, across = self.body[own], self.point[own], self.across[own]
        weight, spin = self.weight.diagonal()[own, None], cross(self.gap[own], across)
        count = np.maximum(np.bincount(body, minlength=bodies), 1)[:, None]
        lever = cross(point - (summed(point, body, bodies) / count)[body], across)
        products = (weight * lever)[:, :, None] * spin[:, None]
        couple = summed(products.reshape(-1, 9), body, bodies).reshape(-1, 3, 3)
        share, axes = np.linalg.eigh(0.5 * (couple + couple.swapaxes(1, 2)))
        return np.asarray((axes * np.maximum(share, 0.0)[:, None]) @ axes.swapaxes(1, 2))

    def drag(self, couples: Array, size: int) -> Drag:
        """(k, k) B^T W B + C; dense where there are bodies alone.

        couples  (bodies, 3, 3) C;  size  k
        """
        bodies = len(couples)
        blocks = np.zeros((bodies, 6, 6))
        blocks[:, 3:, 3:] = couples
        if size > 6 * bodies:
            count, entries = self.arm.shape
            row = np.repeat(np.arange(count), entries)
            arms = csr_array((self.arm.ravel(), (row, self.columns.ravel())), shape=(count, size))
            rest = csr_array((size - 6 * bodies, size - 6 * bodies))
            couple = block_diag([*blocks, rest], format="csr")
            return csr_array(arms.T @ (self.weight @ arms) + couple)
        drag, pull = np.zeros((bodies, 6, bodies, 6)), self.weight @ self.arm
        for body in range(bodies):
            own = self.body == body
            drag[body, :, body] = blocks[body] + pull[own].T @ self.arm[own]
        return drag.reshape(size, size)


def summed(values: Array, body: Integers, bodies: int) -> Array:
    """(bodies, m) sums of values (n, m) by their bodies (n,)."""
    return np.stack([np.bincount(body, column, bodies) for column in values.T], axis=1)


def walls_of(systems: list[ViscousFaces], cut: Geometry, grid: Grid) -> Walls:
    """The walls of all components on the bodies in the grid."""
    own = zip(grid.axes, systems, strict=True)
    parts = [walls_across(axis, system, cut, grid) for axis, system in own]
    names = [field.name for field in fields(Walls) if field.name != "weight"]
    joined = {name: np.concatenate([part[name] for part in parts]) for name in names}
    return Walls(**joined, weight=weights(systems))


def walls_across(axis: int, system: ViscousFaces, cut: Geometry, grid: Grid) -> dict[str, Array]:
    """The pieces of wall of the faces across `axis`, and those around corners, as in `Walls` but
    for the weights; each belongs to the body nearest to one of its nodes."""
    around, _, corner_node = system.corners
    index = np.concatenate([system.beside, around.ravel()])
    at = np.stack(np.unravel_index(index, system.kind.shape), axis=1)
    coordinates = grid.face_coordinates(axis)
    point = np.stack([coordinates[d][at[:, d]] for d in range(3)], axis=1)
    if grid.is_slab:
        point[:, 2] = 0.0
    point[: system.beside.size] += system.place
    others = [d for d in range(3) if d != axis]
    met = system.beside.size
    point[met:, others] += system.centre.reshape(2, -1)[:, index[met:]].T
    nodes = np.concatenate([system.node, np.repeat(corner_node, AROUND)])
    body = cut.nearest.reshape(-1)[nodes]
    point = cut.images.at_bodies(point, body)
    across = np.tile(np.eye(3)[axis], (index.size, 1))
    return {
        "index": system.first + index,
        "body": body,
        "columns": 6 * body[:, None] + np.arange(6),
        "arm": np.concatenate([across, cross(point, across)], axis=1),
        "across": across,
        "point": point,
        "gap": np.concatenate([system.gap, np.zeros((index.size - met, 3))]),
    }


def weights(systems: list[ViscousFaces]) -> csr_array:
    """(n, n) W: walls and corners of every component."""
    values, columns, entries, size = [], [], [], 0
    for system in systems:
        walls, around = system.wall.size, system.corners.faces.size
        faces = np.arange(size, size + walls + around)
        corners = np.repeat(faces[walls:].reshape(-1, 1, AROUND), AROUND, axis=1)
        values += [system.wall, system.corners.matrix.ravel()]
        columns += [faces[:walls], corners.ravel()]
        entries.append(np.repeat([1, AROUND], [walls, around]))
        size += faces.size
    starts = np.append(0, np.cumsum(np.concatenate(entries)))
    return csr_array((np.concatenate(values), np.concatenate(columns), starts), (size, size))


def cycle_on(system: ViscousFaces, wraps: Integers) -> VCycle:
    """A V-cycle on the links of a component and what its diagonal has besides."""
    shape = system.kind.shape
    sizes = [int(w) or n for w, n in zip(wraps, shape, strict=True)]
    own = tuple(slice(0, n) for n in sizes)
    weights = []
    for d in range(3):
        weight = np.zeros([n + (a == d) for a, n in enumerate(sizes)])
        upper = [slice(0, n) for n in sizes]
        upper[d] = slice(1, None)
        weight[tuple(upper)] = system.links[d][own]
        if wraps[d]:
            weight[edge(d, 0)] = weight[edge(d, -1)]
        weights.append(weight)
    rest = system.diagonal[own].copy()
    for d in range(3):
        rest -= weights[d][edge(d, slice(1, None))] + weights[d][edge(d, slice(None, -1))]
    return VCycle(faces_of(weights), np.maximum(rest, 0.0), system.diagonal[own], wraps > 0)


def between_faces(systems: list[ViscousFaces], scale: Array) -> tuple[Integers, csr_array]:
    """The faces that corners couple, and what W has between them, scaled on both sides.

    scale  of the concatenated faces
    """
    around = np.concatenate([system.first + system.corners.faces for system in systems])
    between = np.concatenate([system.corners.matrix for system in systems])
    between = between * (1.0 - np.eye(AROUND))
    between *= scale[around][:, :, None]
    between *= scale[around][:, None, :]
    faces, place = np.unique(around, return_inverse=True)
    row = np.repeat(place.reshape(-1, AROUND, 1), AROUND, axis=2)
    at = row.ravel(), row.swapaxes(1, 2).ravel()
    return faces, csr_array((between.ravel(), at), (faces.size, faces.size))


class ViscousSystem:
    """The assembled system over all components and bodies.

    systems   of each component (see `assemble_viscosity`)
    walls     of all components (see `walls_of`)
    size      k, of the motion; bodies, whose twists it begins with
    answering how they answer a drag D (k, k), kg
    """

    def __init__(
        self,
        systems: list[ViscousFaces],
        walls: Walls,
        size: int,
        bodies: int,
        answering: Callable[[Drag], Answering],
        grid: Grid,
        boundaries: Boundaries,
        dt: float,
    ) -> None:
        self.systems, self.walls, self.size, self.grid, self.dt = systems, walls, size, grid, dt
        self.wraps = np.array(grid.shape) * np.array(boundaries.periodic())
        self.mass, self.diagonal, self.given = systems[0].all
        self.root, self.held = np.sqrt(self.diagonal), self.diagonal == 0.0
        self.scale = np.divide(1.0, self.root, out=np.zeros(self.root.size), where=~self.held)
        self.product = spread(self.root.size)
        self.most = MOST * max(MOST, *grid.shape)
        self.couples = walls.couples(bodies)
        self.answer_by(answering)
        count, entries = walls.arm.shape
        scale = self.scale[walls.index]
        pull = scale[:, None] * (walls.weight @ walls.arm)
        starts = np.arange(0, count * entries + 1, entries)
        self.rows = walls.index, starts, walls.columns.ravel(), pull.ravel()
        self.corner_faces, self.corners = between_faces(systems, self.scale)
        self.cycles: list[VCycle] = []  # of each component, where the flow creeps
        self.last: Array | None = None  # solution, for the next one there

    def answer_by(self, answering: Callable[[Drag], Answering]) -> None:
        """Let the bodies answer the drag so from now on."""
        self.answer = answering(self.dt * self.walls.drag(self.couples, self.size))

    def yields(self, opened: Faces) -> Array:
        """(nx, ny, nz) what friction lets out of each cell per time and unit pressure, the sum of
        (a A)^2 / D over its faces for the friction D on each: V / mu in the bulk."""
        out = np.zeros(self.grid.shape)
        for axis, system in zip(self.grid.axes, self.systems, strict=True):
            friction, area = system.diagonal - system.mass, opened[axis] * self.grid.face_area
            flow = np.divide(area**2, friction, out=np.zeros(area.shape), where=friction > 0.0)
            out += flow[edge(axis, slice(None, -1))] + flow[edge(axis, slice(1, None))]
        return out

    def at_walls(self, twist: Array) -> Array:
        """(n,) B s: velocity of the bodies at the wall faces, m/s."""
        return np.einsum("nm,nm->n", self.walls.arm, twist[self.walls.columns])

    def apply(self, x: Array) -> Array:
        """The matrix with the bodies eliminated, scaled to a diagonal of 1, times x (see
        `spread`); until it is applied again."""
        out = self.product
        product, given = out.reshape(-1), x.reshape(-1)
        for system in self.systems:
            part = system.part
            apply_component(product[part], given[part], self.scale[part], system.links, self.wraps)
        if self.corner_faces.size:
            product[self.corner_faces] += self.corners @ given[self.corner_faces]
        if self.answer.yields:
            push = sum_rows(x, self.rows, self.size)
            add_rows(out, self.rows, -self.answer.change(self.dt * push))
        return out

    def precondition(self, residual: Array) -> Array:
        """V-cycles on the links of the components, of the scaled system, times a residual."""
        out = residual.copy()
        given, found = residual.reshape(-1), out.reshape(-1)
        for system, cycle in zip(self.systems, self.cycles, strict=True):
            part = system.part
            root = self.root[part].reshape(system.kind.shape)
            found[part] = (root * cycle.times(root * given[part].reshape(root.shape))).ravel()
        return out

    def solve(
        self, velocity: Faces, twist: Array, tolerance: float, slip: Array | None = None
    ) -> tuple[Faces, Array, bool]:
        """Velocity after viscosity, and the impulse that it gave to each body.

        velocity   Faces u*, m/s
        twist      (k,) s*: the bodies' motion without this impulse
        tolerance  relative residual
        slip       (n,) velocity of the skin relative to the body at each wall, along the
                   face's axis, m/s; none unless given
        returns    Faces; (k,) impulse, N s and N m s; whether the residual was reached
        """
        walls, held = self.walls, self.held
        blown = np.zeros(walls.index.size) if slip is None else slip
        start = np.concatenate([velocity[axis].ravel() for axis in self.grid.axes])
        right, y = spread(start.size), spread(start.size)
        rhs, scaled = (rows.reshape(-1)[: start.size] for rows in (right, y))
        np.multiply(self.mass, start, out=rhs)
        rhs += self.given
        fixed = np.where(held[walls.index], start[walls.index], 0.0)
        known = self.answer.to(self.push(fixed, twist, blown))[0]
        np.add.at(rhs, walls.index, walls.weight @ (self.at_walls(twist + known) + blown))
        rhs *= self.scale
        np.multiply(start if self.last is None else self.last, self.root, out=scaled)
        guide = self.precondition if self.cycles else None
        converged = conjugate_gradients(self.apply, right, y, tolerance, self.most, guide)
        result = self.scale * scaled
        np.copyto(result, start, where=held)
        self.last = result if self.cycles else None
        impulse = self.answer.to(self.push(result[walls.index], twist, blown))[1]
        return self._split(result, velocity), impulse, converged

    def push(self, velocity: Array, twist: Array, slip: Array) -> Array:
        """(k,) impulse on bodies that keep their motion, dt (B^T W (u - slip - B s) - C s).

        velocity  (n,) m/s at the walls;  twist  (k,) s;  slip  (n,) as in `solve`
        """
        walls, bodies = self.walls, len(self.couples)
        force = walls.weight @ (velocity - self.at_walls(twist) - slip)
        each = (force[:, None] * walls.arm).ravel()
        push = np.asarray(np.bincount(walls.columns.ravel(), each, twist.size), float)
        spin = twist[: 6 * bodies].reshape(bodies, 6)[:, 3:]
        push[: 6 * bodies].reshape(bodies, 6)[:, 3:] -= np.einsum("bij,bj->bi", self.couples, spin)
        return np.asarray(self.dt * push)

    def _split(self, values: Array, like: Faces) -> Faces:
        """Concatenated components as faces; periodic ends joined; a slab's z as it was."""
        parts = list(like)
        for axis, system in zip(self.grid.axes, self.systems, strict=True):
            parts[axis] = values[system.part].reshape(system.kind.shape)
            if self.wraps[axis]:
                parts[axis][edge(axis, -1)] = parts[axis][edge(axis, 0)]
        return faces_of(parts)


@dataclass
class Viscosity:
    """Implicit viscosity at the end of a step, for any pressure and any answer of the bodies.

    velocity  Faces u*, m/s
    gradient  of the pressure
    system    as the bodies answer it; None where the fluid has no viscosity
    slip      (n,) see `ViscousSystem.solve`
    driven    the bodies that answer
    """

    velocity: Faces
    gradient: PressureGradient
    cut: Geometry
    pose: Kinematics
    system: ViscousSystem | None
    slip: Array
    driven: Driven

    @timed("viscosity")
    def solve(self, driven: Driven, pressure: Array) -> tuple[Faces, Array, bool]:
        """The velocity after viscosity, and its impulse on the bodies.

        The pressure is there so that the boundary layer is that of the flow at the end of the step;
        it is taken off again before the new pressure is solved for.

        pressure  (nx, ny, nz) Pa
        returns   Faces; (k,) impulse; whether the solve converged
        """
        pose, cut, gradient = self.pose, self.cut, self.gradient
        size = 6 * pose.twist_jacobian.shape[0] + pose.vertices.size
        if self.system is None:
            return self.velocity, np.zeros(size), True
        dt = driven.system.dt
        if not driven.same_mobility(self.driven):
            self.system.answer_by(partial(driven.answering, pose))
        self.driven = driven
        fields = zip(range(3), self.velocity, strict=True)
        pushed = faces_of([np.empty_like(u) if a in gradient.grid.axes else u for a, u in fields])
        gradient.subtract(self.velocity, pressure, dt, pushed)
        earlier = pressure_push(cut, dt * pressure, size)
        moving = boundary_velocity(pose, driven.after(generalised(pose, earlier)))
        smooth, impulse, converged = self.system.solve(pushed, moving, TOLERANCE, self.slip)
        gradient.subtract(smooth, pressure, -dt)
        return smooth, impulse, converged


@timed("viscosity")
def viscosity_on(
    world: World,
    velocity: Faces,
    volumes: ControlVolumes,
    gradient: PressureGradient,
    cut: Geometry,
    jets: tuple[Jet, ...],
    pose: Kinematics,
    driven: Driven,
) -> Viscosity:
    """Viscosity on the cut at the end of a step, assembled."""
    (fluid, _), dt, bodies = world.flow(), driven.system.dt, pose.twist_jacobian.shape[0]
    grid, sides, system, slip = fluid.grid, fluid.boundaries, None, np.zeros(0)
    if fluid.viscosity > 0.0:
        parts = assemble_viscosity(
            OpenParts(cut.distance, cut.crossings, cut.open, cut.volume),
            velocity,
            face_masses(volumes, fluid.density),
            grid,
            sides,
            fluid.viscosity,
            dt,
            world.time + dt,
        )
        walls = on_flesh(walls_of(parts, cut, grid), cut, bodies, grid)
        size = 6 * bodies + pose.vertices.size
        answering = partial(driven.answering, pose)
        system = ViscousSystem(parts, walls, size, bodies, answering, grid, sides, dt)
        if creeps(fluid, dt):
            system.cycles = [cycle_on(part, system.wraps) for part in parts]
        slip = skin_slip(jets, walls.point, walls.across, walls.body, cut, grid)
    return Viscosity(velocity, gradient, cut, pose, system, slip, driven)


def on_flesh(walls: Walls, cut: Geometry, bodies: int, grid: Grid) -> Walls:
    """The walls with those on flesh moved by the vertices around them."""
    flesh = np.flatnonzero(walls.body >= bodies)
    if flesh.size == 0:
        return walls
    axis = np.argmax(walls.across[flesh], axis=1)
    corner, weight = skin_at(cut.skins, walls.point[flesh], grid)
    columns, arm = walls.columns.copy(), walls.arm.copy()
    columns[flesh], arm[flesh] = 0, 0.0
    columns[flesh, :3] = 6 * bodies + 3 * corner + axis[:, None]
    arm[flesh, :3] = weight
    return replace(walls, columns=columns, arm=arm)
