"""Two balls on a grid, as plain arrays."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flowborne.kernels.arrays import Nodes
from flowborne.kernels.closed_fractions import Piece
from flowborne.kernels.edge_crossings import Crossings, new_crossings

SHAPES = [(9, 8, 7), (10, 9, 1)]
H, ORIGIN = 0.5, np.array([-2.1, -1.9, -1.6])


@dataclass
class Cut:
    """What the kernels of cut cells take.

    box       (3, 2) node ranges around the first ball; of its distances phi
    distance  to both balls at all nodes
    total     per axis, sum of what each ball closes of every face
    opened    per axis, random where a face is not whole
    """

    shape: tuple[int, int, int]
    box: np.ndarray
    phi: np.ndarray
    distance: np.ndarray
    opened: list[np.ndarray]

    @property
    def flat(self) -> bool:
        return self.shape[2] == 1

    @property
    def crossings(self) -> Crossings:
        """None of them known: distances are linear along the edges."""
        return new_crossings(self.distance, H, self.flat)

    @property
    def own_crossings(self) -> Crossings:
        """The same with the first ball."""
        return new_crossings(self.phi, H, self.flat)

    def piece(self, share: np.ndarray, centre: np.ndarray) -> Piece:
        """The first ball, number 7, which closes that of the faces across every axis."""
        nodes, closed = Nodes(ORIGIN, H, self.flat), ((share,) * 3, (centre,) * 3)
        return Piece(7, self.box, nodes, self.phi, self.own_crossings, *closed)


def nodes(shape: tuple[int, int, int]) -> np.ndarray:
    """(nx+1, ny+1, nz+1, 3) places of the nodes, m; a slab's lie at z = 0."""
    places = ORIGIN + H * np.moveaxis(np.indices(tuple(n + 1 for n in shape)), 0, -1)
    if shape[2] == 1:
        places[..., 2] = 0.0
    return places


def face_shape(shape: tuple[int, int, int], axis: int) -> tuple[int, ...]:
    return tuple(n + (axis == d) for d, n in enumerate(shape))


def cut(shape: tuple[int, int, int], seed: int = 0) -> Cut:
    random, x = np.random.default_rng(seed), nodes(shape)
    first = np.linalg.norm(x - [-0.3, 0.1, 0.0], axis=-1) - 1.1
    second = np.linalg.norm(x - [1.2, 0.4, 0.0], axis=-1) - 0.8
    box = np.array([[0, 7], [1, 8], [0, shape[2] + 1]])
    phi = np.ascontiguousarray(first[tuple(slice(*ends) for ends in box)])
    opened = [random.random(face_shape(shape, axis)) for axis in range(3)]
    for values in opened:
        values[random.random(values.shape) < 0.4] = 0.0
    return Cut(shape, box, phi, np.minimum(first, second), opened)
