"""What far sides answer to a dipole in the middle of the domain, exactly.

The column of fluid behind each far face (`sides.far`) fits the pressure of a dipole over all its
directions. Along one axis of an oblong domain it is off: a circle in 4 x 2 radii to each side has
an added mass of 1.07 along it and of 0.96 across, times that in endless fluid. So the weights W of
the columns get a correction E. With it the pressure of a dipole along an axis k, p = r_k / r^D in
D dimensions, gives the flux n = -(h/2) dp/dn that it has there, (W + E) p = n:

    E = sum over k of   n n^T / (p . n)  -  W p (W p)^T / (p . W p)

which leaves the matrix symmetric positive definite: the update of Broyden, Fletcher, Goldfarb and
Shanno (1970). Faces that bodies cut keep their columns alone.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from flowborne.fluid.sides.far import BoundaryFar, Centre
from flowborne.fluid.sides.side import Boundary, Place
from flowborne.kernels.arrays import FREE, Array, Integers, Mask


@dataclass(frozen=True)
class Dipoles:
    """E = U diag(signs) U^T between the n faces of all far sides, relative to the weight of a face
    with p = 0 on it.

    places   of the far sides
    cells    (n,) flat index of the cell at each face
    vectors  (2k, n) U^T
    signs    (2k,)
    """

    places: tuple[Place, ...]
    cells: Integers
    vectors: Array
    signs: Array

    def answer(self, pressure: Array) -> Iterator[tuple[Place, Array]]:
        """E p of each side, from the pressure (nx, ny, nz) in the cells."""
        near, start = pressure.reshape(-1)[self.cells], 0
        values = (self.signs * (self.vectors @ near)) @ self.vectors
        for place in self.places:
            shape = [1 if a == place.axis else n for a, n in enumerate(place.grid.shape)]
            stop = start + int(np.prod(shape))
            yield place, values[start:stop].reshape(shape)
            start = stop

    def on(self, uncut: Sequence[Mask]) -> Dipoles:
        """E between the faces of each side that `uncut` says alone."""
        kept = np.concatenate([faces.reshape(-1) for faces in uncut])
        return self if kept.all() else replace(self, vectors=self.vectors * kept)


def dipoles_of(sides: Sequence[tuple[Place, Boundary]]) -> Dipoles | None:
    """Those of the far sides among all sides of a domain; None where there are none, where the
    stream of the sea leaves through one, and where sides that are open end what is around."""
    far = [(place, side) for place, side in sides if isinstance(side, BoundaryFar)]
    if not far or any(side.is_exit(place) for place, side in far):
        return None
    places, first = tuple(place for place, _ in far), far[0][1]
    grid = places[0].grid
    number = np.arange(np.prod(grid.shape)).reshape(grid.shape)
    layers = [number[place.layer] for place in places]
    at = list(zip(places, layers, strict=True))
    columns = np.concatenate([_spread(first.pressure_weight(place), on) for place, on in at])
    vectors: list[Array] = []
    for k in directions(sides, first.centre):
        parts = [_dipole(first, place, k, on) for place, on in at]
        p, n = (np.concatenate(halves) for halves in zip(*parts, strict=True))
        Wp = columns * p
        vectors += [n / np.sqrt(p @ n), Wp / np.sqrt(p @ Wp)]
    if not vectors:
        return None
    cells = np.concatenate([on.reshape(-1) for on in layers])
    signs = np.tile([1.0, -1.0], len(vectors) // 2)
    return Dipoles(places, cells, np.stack(vectors), signs)


def directions(sides: Sequence[tuple[Place, Boundary]], centre: Centre) -> list[int]:
    """Axes along which a dipole is its own mirror image in all sides opposite far ones: in one that
    lets nothing through along its side, in an open one, whose image has the other sign, across."""
    ends: dict[int, list[Boundary]] = {}
    for place, side in sides:
        ends.setdefault(place.axis, []).append(side)
    outside = {axis: pair for axis, pair in ends.items() if centre[axis] is not None}
    if not all(any(side.endless for side in pair) for pair in outside.values()):
        return []
    mirrors = {a: s for a, pair in outside.items() for s in pair if not s.endless}
    opened = [axis for axis, side in mirrors.items() if side.normal == FREE]
    if opened:
        return opened if len(opened) == 1 else []
    return [axis for axis in outside if axis not in mirrors]


def _dipole(side: BoundaryFar, place: Place, k: int, layer: Integers) -> tuple[Array, Array]:
    """p of a dipole along axis k in the cells of a layer, and n on their faces at the side."""
    grid, axis, outward = place.grid, place.axis, 1.0 if place.upper else -1.0
    on = list(place.cell_coordinates())
    inside = list(on)
    inside[axis] = on[axis] - 0.5 * outward * grid.spacing
    r = side.lengths(grid, (inside[0], inside[1], inside[2]))
    D, r2 = len(r), sum(length**2 for length in r.values())
    p = r[k] / r2 ** (0.5 * D)
    r = side.lengths(grid, (on[0], on[1], on[2]))
    r2 = sum(length**2 for length in r.values())
    slope = (float(k == axis) - D * r[k] * r[axis] / r2) / r2 ** (0.5 * D)
    return _spread(p, layer), _spread(-0.5 * grid.spacing * outward * slope, layer)


def _spread(values: Array | float, layer: Integers) -> Array:
    """(n,) values that broadcast over a layer."""
    return np.broadcast_to(values, layer.shape).reshape(-1)
