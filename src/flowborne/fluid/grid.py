"""The MAC grid: where cells and faces are, and how large they are."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from flowborne.base.arguments import (
    AXIS,
    COUNT,
    INDEX,
    NUMBER,
    POSITIVE,
    VECTOR,
    check,
    several,
    takes,
)
from flowborne.kernels.arrays import Array as Array
from flowborne.kernels.arrays import Faces as Faces
from flowborne.kernels.arrays import Marks, Mask, Nodes

CELLS = several(COUNT, "3 whole numbers of 1 or more", 3)
"""Numbers of cells along x, y and z."""


def faces_of(values: list[Array]) -> Faces:
    """Three arrays as Faces."""
    return values[0], values[1], values[2]


def inner_product(a: Array, b: Array) -> float:
    """Sum of a b over all elements of two fields of three axes, contiguous or not.

    `np.vdot` would copy what is not, and start threads, which takes milliseconds where other
    processes use the cores.
    """
    return float(np.einsum("ijk,ijk->", a, b))


def extent(marks: Mask | Marks, axis: int) -> tuple[int, int]:
    """First layer across an axis of three in which something is marked, and the one after the last;
    (0, 0) where nothing is."""
    found = np.flatnonzero(marks.any(axis=tuple(a for a in range(3) if a != axis)))
    return (int(found[0]), int(found[-1]) + 1) if found.size else (0, 0)


@dataclass(frozen=True)
class Grid:
    """Uniform MAC grid of cubic cells.

    A grid one cell thick in z is a *slab*: a two-dimensional world whose cell layer is centred on
    z = 0 and whose areas, volumes, masses and forces are all per unit depth.

    shape    (nx, ny, nz) cells
    spacing  h, edge of a cell in m
    origin   (x, y, z) of the lower corner in m
    raises   SceneError for other numbers
    """

    shape: tuple[int, int, int]
    spacing: float
    origin: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        check(self, shape=CELLS, spacing=POSITIVE, origin=VECTOR)

    def __str__(self) -> str:
        return " x ".join(str(self.shape[axis]) for axis in self.axes) + " cells"

    @classmethod
    @takes(spacing=POSITIVE, origin=several(NUMBER, "2 finite numbers", 2))
    def slab(cls, nx: int, ny: int, spacing: float, origin: tuple[float, float]) -> Grid:
        """Two-dimensional grid of nx by ny cells with its lower left corner at `origin`."""
        return cls((nx, ny, 1), spacing, (*origin, -0.5 * spacing))

    @takes(axis=AXIS, cells=INDEX)
    def moved(self, axis: int, cells: int) -> Grid:
        """The same grid some cells further along an axis."""
        origin = list(self.origin)
        origin[axis] += cells * self.spacing
        return replace(self, origin=(origin[0], origin[1], origin[2]))

    @cached_property
    def is_slab(self) -> bool:
        return self.shape[2] == 1

    @cached_property
    def depth(self) -> float:
        """Extent of a cell in z that enters areas and volumes: 1 in a slab, else h."""
        return 1.0 if self.is_slab else self.spacing

    @cached_property
    def cell_volume(self) -> float:
        return self.spacing**2 * self.depth

    @cached_property
    def face_area(self) -> float:
        """Area of a face across x or y (and across z in three dimensions)."""
        return self.spacing * self.depth

    @cached_property
    def axes(self) -> tuple[int, ...]:
        """Axes along which fluid can move."""
        return (0, 1) if self.is_slab else (0, 1, 2)

    @property
    def upper(self) -> tuple[float, float, float]:
        """(x, y, z) of the upper corner in m."""
        o, n, h = self.origin, self.shape, self.spacing
        return (o[0] + n[0] * h, o[1] + n[1] * h, o[2] + n[2] * h)

    @property
    def nodes(self) -> Nodes:
        """Where the nodes are, as kernels take it."""
        return Nodes(np.array(self.origin), self.spacing, self.is_slab)

    def face_shape(self, axis: int) -> tuple[int, int, int]:
        """Shape of the array of faces across `axis`."""
        n = list(self.shape)
        n[axis] += 1
        return (n[0], n[1], n[2])

    def zeros_faces(self) -> Faces:
        """Zero on every face."""
        return faces_of([np.zeros(self.face_shape(axis)) for axis in range(3)])

    def empty_faces(self) -> Faces:
        """Unknown on every face, to be filled; 0 across a slab."""
        return faces_of(
            [(np.empty if a in self.axes else np.zeros)(self.face_shape(a)) for a in range(3)]
        )

    def cell_coordinates(self) -> tuple[Array, Array, Array]:
        """x (nx,), y (ny,), z (nz,) of the cell centres in m."""
        return self._coordinates((0.5, 0.5, 0.5), self.shape)

    def face_coordinates(self, axis: int) -> tuple[Array, Array, Array]:
        """x, y, z of the centres of the faces across `axis` in m, one vector per axis."""
        offset = [0.5, 0.5, 0.5]
        offset[axis] = 0.0
        return self._coordinates((offset[0], offset[1], offset[2]), self.face_shape(axis))

    def _coordinates(
        self, offset: tuple[float, float, float], count: tuple[int, int, int]
    ) -> tuple[Array, Array, Array]:
        h = self.spacing
        x, y, z = (
            self.origin[i] + h * (np.arange(count[i], dtype=np.float64) + offset[i])
            for i in range(3)
        )
        return x, y, z
