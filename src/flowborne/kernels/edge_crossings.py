"""Where the edges of the grid cross the surface of bodies.

An edge from node (i, j, k) along an axis is cut where one of its nodes is inside a body and the
other is not. The crossing is the root of the body's signed distance along the edge, not that of
the line between the distances at the nodes: near an edge or corner of a body these measure to the
nearest surface, which the edge need not meet. An edge between two open nodes may be crossed twice.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from flowborne.kernels.arrays import Array, Indices, Integers, Nodes
from flowborne.kernels.distance import BOX, CYLINDER, Samples, signed_distance
from flowborne.kernels.jit import inlined, kernel
from flowborne.kernels.triangles import along

PIECES = 1 << 20
"""Numbers for the smooth pieces of the surface of one geometry."""

ROOT = 1e-13
"""Largest distance from the surface, in cells, of what counts as a crossing."""

SHIFT = 1e-4
"""Cells on either side of a crossing at which distances are taken for the normal."""

GOLDEN = 0.5 * (np.sqrt(5.0) - 1.0)

LEAST_DIP = 1e-9
"""Part of an edge within which the place is searched for where a body is nearest to it."""


class Crossings(NamedTuple):
    """Crossings of edges in a box of nodes.

    at      (3, ni, nj, nk) number of the crossing on the edge from each node along each axis, of
            the lower one where it is crossed twice, which the upper one follows; or -1: there the
            distances at both nodes decide
    part    (n,) part of the edge that is open, from its open node on
    normal  (n, 3) of the surface there, outward
    piece   (n,) smooth piece of the surface; between two pieces there is an edge or a corner
    """

    at: Indices
    part: Array
    normal: Array
    piece: Integers


class Placed(NamedTuple):
    """A geometry with a signed distance, see `coupling.shapes`, and where it is.

    kind, size          of it; (3,)
    position, rotation  (3,) m; (3, 3) of its frame to the world's
    samples             of one without a formula
    """

    kind: int
    size: Array
    position: Array
    rotation: Array
    samples: Samples


@inlined
def distance_to(body: Placed, x: float, y: float, z: float) -> float:
    """Signed distance of a place in the world to a geometry, m."""
    rotation = body.rotation
    dx, dy, dz = x - body.position[0], y - body.position[1], z - body.position[2]
    lx = rotation[0, 0] * dx + rotation[1, 0] * dy + rotation[2, 0] * dz
    ly = rotation[0, 1] * dx + rotation[1, 1] * dy + rotation[2, 1] * dz
    lz = rotation[0, 2] * dx + rotation[1, 2] * dy + rotation[2, 2] * dz
    return signed_distance(body.kind, body.size, (lx, ly, lz), body.samples)


@kernel
def most_crossings(phi: Array, h: float, flat: bool) -> int:
    """How often edges may be crossed: once between a node inside and one that is not, twice between
    two open ones that are together nearer to the body than to each other, but for rounding."""
    count, edge = 0, (1.0 + SHIFT) * h
    ni, nj, nk = phi.shape
    for i in range(ni):
        for j in range(nj):
            for k in range(1 if flat else nk):
                for d in range(2 if flat else 3):
                    a, b, c = i + int(d == 0), j + int(d == 1), k + int(d == 2)
                    if a < ni and b < nj and c < nk:
                        low, high = phi[i, j, k], phi[a, b, c]
                        count += int((low < 0.0) != (high < 0.0))
                        count += 2 * int(min(low, high) >= 0.0 and low + high < edge)
    return count


def new_crossings(phi: Array, h: float, flat: bool) -> Crossings:
    """Room for where a body crosses edges in its box, from the distance to it at the nodes, m."""
    count = most_crossings(phi, h, flat)
    at = np.full((3, *phi.shape), -1, np.int32)
    return Crossings(at, np.empty(count), np.empty((count, 3)), np.empty(count, np.int64))


def together(shape: tuple[int, ...], each: Sequence[Crossings]) -> Crossings:
    """The crossings with several bodies in one list, for nodes of this shape, as yet on no edge."""
    own = [np.zeros(0), np.zeros((0, 3)), np.zeros(0, np.int64)]
    lists = (np.concatenate(parts) for parts in zip(own, *(c[1:] for c in each), strict=True))
    return Crossings(np.full((3, *shape), -1, np.int32), *lists)


@kernel
def add_crossing(
    found: Crossings, used: Integers, edge: tuple[int, int, int, int], twice: bool, upper: bool,
    part: float, normal: Array, piece: int,
) -> None:  # fmt: skip
    """Note a crossing, if none is nearer to the open node of its edge.

    used   (1,) how many numbers are taken
    edge   its axis, and the indices of its lower node
    twice  whether both nodes are open;  upper  whether this is the one next to the upper
    """
    n = found.at[edge]
    if n < 0:
        n = used[0]
        assert n + int(twice) < found.part.size
        found.at[edge] = n
        used[0] += 1 + int(twice)
        found.part[n : used[0]] = np.inf
    n += int(upper)
    if part < found.part[n]:
        found.part[n], found.piece[n] = part, piece
        for m in range(3):
            found.normal[n, m] = normal[m]


@kernel
def cross_geometry(
    found: Crossings, used: Integers, phi: Array, box: Integers, body: Placed, number: int,
    nodes: Nodes,
) -> None:  # fmt: skip
    """Note where edges cross a geometry, this `number`, of a body.

    phi  distance to the body at the nodes of its box, m;  box  (3, 2) node ranges
    """
    point, normal, (origin, h, flat) = np.empty(3), np.empty(3), nodes
    ni, nj, nk = phi.shape
    for i in range(ni):
        for j in range(nj):
            for k in range(1 if flat else nk):
                low = phi[i, j, k]
                for d in range(2 if flat else 3):
                    a, b, c = i + int(d == 0), j + int(d == 1), k + int(d == 2)
                    if a == ni or b == nj or c == nk:
                        continue
                    high = phi[a, b, c]
                    twice = min(low, high) >= 0.0
                    if low + high >= h if twice else max(low, high) < 0.0:
                        continue
                    point[0] = origin[0] + h * (box[0, 0] + i)
                    point[1] = origin[1] + h * (box[1, 0] + j)
                    point[2] = 0.0 if flat else origin[2] + h * (box[2, 0] + k)
                    start = point[d]
                    goal = start
                    if twice:
                        goal += dip(body, point, d, h)
                        if goal <= start:
                            continue
                    elif low >= 0.0:
                        goal += h
                    for upper in range(2):
                        if (low, high)[upper] < 0.0:
                            continue
                        point[d] = start + upper * h
                        step = goal - point[d]
                        part = abs(step) / h * root(body, point, d, step, ROOT * h)
                        if part >= 0.0:
                            piece = number * PIECES + surface_at(body, point, SHIFT * h, normal)
                            at_upper = twice and upper > 0
                            edge = d, i, j, k
                            add_crossing(found, used, edge, twice, at_upper, part, normal, piece)


@kernel
def dip(body: Placed, point: Array, d: int, h: float) -> float:
    """How far along the edge of length h from a point there is a place inside, m; 0 for none.

    A search for the least distance by golden sections, until it cannot be below 0: distances differ
    by no more than places do.
    """
    start, a, b = point[d], 0.0, h
    m, fm, n, fn = 0.0, np.inf, 0.0, np.inf
    while min(fm, fn) < b - a or np.isinf(min(fm, fn)):
        if np.isinf(fm):
            m = b - GOLDEN * (b - a)
            point[d] = start + m
            fm = distance_to(body, point[0], point[1], point[2])
        if np.isinf(fn):
            n = a + GOLDEN * (b - a)
            point[d] = start + n
            fn = distance_to(body, point[0], point[1], point[2])
        if fm < 0.0:
            return m
        if fn < 0.0:
            return n
        if b - a < LEAST_DIP * h:
            break
        if fm < fn:
            b, n, fn, fm = n, m, fm, np.inf
        else:
            a, m, fm, fn = m, n, fn, np.inf
    return 0.0


@kernel
def merge_crossings(
    at: Indices, part: Array, distance: Array, own: Indices, phi: Array,
    box: Integers, first: int,
) -> None:  # fmt: skip
    """Let each edge in a body's box keep the crossings that leave the least of it open.

    at         (3, nx+1, ny+1, nz+1) numbers of the crossings with all bodies;  part  open parts
    distance   to all bodies at the nodes, m;  phi  to this one in its box
    own        the body's, see `Crossings`; those of edges that are not closed are taken away
    first      number of the body's first crossing
    """
    for d in range(3):
        for i in range(own.shape[1] - int(d == 0)):
            for j in range(own.shape[2] - int(d == 1)):
                for k in range(own.shape[3] - int(d == 2)):
                    if own[d, i, j, k] < 0:
                        continue
                    p, q, r = i + int(d == 0), j + int(d == 1), k + int(d == 2)
                    a, b, c = i + box[0, 0], j + box[1, 0], k + box[2, 0]
                    n = first + own[d, i, j, k]
                    twice = min(phi[i, j, k], phi[p, q, r]) >= 0.0
                    if twice and part[n] + part[n + 1] >= 1.0:
                        own[d, i, j, k] = -1
                        continue
                    low, high = distance[a, b, c], distance[a + p - i, b + q - j, c + r - k]
                    if twice and min(low, high) < 0.0:
                        continue
                    m = at[d, a, b, c]
                    if m >= 0:
                        less = part[n] - part[m]
                        if twice:
                            less += part[n + 1] - part[m + 1]
                        if less >= 0.0:
                            continue
                    at[d, a, b, c] = n


@kernel
def root(body: Placed, point: Array, d: int, step: float, tolerance: float) -> float:
    """Part of the way from a point along axis d at which the distance is 0, by the Illinois method;
    the point moves there. -1 when the way does not end inside.

    step  length of the way, m, negative downward;  tolerance  m
    """
    start, a, b, last = point[d], 0.0, 1.0, 0
    high = max(distance_to(body, point[0], point[1], point[2]), 0.0)
    point[d] = start + step
    low = distance_to(body, point[0], point[1], point[2])
    if low >= 0.0:
        return -1.0
    for _ in range(100):
        s = (high * b - low * a) / (high - low)
        point[d] = start + s * step
        value = distance_to(body, point[0], point[1], point[2])
        if abs(value) <= tolerance:
            break
        if value >= 0.0:
            a, high = s, value
            if last > 0:
                low *= 0.5
            last = 1
        else:
            b, low = s, value
            if last < 0:
                high *= 0.5
            last = -1
    return float(s)


@kernel
def surface_at(body: Placed, point: Array, shift: float, normal: Array) -> int:
    """Number of the smooth piece of the surface at a point; its normal is written to `normal`."""
    x, y, z = point
    normal[0] = distance_to(body, x + shift, y, z) - distance_to(body, x - shift, y, z)
    normal[1] = distance_to(body, x, y + shift, z) - distance_to(body, x, y - shift, z)
    normal[2] = distance_to(body, x, y, z + shift) - distance_to(body, x, y, z - shift)
    size = max(np.sqrt(along(normal, normal)), 1e-300)
    for m in range(3):
        normal[m] /= size
    return piece_of(body.kind, normal @ body.rotation)


@kernel
def piece_of(kind: int, normal: Array) -> int:
    """Number of the smooth piece that has a normal in the geometry's frame."""
    if kind == BOX:
        m = int(np.argmax(np.abs(normal)))
        return 1 + 2 * m + int(normal[m] > 0.0)
    if kind == CYLINDER and abs(normal[2]) > np.sqrt(0.5):
        return 1 + int(normal[2] > 0.0)
    return 0
