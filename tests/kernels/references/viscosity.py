"""The kernels of `viscosity` in NumPy: slower, and nearer to what they mean."""

from __future__ import annotations

import numpy as np

from flowborne.kernels.arrays import LEAST, PERIODIC, Array, Integers, Pixels
from flowborne.kernels.cut_faces import SAME
from flowborne.kernels.viscosity import GIVEN, UNKNOWN

from .cut_faces import closed_polygon_reference, open_edge_reference

TINY = 1e-300
"""Above 0, where nothing is divided by nothing."""


def face_distances_reference(distance: Array, axis: int) -> Array:
    """`face_distances` in NumPy."""
    p = np.moveaxis(distance, axis, 0)
    mean = 0.25 * (p[:, :-1, :-1] + p[:, 1:, :-1] + p[:, :-1, 1:] + p[:, 1:, 1:])
    return np.moveaxis(mean, 0, axis)


def face_corners_reference(distance: Array, axis: int) -> Array:
    """(4, ...) distances at the corners of all faces across `axis`, in turn."""
    p = np.moveaxis(distance, axis, 0)
    corners = np.stack([p[:, :-1, :-1], p[:, 1:, :-1], p[:, 1:, 1:], p[:, :-1, 1:]])
    return np.moveaxis(corners, 1, 1 + axis)


def find_centres_reference(distance: Array, axis: int) -> Array:
    """`find_centres` in NumPy, of all faces."""
    closed, *moment = closed_polygon_reference(face_corners_reference(distance, axis))
    cut = (closed > 0.0) & (closed < 1.0)
    return np.where(
        cut, np.clip(-np.stack(moment) / np.where(cut, 1.0 - closed, 1.0), -0.5, 0.5), 0.0
    )


def links_reference(
    axis: int, d: int, distance: Array, opened: Array, centre: Array, parts: Array, periodic: bool
) -> Array:
    """Links over those of open faces in NumPy, between all faces across `axis` and the next ones
    along d, that first; the first one stands for the next of the last where periodic."""
    if d == axis:
        a, v = np.moveaxis(opened, d, 0), np.moveaxis(parts, d, 0)
        one = a[:-1]
        other = np.concatenate([a[1:-1], a[:1] if periodic else a[-1:]])
        least = np.maximum(LEAST * np.maximum(one, other), TINY)
        return one * other / np.maximum(v, least)
    e = 3 - axis - d
    nodes = np.moveaxis(distance, (d, e), (0, 1))[1:]
    part = open_edge_reference(nodes[:, :-1], nodes[:, 1:])
    place = np.moveaxis(centre[int(d > e)], (d, e), (0, 1))
    away = 1.0 + np.roll(place, -1, axis=0) - place
    return np.moveaxis(part / np.maximum(away, LEAST), 1, 1 if e < axis else 2)


def link_faces_reference(
    axis: int,
    d: int,
    kind: Pixels,
    distance: Array,
    opened: Array,
    centre: Array,
    parts: Array,
    velocity: Array,
    stiffness: float,
    periodic: bool,
) -> tuple[Array, Array, Array]:
    """`link_faces` in NumPy: what it adds to the diagonal, the links, what it adds to the force."""
    faces = kind.shape[d] - int(periodic and d == axis)
    between = links_reference(axis, d, distance, opened, centre, parts, periodic)
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


def beside_reference(values: Array, d: int, side: int, periodic: bool, missing: float) -> Array:
    """Values of the next faces along d on one side; `missing` beyond the domain."""
    moved = np.moveaxis(np.roll(values, -side, axis=d), d, 0).copy()
    if not periodic:
        moved[-1 if side > 0 else 0] = missing
    return np.moveaxis(moved, 0, d)


def meet_walls_reference(
    axis: int,
    kind: Pixels,
    distance: Array,
    opened: Array,
    centre: Array,
    parts: Array,
    stiffness: float,
    normal: Integers,
    beside: Integers,
) -> tuple[Array, Array, Array, Integers]:
    """`meet_walls` in NumPy: W, gap, place and node."""
    others = [d for d in range(2 if parts.shape[2] == 1 else 3) if d != axis]
    active = np.where((kind == UNKNOWN) | (kind == GIVEN), opened, 0.0)
    wall = np.zeros((3, *kind.shape))
    gap, place = np.zeros((3, 3, *kind.shape)), np.zeros((3, 3, *kind.shape))
    area = 1.0 - closed_polygon_reference(face_corners_reference(distance, axis))[0]
    moment, stuck = np.zeros(kind.shape), np.zeros(kind.shape)
    total, pull = np.zeros((2, 3, *kind.shape))
    for m, d in enumerate(others):
        e = 3 - axis - d
        ends = np.moveaxis(distance, (d, e), (0, 1))
        edges = open_edge_reference(ends[:, :-1], ends[:, 1:])
        periodic = bool(normal[d, 0] == PERIODIC)
        for side, part in ((-1, edges[:-1]), (1, edges[1:])):
            part = np.moveaxis(part, (0, 1), (d, e))
            away = np.maximum(0.5 - side * centre[m], LEAST)
            total[d] -= side * part
            moment += part * away
            shut = beside_reference(active, d, side, periodic, 1.0) == 0.0
            stuck += shut * part / away
            pull[d] -= shut * side * part
    size = np.sqrt((total**2).sum(axis=0))
    cut, one = size > SAME, np.where(size > SAME, size, 1.0)
    reach, bulge = len(others) * area - moment, 2.0 * (area - opened)
    reach = np.maximum(np.maximum(reach - bulge, 0.5 * reach) / one, LEAST)
    closed = np.where(cut, size / reach, np.where(area == 0.0, 1.0 / LEAST, 0.0))
    wall[0] = closed + stuck
    pull = pull - total * cut
    gap[0] = np.divide(pull, wall[0], np.zeros_like(pull), where=wall[0] > 0.0)
    for m, d in enumerate(others):
        place[0, d] = np.where(wall[0] > 0.0, centre[m], 0.0) - gap[0, d]
    faces = kind.shape[axis] - int(normal[axis, 0] == PERIODIC)
    periodic = bool(normal[axis, 0] == PERIODIC)
    distinct = [np.take(values, range(faces), axis) for values in (active, opened, *centre)]
    cells = np.moveaxis(parts, axis, 0)
    for entry, side in ((1, -1), (2, 1)):
        a = np.moveaxis(distinct[1], axis, 0)
        b = np.moveaxis(beside_reference(distinct[0], axis, side, periodic, np.nan), axis, 0)
        index = (np.arange(faces) + (side - 1) // 2) % cells.shape[0]
        v = np.maximum(cells[index], np.maximum(LEAST * np.maximum(a, b), TINY))
        met = (np.abs(a - b) >= SAME) & (a > 0.0)
        apart = np.where(met, a - b, 1.0)
        np.moveaxis(wall[entry], axis, 0)[:faces] = np.where(met, a * (a - b) / v, 0.0)
        np.moveaxis(place[entry, axis], axis, 0)[:faces] = np.where(met, 0.5 * side, 0.0)
        np.moveaxis(gap[entry, axis], axis, 0)[:faces] = np.where(met, -0.5 * side, 0.0)
        for m, d in enumerate(others):
            own = np.moveaxis(distinct[2 + m], axis, 0)
            there = beside_reference(distinct[2 + m], axis, side, periodic, 0.0)
            middle = np.clip((a * own - b * np.moveaxis(there, axis, 0)) / apart, -0.5, 0.5)
            np.moveaxis(place[entry, d], axis, 0)[:faces] = np.where(met, middle, 0.0)
            np.moveaxis(gap[entry, d], axis, 0)[:faces] = np.where(met, own - middle, 0.0)
    node = nearest_nodes_reference(axis, distance, faces, kind.shape)
    return (
        stiffness * wall.reshape(3, -1)[:, beside].T,
        np.moveaxis(gap.reshape(3, 3, -1)[..., beside], -1, 0),
        np.moveaxis(place.reshape(3, 3, -1)[..., beside], -1, 0),
        node.reshape(3, -1)[:, beside].T,
    )


def nearest_nodes_reference(
    axis: int, distance: Array, faces: int, shape: tuple[int, ...]
) -> Integers:
    """(3, ...) flat index of the node nearest to a body at each face across `axis`, and around the
    cells below and above it."""
    found = np.zeros((3, *shape), np.int64)
    for f in np.ndindex(*shape):
        if f[axis] >= faces:
            continue
        for entry, shift in ((0, None), (1, -1), (2, 0)):
            low = list(f)
            if shift is not None:
                low[axis] = (f[axis] + shift) % (distance.shape[axis] - 1)
            block = [slice(at, at + 1 + (entry > 0 or d != axis)) for d, at in enumerate(low)]
            part = distance[tuple(block)]
            at = np.add(np.unravel_index(np.argmin(part), part.shape), low)
            found[(entry, *f)] = np.ravel_multi_index(tuple(at), distance.shape)
    return found
