"""Random worlds: a chain of bodies in a noisy flow, and the same turned or mirrored."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from hypothesis import Phase
from hypothesis import strategies as st

from flowborne import Array, Grid, World
from flowborne.kernels.arrays import Integers
from flowborne.worlds import (
    Boundaries,
    Boundary,
    BoundaryClosed,
    BoundaryFar,
    BoundaryInflow,
    BoundaryNoSlip,
    BoundaryOpen,
    BoundaryPeriodic,
    make_world,
)
from flowborne_validation.worlds import mjcf

H = 0.125
"""m, edge of a cell; a domain's middle is the origin."""

SPEED = 0.3
"""m/s, of the flow, the bodies and what flows in."""

DT = 0.02
"""s, of a step: the flow crosses a fifth of a cell."""

ASIDE = np.array([0.0437, 0.0711, 0.0573])
"""Cells by which a body is beside where its symmetry would be that of the grid."""

UNSHRUNK = (Phase.explicit, Phase.generate)
"""A failing world is told as it was found: to make it smaller would take minutes."""

Turn = Integers
"""(3, 3) a rotation by right angles or a mirror: a matrix with one 1 or -1 in each row."""

SAME: Turn = np.eye(3, dtype=np.int64)
MIRRORS = {axis: np.diag([-1 if a == axis else 1 for a in range(3)]) for axis in range(3)}
QUARTER: Turn = np.array([[0, -1, 0], [1, 0, 0], [0, 0, 1]])

SIDES = {
    "closed": ("closed", "closed"),
    "no-slip": ("no-slip", "no-slip"),
    "periodic": ("periodic", "periodic"),
    "open": ("open", "open"),
    "far": ("far", "far"),
    "through": ("inflow", "open"),
}
WALLS = ("closed", "no-slip", "periodic")
"""Sides that let nothing in or out."""

KINDS = {"sphere": 1, "capsule": 2, "cylinder": 2, "box": 3, "ellipsoid": 3}
"""Geometry -> how many sizes it has."""


@dataclass(frozen=True)
class Piece:
    """A body of a chain with one geometry.

    kind   of the geometry
    size   (3,) its half extents, as many as the kind has
    place  (3,) of its middle in the world, m
    turn   quaternion of the geometry
    joint  to the piece before, half-way between both; that of the first one to the world
    axis   (3,) of a hinge or a slide
    """

    kind: str
    size: Array
    place: Array
    turn: Array
    joint: str
    axis: Array

    def element(self, number: int, before: Array, turn: Turn, inner: str) -> str:
        """MJCF of the body in a turned world, around `inner`, in the frame of the body before it,
        whose middle is at `before`."""
        sign = round(np.linalg.det(turn))
        arm = 0.5 * (before - self.place)
        joint = {
            "none": "",
            "free": "<freejoint/>",
            "ball": f'<joint type="ball" pos="{_text(turn @ arm)}"/>',
            "hinge": f'<joint type="hinge" pos="{_text(turn @ arm)}" '
            f'axis="{_text(sign * turn @ self.axis)}"/>',
            "slide": f'<joint type="slide" axis="{_text(turn @ self.axis)}"/>',
        }[self.joint]
        # a box or an ellipsoid has its sizes along the axes of its own frame, which turn with it
        size = np.abs(turn) @ self.size if KINDS[self.kind] == 3 else self.size
        turned = np.append(self.turn[0], sign * turn @ self.turn[1:])
        return (
            f'<body name="piece{number}" pos="{_text(turn @ (self.place - before))}">{joint}'
            f'<geom type="{self.kind}" size="{_text(size[: KINDS[self.kind]])}" '
            f'quat="{_text(turned)}"/>{inner}</body>'
        )

    def velocity(self, turn: Turn, numbers: Array) -> Array:
        """Velocity of the joint in a turned world, of six numbers."""
        sign = round(np.linalg.det(turn))
        linear, angular = SPEED * turn @ numbers[:3], 2.0 * SPEED * sign * turn @ numbers[3:]
        return {
            "none": np.zeros(0),
            "free": np.concatenate([linear, angular]),
            "ball": angular,
            "hinge": 2.0 * SPEED * numbers[:1],
            "slide": SPEED * numbers[:1],
        }[self.joint]


def _text(numbers: Array) -> str:
    return " ".join(repr(float(number)) for number in numbers)


@dataclass(frozen=True)
class Case:
    """A world that can be made turned.

    cells      (3,) along the axes
    sides      across each axis, one of SIDES
    pieces     the chain
    density    of the bodies over that of the fluid
    viscosity  Pa s
    seed       of the flow and of the joints' velocities
    """

    cells: tuple[int, int, int]
    sides: tuple[str, str, str]
    pieces: tuple[Piece, ...]
    density: float
    viscosity: float
    seed: int

    @property
    def slab(self) -> bool:
        return self.cells[2] == 1

    def world(self, turn: Turn = SAME, **options: Any) -> World:
        """The world at its start, turned as a whole; its flow has divergence still."""
        cells = np.abs(turn) @ self.cells
        grid = Grid(tuple(map(int, cells)), H, tuple(-0.5 * H * cells))
        world = make_world(
            self.model(turn),
            grid,
            solid_density=self.density,
            viscosity=self.viscosity,
            boundaries=self.boundaries(turn),
            **options,
        )
        random = np.random.default_rng(self.seed)
        numbers = random.uniform(-1.0, 1.0, (len(self.pieces), 6))
        if self.slab:
            numbers[:, 2:5] = 0.0
        velocities = [p.velocity(turn, n) for p, n in zip(self.pieces, numbers, strict=True)]
        world.solid.v[:] = np.concatenate([np.zeros(0), *velocities])
        first = Grid(self.cells, H)
        noise = [SPEED * random.normal(size=first.face_shape(axis)) for axis in first.axes]
        for axis, values in enumerate(noise):
            if self.sides[axis] == "periodic":
                ends = np.moveaxis(values, axis, 0)
                ends[-1] = ends[0]
        for axis, values in turned_faces(noise, turn).items():
            world.flow()[1].velocity[axis][:] = values
        return world

    def model(self, turn: Turn) -> str:
        """MJCF of the chain."""
        inner = ""
        for number in range(len(self.pieces) - 1, -1, -1):
            before = self.pieces[number - 1].place if number else np.zeros(3)
            inner = self.pieces[number].element(number, before, turn, inner)
        return mjcf(inner)

    def boundaries(self, turn: Turn) -> Boundaries:
        """The six sides."""
        sides: list[Boundary] = [BoundaryClosed()] * 6
        for axis, name in enumerate(self.sides):
            for end, kind in enumerate(SIDES[name]):
                normal = turn[:, axis] * (1 - 2 * end)
                to = int(np.abs(normal).argmax())
                sides[2 * to + (normal[to] < 0)] = side(kind, normal)
        return Boundaries(*sides)


def side(kind: str, normal: Turn) -> Boundary:
    """One side, with its normal inward."""

    def stream(x: Array, y: Array, z: Array, time: float) -> tuple[Array, Array, Array]:
        u, v, w = (SPEED * float(n) + 0.0 * (x + y + z) for n in normal)
        return u, v, w

    return {
        "closed": BoundaryClosed(),
        "no-slip": BoundaryNoSlip(),
        "periodic": BoundaryPeriodic(),
        "open": BoundaryOpen(),
        "far": BoundaryFar(),
        "inflow": BoundaryInflow(stream),
    }[kind]


def turned(values: Array, turn: Turn) -> Array:
    """A field (nx, ny, nz) of numbers, turned with the world."""
    to = np.abs(turn).argmax(axis=0)
    flipped = [int(to[axis]) for axis in range(3) if turn[to[axis], axis] < 0]
    return np.flip(np.transpose(values, np.argsort(to)), flipped)


def turned_faces(velocity: list[Array], turn: Turn) -> dict[int, Array]:
    """axis -> component of a velocity on faces, turned with the world."""
    to = np.abs(turn).argmax(axis=0)
    return {
        int(to[axis]): turn[to[axis], axis] * turned(values, turn)
        for axis, values in enumerate(velocity)
    }


def sound(across: tuple[str, ...]) -> bool:
    """Whether fluid beyond far sides is no endless channel."""
    return "far" not in across or sum(name in ("far", "open", "through") for name in across) > 1


@st.composite
def cases(
    draw: st.DrawFn,
    slab: bool,
    sides: tuple[str, ...] = tuple(SIDES),
    joints: tuple[str, ...] = ("free", "hinge", "slide", "ball", "none"),
) -> Case:
    """Cases of one to four bodies in a slab or a room.

    sides   what there is across each axis
    joints  of the first body to the world
    """
    along = st.integers(10, 20) if slab else st.integers(8, 11)
    cells = (draw(along), draw(along), 1 if slab else draw(along))
    axes = 2 if slab else 3
    across = draw(st.tuples(*[st.sampled_from(sides)] * 3).filter(lambda a: sound(a[:axes])))
    pieces: list[Piece] = []
    for _ in range(draw(st.integers(1, 4))):
        pieces.append(draw(chained(slab, cells, joints, tuple(pieces))))
    return Case(
        cells,
        (*across[:2], "closed" if slab else across[2]),
        tuple(pieces),
        draw(st.sampled_from([0.1, 0.5, 1.0, 3.0])),
        draw(st.sampled_from([0.0, 0.001, 0.02])),
        draw(st.integers(0, 2**16)),
    )


@st.composite
def chained(
    draw: st.DrawFn,
    slab: bool,
    cells: tuple[int, int, int],
    joints: tuple[str, ...],
    before: tuple[Piece, ...],
) -> Piece:
    """A piece inside the domain, at most some cells from the last of those before it."""
    three = st.tuples(*[st.floats(-1.0, 1.0)] * 3).map(np.array)
    kind = draw(st.sampled_from(("sphere", "cylinder", "box") if slab else tuple(KINDS)))
    size = H * (1.0 + 0.4 * draw(three))
    number, last = len(before), before[-1].place / H if before else np.zeros(3)
    room = np.maximum(0.5 * np.array(cells) - 4.0, 0.0)
    place = H * (np.clip(last + 2.5 * draw(three), -room, room) + (number + 1) * ASIDE)
    angles = draw(three) + ASIDE
    joint = draw(st.sampled_from(("hinge", "slide", "ball", "none") if before else joints))
    axis = np.append(draw(st.tuples(*[st.sampled_from([-1.0, 0.0, 1.0])] * 2)), 1.0)
    if slab:
        place[2], angles[:2] = 0.0, 0.0
        joint = "hinge" if joint == "ball" else joint
        axis = np.array([0.0, 0.0, 1.0]) if joint == "hinge" else np.array([1.0, axis[1], 0.0])
    turn = np.append(1.0, angles)
    return Piece(kind, size, place, turn / np.linalg.norm(turn), joint, axis)
