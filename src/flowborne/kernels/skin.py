"""Distance to a closed surface of triangles, a skin, at the nodes of the grid.

The skin of deforming flesh moves every step, so distances are found afresh and only near to it:
each triangle visits the nodes around it. What is inside is told by following the grid's lines
along x and counting, with their sign, the triangles that they cross. Where flesh overlaps itself
the count is 2, and that is inside as well.
"""

from __future__ import annotations

import numpy as np

from flowborne.kernels.arrays import Array, Integers, Nodes, Point
from flowborne.kernels.edge_crossings import Crossings, add_crossing
from flowborne.kernels.jit import inlined, kernel
from flowborne.kernels.node_distance import BAND
from flowborne.kernels.triangles import closest_on_triangle, squared_distance

BESIDE = 2.0
"""Places are moved by the skin up to this many cells away."""

ON_SKIN = 1e-9
"""A node as many cells from the skin or nearer lies on it, and counts as this far inside."""


CLEARLY, ROUNDED = 1.0 + 1e-9, 1e-18
"""Ratio of squared distances, and cells squared besides, from which on one is the larger one,
whatever is rounded."""


@inlined
def box_square(p: Point, a: Point, b: Point, c: Point) -> float:
    """Square of the distance from a place to the box around a triangle, which that to the triangle
    is not below."""
    total = 0.0
    for m in range(3):
        low, high = min(a[m], b[m], c[m]), max(a[m], b[m], c[m])
        away = max(low - p[m], p[m] - high, 0.0)
        total += away * away
    return total


@kernel
def first_node(x: float, count: int) -> int:
    """First of `count` nodes 0, 1, ... at or beyond x; `count` where there is none."""
    if not x > 0.0:
        return 0
    return int(np.ceil(x)) if x < count else count


@kernel
def skin_box(vertices: Array, nodes: Nodes, shape: Integers) -> Integers:
    """Node ranges (low, high per axis) around all vertices (n, 3), with the band; may be empty."""
    box, (origin, h, _) = np.empty((3, 2), np.int64), nodes
    for axis in range(3):
        low = (vertices[:, axis].min() - origin[axis]) / h
        high = (vertices[:, axis].max() - origin[axis]) / h
        box[axis, 0] = first_node(np.floor(low - BAND), shape[axis] + 1)
        box[axis, 1] = first_node(np.ceil(high + BAND) + 1.0, shape[axis] + 1)
    return box


@kernel
def edge_at(p: Point, q: Point, z: float) -> tuple[float, float]:
    """(x, y) where the edge between p and q passes z; the same numbers from both of its ends."""
    low, high = (p, q) if p[2] <= z else (q, p)
    t = (z - low[2]) / (high[2] - low[2])
    return low[0] + t * (high[0] - low[0]), low[1] + t * (high[1] - low[1])


@kernel
def add_crossings(
    entered: Integers, counts: tuple[int, int, int], a: Point, b: Point, c: Point
) -> None:
    """Count one triangle where grid lines along x cross it: 1 at the first node beyond it where
    the line enters, -1 where it leaves.

    Nodes are 0, 1, ... along each axis. Row by row in z the triangle covers the nodes in y between
    two of its edges, the lower end included and the upper one not. Neighbours find the same ends
    on the edge that they share, so what they count never overlaps and leaves no gap.
    """
    low = first_node(min(a[2], b[2], c[2]), counts[2])
    high = first_node(max(a[2], b[2], c[2]), counts[2])
    for k in range(low, high):
        below_a, below_b, below_c = a[2] <= k, b[2] <= k, c[2] <= k
        if below_b == below_c:
            alone, after, before, below = a, b, c, below_a
        elif below_c == below_a:
            alone, after, before, below = b, c, a, below_b
        else:
            alone, after, before, below = c, a, b, below_c
        x1, y1 = edge_at(alone, after, k)
        x2, y2 = edge_at(alone, before, k)
        j1, j2 = first_node(y1, counts[1]), first_node(y2, counts[1])
        enters = 1 if below == (j1 < j2) else -1
        for j in range(min(j1, j2), max(j1, j2)):
            i = first_node(x1 + (j - y1) / (y2 - y1) * (x2 - x1), counts[0])
            if i < counts[0]:
                entered[i, j, k] += enters


@kernel
def lower_squares(
    square: Array, counts: tuple[int, int, int], a: Point, b: Point, c: Point, band: float
) -> None:
    """Lower the squared distance to the skin, in cells, to that of one triangle, at the nodes that
    are up to `band` cells beside it."""
    first_i = first_node(min(a[0], b[0], c[0]) - band, counts[0])
    last_i = first_node(max(a[0], b[0], c[0]) + band, counts[0])
    first_j = first_node(min(a[1], b[1], c[1]) - band, counts[1])
    last_j = first_node(max(a[1], b[1], c[1]) + band, counts[1])
    first_k = first_node(min(a[2], b[2], c[2]) - band, counts[2])
    last_k = first_node(max(a[2], b[2], c[2]) + band, counts[2])
    nx = (b[1] - a[1]) * (c[2] - a[2]) - (b[2] - a[2]) * (c[1] - a[1])
    ny = (b[2] - a[2]) * (c[0] - a[0]) - (b[0] - a[0]) * (c[2] - a[2])
    nz = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
    length = np.sqrt(nx * nx + ny * ny + nz * nz)
    if length > 0.0:
        nx, ny, nz = nx / length, ny / length, nz / length
    for i in range(first_i, last_i):
        for j in range(first_j, last_j):
            above = nx * (i - a[0]) + ny * (j - a[1]) - nz * a[2]
            for k in range(first_k, last_k):
                if (above + nz * k) ** 2 >= square[i, j, k]:
                    continue
                p = (float(i), float(j), float(k))
                if box_square(p, a, b, c) > CLEARLY * square[i, j, k] + ROUNDED:
                    continue
                found = squared_distance(p, a, b, c, closest_on_triangle(p, a, b, c))
                square[i, j, k] = min(square[i, j, k], found)


@kernel
def sample_skin(
    vertices: Array, triangles: Integers, box: Integers, nodes: Nodes, band: float
) -> Array:
    """(box shape) signed distance to a skin at the nodes of its box, m, negative inside.

    Exact within `band` cells of the skin, beyond them as large as that; never 0, for what is
    on the skin is inside (ON_SKIN).

    vertices   (n, 3) m
    triangles  (k, 3) vertices of each, counterclockwise from outside; together a closed surface
    box        (3, 2) node ranges, may cut the skin off
    nodes      of a slab: only triangles that reach z = 0 count for the distance, so the ends of a
               prism may be at any height
    band       cells
    Where flesh overlaps itself the distance is the one to the nearest sheet, covered ones included.
    """
    origin, h, flat = nodes
    shape = (box[0, 1] - box[0, 0], box[1, 1] - box[1, 0], box[2, 1] - box[2, 0])
    counts = (shape[0], shape[1], min(shape[2], 1) if flat else shape[2])
    places = (vertices - origin) / h - box[:, 0]
    if flat:
        places[:, 2] = vertices[:, 2] / h
    phi = np.full(shape, band**2)
    winding = np.zeros(shape, np.int64)
    for t in range(triangles.shape[0]):
        n, m, o = triangles[t, 0], triangles[t, 1], triangles[t, 2]
        a = (places[n, 0], places[n, 1], places[n, 2])
        b = (places[m, 0], places[m, 1], places[m, 2])
        c = (places[o, 0], places[o, 1], places[o, 2])
        add_crossings(winding, counts, a, b, c)
        if not flat or min(a[2], b[2], c[2]) <= 0.0 <= max(a[2], b[2], c[2]):
            lower_squares(phi, counts, a, b, c, band)
    for i in range(counts[0]):
        for j in range(counts[1]):
            for k in range(counts[2]):
                if i > 0:
                    winding[i, j, k] += winding[i - 1, j, k]
                distance = np.sqrt(phi[i, j, k])
                if winding[i, j, k] >= 1 or distance < ON_SKIN:
                    distance = -max(distance, ON_SKIN)
                phi[i, j, k] = distance * h
    if flat:
        phi[:, :, 1:] = phi[:, :, :1]
    return phi


@kernel
def cross_skin(
    found: Crossings, used: Integers, phi: Array, vertices: Array, triangles: Integers,
    piece: Integers, box: Integers, nodes: Nodes,
) -> None:  # fmt: skip
    """Note where edges cross a skin (see `edge_crossings`).

    phi    distance to the body or flesh at the nodes of its box, m
    piece  (k,) smooth piece of each triangle
    """
    origin, h, flat = nodes
    places = (vertices - origin) / h - box[:, 0]
    if flat:
        places[:, 2] = vertices[:, 2] / h
    normal, node = np.empty(3), np.empty(3, np.int64)
    for t in range(triangles.shape[0]):
        a, b, c = places[triangles[t, 0]], places[triangles[t, 1]], places[triangles[t, 2]]
        for m in range(3):
            e, g = (m + 1) % 3, (m + 2) % 3
            normal[m] = (b[e] - a[e]) * (c[g] - a[g]) - (b[g] - a[g]) * (c[e] - a[e])
        area = np.sqrt((normal**2).sum())
        if area == 0.0:
            continue
        unit = normal / area
        for d in range(2 if flat else 3):
            e, g = (d + 1) % 3, (d + 2) % 3
            if normal[d] == 0.0:
                continue
            counts_e = 1 if flat and e == 2 else phi.shape[e]
            counts_g = 1 if flat and g == 2 else phi.shape[g]
            low_e = first_node(min(a[e], b[e], c[e]) - ON_SKIN, counts_e)
            high_e = first_node(max(a[e], b[e], c[e]) + ON_SKIN, counts_e)
            low_g = first_node(min(a[g], b[g], c[g]) - ON_SKIN, counts_g)
            high_g = first_node(max(a[g], b[g], c[g]) + ON_SKIN, counts_g)
            for p in range(low_e, high_e):
                for q in range(low_g, high_g):
                    va = ((b[e] - p) * (c[g] - q) - (b[g] - q) * (c[e] - p)) / normal[d]
                    vb = ((c[e] - p) * (a[g] - q) - (c[g] - q) * (a[e] - p)) / normal[d]
                    vc = 1.0 - va - vb
                    if min(va, vb, vc) < -ON_SKIN:
                        continue
                    x = va * a[d] + vb * b[d] + vc * c[d]
                    if x < 0.0 or x >= phi.shape[d] - 1:
                        continue
                    node[d], node[e], node[g] = int(x), p, q
                    lower = phi[node[0], node[1], node[2]] < 0.0
                    node[d] += 1
                    upper = phi[node[0], node[1], node[2]] < 0.0
                    node[d] -= 1
                    enters = normal[d] < 0.0
                    if (lower and (upper or enters)) or (upper and not enters):
                        continue
                    part = x - node[d] if enters else node[d] + 1.0 - x
                    twice = not lower and not upper
                    edge = d, node[0], node[1], node[2]
                    at_upper = twice and not enters
                    add_crossing(found, used, edge, twice, at_upper, part, unit, piece[t])


@kernel
def triangles_by_cell(
    x: Array, vertices: Array, triangles: Integers, h: float
) -> tuple[Integers, Integers, Integers]:
    """For cells of edge h around places x (m, 3): the triangles within BESIDE cells of each.

    returns  (m,) number of the place's cell; where its triangles begin in the list; the list
    """
    low = np.array([x[:, d].min() for d in range(3)])
    counts = np.array([np.int64((x[:, d].max() - low[d]) / h) + 1 for d in range(3)])
    slot = np.full((counts[0], counts[1], counts[2]), -1)
    number = np.empty(x.shape[0], np.int64)
    cells = 0
    for row in range(x.shape[0]):
        i = int((x[row, 0] - low[0]) / h)
        j = int((x[row, 1] - low[1]) / h)
        k = int((x[row, 2] - low[2]) / h)
        if slot[i, j, k] < 0:
            slot[i, j, k] = cells
            cells += 1
        number[row] = slot[i, j, k]
    start = np.zeros(cells + 1, np.int64)
    found = np.empty(0, np.int64)
    for turn in range(2):  # count, then list
        for t in range(triangles.shape[0]):
            first, last = np.empty(3, np.int64), np.empty(3, np.int64)
            for d in range(3):
                a, b = vertices[triangles[t, 0], d], vertices[triangles[t, 1], d]
                c = vertices[triangles[t, 2], d]
                lower, upper = (min(a, b, c) - low[d]) / h, (max(a, b, c) - low[d]) / h
                first[d] = max(int(np.floor(lower - BESIDE)), 0)
                last[d] = min(int(np.floor(upper + BESIDE)), counts[d] - 1)
            for i in range(first[0], last[0] + 1):
                for j in range(first[1], last[1] + 1):
                    for k in range(first[2], last[2] + 1):
                        n = slot[i, j, k]
                        if n >= 0 and turn == 0:
                            start[n + 1] += 1
                        elif n >= 0:
                            start[n] -= 1
                            found[start[n]] = t
        if turn == 0:
            start = np.cumsum(start)
            found = np.empty(start[-1], np.int64)
            start[:-1] = start[1:]  # filled from the end of each
    return number, start, found


@kernel
def skin_weights(
    x: Array, vertices: Array, triangles: Integers, h: float
) -> tuple[Integers, Array]:
    """Vertices and their weights at the point of the skin that is closest to each place.

    x        (m, 3) places, m;  h  length of a cell, m
    returns  corners (m, 3) and weights (m, 3), which sum to 1; all 0 farther than BESIDE cells away
    """
    corners = np.zeros((x.shape[0], 3), np.int64)
    weights = np.zeros((x.shape[0], 3))
    if x.shape[0] == 0:
        return corners, weights
    number, start, listed = triangles_by_cell(x, vertices, triangles, h)
    for row in range(x.shape[0]):
        p = (x[row, 0], x[row, 1], x[row, 2])
        nearest = bound = (BESIDE * h) ** 2
        if row > 0 and weights[row - 1].any():  # that of the place before is near this one as well
            n, m, o = corners[row - 1]
            a = (vertices[n, 0], vertices[n, 1], vertices[n, 2])
            b = (vertices[m, 0], vertices[m, 1], vertices[m, 2])
            c = (vertices[o, 0], vertices[o, 1], vertices[o, 2])
            found = closest_on_triangle(p, a, b, c)
            bound = min(bound, squared_distance(p, a, b, c, found))
        for at in range(start[number[row]], start[number[row] + 1]):
            t = listed[at]
            n, m, o = triangles[t, 0], triangles[t, 1], triangles[t, 2]
            a = (vertices[n, 0], vertices[n, 1], vertices[n, 2])
            b = (vertices[m, 0], vertices[m, 1], vertices[m, 2])
            c = (vertices[o, 0], vertices[o, 1], vertices[o, 2])
            if box_square(p, a, b, c) > CLEARLY * bound + ROUNDED * h * h:
                continue
            found = closest_on_triangle(p, a, b, c)
            square = squared_distance(p, a, b, c, found)
            if square < nearest:
                nearest, bound = square, min(bound, square)
                for corner in range(3):
                    corners[row, corner] = triangles[t, corner]
                    weights[row, corner] = found[corner]
    return corners, weights
