"""Finite volumes of the viscous system around the faces across one axis (see `fluid.viscosity`)."""

from __future__ import annotations

import numpy as np
from numba import prange
from numpy.typing import NDArray

from flowborne.kernels.arrays import Array, Faces, Integers
from flowborne.kernels.jit import kernel
from flowborne.kernels.sides import CLOSED, PERIODIC

INACTIVE, UNKNOWN, GIVEN, TIED = range(4)
"""A face is inside a body, solved for, prescribed by a side, or moves with the body beside it."""

OBLIQUE = 0.5
"""Least cosine between a wall's area and its normal: bounds x_w where the cells are too coarse."""


@kernel
def face_distances(distance: Array, axis: int, out: Array) -> None:
    """Distance to the nearest body at the centres of the faces across `axis`: mean of corners."""
    ai, aj = int(axis != 0), int(axis == 0)
    bj, bk = int(axis == 2), int(axis != 2)
    for i in prange(out.shape[0]):
        for j in range(out.shape[1]):
            for k in range(out.shape[2]):
                out[i, j, k] = 0.25 * (
                    distance[i, j, k]
                    + distance[i + ai, j + aj, k]
                    + distance[i, j + bj, k + bk]
                    + distance[i + ai, j + aj + bj, k + bk]
                )


def face_distances_reference(distance: Array, axis: int) -> Array:
    """`face_distances` in NumPy."""
    p = np.moveaxis(distance, axis, 0)
    mean = 0.25 * (p[:, :-1, :-1] + p[:, 1:, :-1] + p[:, :-1, 1:] + p[:, 1:, 1:])
    return np.moveaxis(mean, 0, axis)


@kernel
def classify(
    kind: NDArray[np.uint8],
    opened: Array,
    distance: Array,
    axis: int,
    codes: Integers,
    touching: float,
) -> None:
    """Kind of every face across `axis`; `distance` is at the faces."""
    last = kind.shape[axis] - 1
    for i in prange(kind.shape[0]):
        for j in range(kind.shape[1]):
            for k in range(kind.shape[2]):
                at = i if axis == 0 else (j if axis == 1 else k)
                kind[i, j, k] = UNKNOWN
                if opened[i, j, k] == 0.0:
                    kind[i, j, k] = INACTIVE
                elif (at == 0 and codes[axis, 0] == CLOSED) or (
                    at == last and codes[axis, 1] == CLOSED
                ):
                    kind[i, j, k] = GIVEN
                elif at == last and codes[axis, 1] == PERIODIC:
                    kind[i, j, k] = INACTIVE
                elif distance[i, j, k] <= touching:
                    kind[i, j, k] = TIED


def classify_reference(
    opened: Array, distance: Array, axis: int, codes: Integers, touching: float
) -> NDArray[np.uint8]:
    """`classify` in NumPy: the kinds."""
    kind = np.where(distance <= touching, TIED, UNKNOWN).astype(np.uint8)
    ends = np.moveaxis(kind, axis, 0)
    if codes[axis, 0] == CLOSED:
        ends[0] = GIVEN
    if codes[axis, 1] == CLOSED:
        ends[-1] = GIVEN
    if codes[axis, 1] == PERIODIC:
        ends[-1] = INACTIVE
    kind[opened == 0.0] = INACTIVE
    return kind


@kernel
def aperture(
    opened: Array, across: Array, axis: int, d: int, i: int, j: int, k: int, last: int
) -> float:
    """Open part of the side between the control volume of a face and the next one along d.

    opened   open fractions of the faces across `axis`
    across   open fractions of the faces across d
    last     index of the last face across `axis`
    """
    ei, ej, ek = int(d == 0), int(d == 1), int(d == 2)
    if d == axis:
        return 0.5 * (opened[i, j, k] + opened[i + ei, j + ej, k + ek])
    at = i if axis == 0 else (j if axis == 1 else k)
    li, lj, lk = int(axis == 0), int(axis == 1), int(axis == 2)
    total, count = 0.0, 0
    if at > 0:
        total += across[i - li + ei, j - lj + ej, k - lk + ek]
        count += 1
    if at < last:
        total += across[i + ei, j + ej, k + ek]
        count += 1
    return total / count


def aperture_reference(opened: Array, across: Array, axis: int, d: int) -> Array:
    """`aperture` in NumPy, between all faces across `axis` and the next ones along d; for d other
    than `axis` those at the upper side of the domain come last."""
    if d == axis:
        return 0.5 * (np.delete(opened, -1, axis) + np.delete(opened, 0, axis))
    sides = np.delete(across, 0, d)
    ends = [(int(n == axis),) * 2 for n in range(3)]
    total, count = np.pad(sides, ends), np.pad(np.ones_like(sides), ends)
    both = [np.delete(values, 0, axis) + np.delete(values, -1, axis) for values in (total, count)]
    return np.asarray(both[0] / both[1])


@kernel
def following(at: int, count: int, periodic: bool) -> int:
    """Index after `at` among `count` distinct faces; -1 beyond the domain."""
    if at + 1 < count:
        return at + 1
    return 0 if periodic else -1


@kernel
def link_faces(
    axis: int,
    d: int,
    kind: NDArray[np.uint8],
    opened: Array,
    across: Array,
    velocity: Array,
    stiffness: float,
    diagonal: Array,
    link: Array,
    given: Array,
    periodic: bool,
) -> None:
    """Add the links along d to the system of the faces across `axis`.

    stiffness  mu A / h, kg/s
    periodic   whether the domain is along d
    """
    last = kind.shape[axis] - 1
    count = kind.shape[d] - int(periodic and d == axis)
    for i in range(kind.shape[0]):
        for j in range(kind.shape[1]):
            for k in range(kind.shape[2]):
                at = i if d == 0 else (j if d == 1 else k)
                to = following(at, count, periodic)
                if at >= count or to < 0:
                    continue
                g = to if d == 0 else i, to if d == 1 else j, to if d == 2 else k
                here, there = kind[i, j, k] == UNKNOWN, kind[g] == UNKNOWN
                known = kind[i, j, k] == GIVEN or kind[g] == GIVEN
                if not ((here and there) or (known and (here or there))):
                    continue
                coefficient = stiffness * aperture(opened, across, axis, d, i, j, k, last)
                if here:
                    diagonal[i, j, k] += coefficient
                if there:
                    diagonal[g] += coefficient
                if here and there:
                    link[i, j, k] = coefficient
                elif here:
                    given[i, j, k] += coefficient * velocity[g]
                else:
                    given[g] += coefficient * velocity[i, j, k]


def link_faces_reference(
    axis: int,
    d: int,
    kind: NDArray[np.uint8],
    opened: Array,
    across: Array,
    velocity: Array,
    stiffness: float,
    periodic: bool,
) -> tuple[Array, Array, Array]:
    """`link_faces` in NumPy: what it adds to the diagonal, the links, what it adds to the force."""
    faces = kind.shape[d] - int(periodic and d == axis)
    between = np.moveaxis(aperture_reference(opened, across, axis, d), d, 0)
    links = faces if periodic else faces - 1
    distinct = np.moveaxis(kind, d, 0)[:faces]
    here, there = distinct[:links], np.roll(distinct, -1, axis=0)[:links]
    both = (here == UNKNOWN) & (there == UNKNOWN)
    from_here = (here == GIVEN) & (there == UNKNOWN)
    from_there = (here == UNKNOWN) & (there == GIVEN)
    k = stiffness * between[:links]
    u = np.moveaxis(velocity, d, 0)
    out = np.zeros((3, *np.moveaxis(kind, d, 0).shape))
    diagonal, link, given = out
    above = (np.arange(links) + 1) % faces
    diagonal[:links] += k * (both | from_there)
    diagonal[above] += k * (both | from_here)
    link[:links] = k * both
    given[:links] += k * from_there * u[above]
    given[above] += k * from_here * u[:links]
    return np.moveaxis(diagonal, 0, d), np.moveaxis(link, 0, d), np.moveaxis(given, 0, d)


@kernel
def meet_walls(
    axis: int,
    kind: NDArray[np.uint8],
    opened: Faces,
    phi: Array,
    stiffness: float,
    spacing: float,
    codes: Integers,
    beside: Integers,
    wall: Array,
    gap: Array,
) -> None:
    """Wall coefficient and x_f - x_w of the faces `beside`; both 0 where no link is cut.

    beside  (n,) flat indices of unknown faces across `axis`
    """
    last = kind.shape[axis] - 1
    area = np.zeros(3)
    for n in range(beside.size):
        f = beside[n]
        i = f // (kind.shape[1] * kind.shape[2])
        j, k = (f // kind.shape[2]) % kind.shape[1], f % kind.shape[2]
        slope = 0.0
        area[:] = 0.0
        for d in range(2 if opened[0].shape[2] == 1 else 3):
            periodic = codes[d, 0] == PERIODIC
            count = kind.shape[d] - int(periodic and d == axis)
            at = i if d == 0 else (j if d == 1 else k)
            for side in (-1, 1):
                to = at + side
                if to < 0 or to >= count:
                    if not periodic:
                        continue
                    to = (to + count) % count
                g = to if d == 0 else i, to if d == 1 else j, to if d == 2 else k
                link = 0.0
                if kind[g] == UNKNOWN or kind[g] == GIVEN:
                    low = g if side < 0 else (i, j, k)
                    link = stiffness * aperture(
                        opened[axis], opened[d], axis, d, low[0], low[1], low[2], last
                    )
                area[d] -= side * spacing * (stiffness - link)
                slope += link * (phi[g] - phi[i, j, k])
        size = np.sqrt((area**2).sum())
        if size > 0.0:
            wall[n] = max(slope, OBLIQUE * size) / phi[i, j, k]
            gap[n] = area / wall[n]


def meet_walls_reference(
    axis: int,
    kind: NDArray[np.uint8],
    opened: Faces,
    phi: Array,
    stiffness: float,
    spacing: float,
    codes: Integers,
    beside: Integers,
) -> tuple[Array, Array]:
    """`meet_walls` in NumPy: W and x_f - x_w."""
    slope, area = np.zeros(kind.shape), np.zeros((3, *kind.shape))
    for d in range(2 if opened[0].shape[2] == 1 else 3):
        periodic = bool(codes[d, 0] == PERIODIC)
        faces = kind.shape[d] - int(periodic and d == axis)
        between = np.moveaxis(aperture_reference(opened[axis], opened[d], axis, d), d, 0)
        known = np.moveaxis((kind == UNKNOWN) | (kind == GIVEN), d, 0)
        p, rise, gain = (np.moveaxis(values, d, 0) for values in (phi, slope, area[d]))
        low = np.arange(faces if periodic else faces - 1)
        high = (low + 1) % faces
        for side, here, there in ((1, low, high), (-1, high, low)):
            link = stiffness * between[low] * known[there]
            gain[here] -= side * spacing * (stiffness - link)
            rise[here] += link * (p[there] - p[here])
    area, slope = area.reshape(3, -1)[:, beside], slope.ravel()[beside]
    size = np.linalg.norm(area, axis=0)
    cut = size > 0.0
    wall = np.where(cut, np.maximum(slope, OBLIQUE * size) / phi.ravel()[beside], 0.0)
    return wall, np.divide(area.T, wall[:, None], np.zeros_like(area.T), where=cut[:, None])
