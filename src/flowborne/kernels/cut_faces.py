"""The part of each face that bodies close: a polygon through the crossings on its four edges.

Between two crossings the wall goes as their normals have it. On two smooth pieces of the surface,
which meet in an edge or corner, it follows one tangent to where it meets the other; on one piece
it is the arc of a circle, which here is a polygon of the same area.
"""

from __future__ import annotations

import numpy as np

from flowborne.kernels.arrays import Array, Integers
from flowborne.kernels.edge_crossings import PIECES, Crossings
from flowborne.kernels.jit import inlined, kernel

SAME = 1e-9
"""Open parts of faces that differ by less are the same: one below it is closed."""

FLAT = 1e-2
"""Turn of the normal along an arc, radians, below which its area is that of a parabola's; smaller
ones leave rounding errors."""

Place = tuple[float, float]
Four = tuple[float, float, float, float]


@kernel
def other_axes(axis: int) -> tuple[int, int]:
    """The two others in their order."""
    return int(axis == 0), 2 - int(axis == 2)


@inlined
def open_edge(phi: Array, found: Crossings, d: int, i: int, j: int, k: int) -> float:
    """Open part of the edge from node (i, j, k) along d.

    phi  signed distance at the nodes; where no crossing is known, it is linear along the edge
    """
    a, b = phi[i, j, k], phi[i + int(d == 0), j + int(d == 1), k + int(d == 2)]
    n = found.at[d, i, j, k]
    if (a < 0.0) == (b < 0.0):
        if a < 0.0:
            return 0.0
        return 1.0 if n < 0 else found.part[n] + found.part[n + 1]
    return found.part[n] if n >= 0 else max(a, b) / (max(a, b) - min(a, b))


@inlined
def crossing_from(
    found: Crossings, number: int, near: float, far: float, upper: bool
) -> tuple[float, int]:
    """Part of an edge that is open from one of its nodes on up to a crossing, and the number of
    this; below 0 where there is none.

    number     what is known of the edge, see `Crossings`
    near, far  distances at this node and the other;  upper  whether this is the upper one
    """
    if near < 0.0 or (far >= 0.0 and number < 0):
        return -1.0, -1
    if far >= 0.0:
        number += int(upper)
    return found.part[number] if number >= 0 else near / (near - far), number


@inlined
def values_at(phi: Array, axis: int, i: int, j: int, k: int) -> Four:
    """Distance at the corners of face (i, j, k) across `axis` in turn."""
    s, t = other_axes(axis)
    si, sj, ti, tj, tk = int(s == 0), int(s == 1), int(t == 0), int(t == 1), int(t == 2)
    return (
        phi[i, j, k],
        phi[i + si, j + sj, k],
        phi[i + si + ti, j + sj + tj, k + tk],
        phi[i + ti, j + tj, k + tk],
    )


@inlined
def nodes_inside(phi: Array, axis: int, i: int, j: int, k: int) -> int:
    """How many of the four nodes of face (i, j, k) across `axis` are inside."""
    a, b, c, d = values_at(phi, axis, i, j, k)
    return int(a < 0.0) + int(b < 0.0) + int(c < 0.0) + int(d < 0.0)


@inlined
def edges_of(axis: int, i: int, j: int, k: int, found: Crossings) -> tuple[int, int, int, int]:
    """What is known of the four edges of face (i, j, k) across `axis` in turn, see `Crossings`."""
    s, t = other_axes(axis)
    at = found.at
    return (
        at[s, i, j, k],
        at[t, i + int(s == 0), j + int(s == 1), k],
        at[s, i + int(t == 0), j + int(t == 1), k + int(t == 2)],
        at[t, i, j, k],
    )


@inlined
def is_cut(phi: Array, found: Crossings, axis: int, i: int, j: int, k: int) -> bool:
    """Whether a wall is on face (i, j, k) across `axis`."""
    inside = nodes_inside(phi, axis, i, j, k)
    if inside == 0:
        return max(edges_of(axis, i, j, k, found)) >= 0
    return inside < 4


@inlined
def corner_of(n: int) -> Place:
    """Corners 0 to 3 of a unit square about the origin in turn."""
    return int(n == 1 or n == 2) - 0.5, int(n >= 2) - 0.5


@kernel
def wall_between(p: Place, q: Place, m: Place, n: Place, smooth: bool) -> tuple[float, float, bool]:
    """The point in the unit square about the origin by way of which a wall goes from p to q, with
    the body on its left; whether it is a corner.

    m, n    normals at p and q
    smooth  whether both are on one smooth piece
    """
    x, y = 0.5 * (p[0] + q[0]), 0.5 * (p[1] + q[1])
    size = np.sqrt((m[0] ** 2 + m[1] ** 2) * (n[0] ** 2 + n[1] ** 2))
    sine, cosine = m[0] * n[1] - m[1] * n[0], m[0] * n[0] + m[1] * n[1]
    right = q[1] - p[1], p[0] - q[0]
    outward = min(m[0] * right[0] + m[1] * right[1], n[0] * right[0] + n[1] * right[1])
    if abs(sine) <= 1e-9 * size or outward <= 0.0:
        return x, y, False
    a, b = m[0] * p[0] + m[1] * p[1], n[0] * q[0] + n[1] * q[1]
    dx, dy = (a * n[1] - b * m[1]) / sine - x, (m[0] * b - n[0] * a) / sine - y
    part = 1.0
    if smooth:
        turn = np.arctan2(abs(sine), cosine)
        half = 0.5 * turn
        part = 2.0 / 3.0
        if turn > FLAT:
            part = 0.5 * (turn - np.sin(turn)) / (np.sin(half) ** 2 * np.tan(half))
    if dx != 0.0:
        part = min(part, (np.copysign(0.5, dx) - x) / dx)
    if dy != 0.0:
        part = min(part, (np.copysign(0.5, dy) - y) / dy)
    return x + part * dx, y + part * dy, not smooth


@inlined
def add_line(sums: Array, p: Place, q: Place) -> None:
    """Add the triangle from the origin to p and q to six times an area's moments along both axes,
    and twice the area."""
    cross = p[0] * q[1] - q[0] * p[1]
    sums[0] += cross * (p[0] + q[0])
    sums[1] += cross * (p[1] + q[1])
    sums[2] += cross


@inlined
def between(p: Place, q: Place, part: float) -> Place:
    """The place that is `part` of the way from p to q."""
    return p[0] + part * (q[0] - p[0]), p[1] + part * (q[1] - p[1])


@kernel
def add_wall(
    sums: Array, p: Place, q: Place, e: int, f: int, found: Crossings, axes: tuple[int, int],
    straight: bool,
) -> int:  # fmt: skip
    """Add the wall from crossing e at p to crossing f at q, of which nothing is known below 0, to
    the sums of `add_line`, and its corner's place to the last two; gives how many corners it has.

    axes  of the face
    """
    s, t = axes
    if straight or e < 0 or f < 0:
        add_line(sums, p, q)
        return 0
    at_p = found.normal[e, s], found.normal[e, t]
    at_q = found.normal[f, s], found.normal[f, t]
    x, y, kink = wall_between(p, q, at_p, at_q, found.piece[e] == found.piece[f])
    add_line(sums, p, (x, y))
    add_line(sums, (x, y), q)
    if kink:
        sums[3] += x + 0.5
        sums[4] += y + 0.5
    return int(kink)


@kernel
def crossings_on(values: Four, crossing: tuple[int, int, int, int], out: Integers) -> int:
    """Write the numbers of the crossings around a face to `out`, -1 where one is not known; gives
    how many there are.

    values  distance at its corners in turn;  crossing  see `edges_of`;  out  (8,)
    """
    count = 0
    for n in range(4):
        begins, ends, e = values[n] < 0.0, values[(n + 1) % 4] < 0.0, crossing[n]
        if begins != ends:
            out[count] = e
            count += 1
        elif not begins and e >= 0:
            out[count], out[count + 1] = e, e + 1
            count += 2
    return count


@inlined
def of_one_geometry(listed: Integers, found: Crossings) -> bool:
    """Whether all crossings in a list are with the same one; not where one is not known."""
    for n in range(listed.size):
        e = listed[n]
        if e < 0 or found.piece[e] // PIECES != found.piece[listed[0]] // PIECES:
            return False
    return True


@inlined
def on_several_pieces(phi: Array, found: Crossings, axis: int, i: int, j: int, k: int) -> bool:
    """Whether the crossings around face (i, j, k) across `axis` are on more than one smooth piece:
    elsewhere the wall has no corner on it."""
    values, crossing, first = values_at(phi, axis, i, j, k), edges_of(axis, i, j, k, found), -1
    for n in range(4):
        e = crossing[n]
        twice = values[n] >= 0.0 and values[(n + 1) % 4] >= 0.0
        for m in range(e, e + 1 + int(twice) if e >= 0 else e):
            if first >= 0 and found.piece[m] != found.piece[first]:
                return True
            first = m
    return False


@kernel
def closed_face(
    phi: Array, found: Crossings, axis: int, i: int, j: int, k: int, flat: bool, straight: bool
) -> tuple[float, float, float, int, float, float]:
    """Closed part of face (i, j, k) across `axis`, and its moments about its centre along the
    two other axes, in cells; the number of corners of the wall on it, and the sum of their places.

    The sum over what bodies take of the edges and the walls from where the way around the face
    leaves bodies to where it next enters one (Green's theorem). So corners inside across a diagonal
    are joined: a thin body stays in one piece. Of several geometries what closes the middle of an
    edge stays by itself. A `straight` wall is the chord from crossing to crossing. In a slab,
    `flat`, a face across x or y is an edge.
    """
    s, t = other_axes(axis)
    if flat and axis < 2:
        d = 1 - axis
        n = found.at[d, i, j, k]
        part = 1.0 - open_edge(phi, found, d, i, j, k)
        upper = phi[i + int(d == 0), j + int(d == 1), k] >= 0.0
        low = 1.0 - part
        if phi[i, j, k] < 0.0:
            low = 0.0
        elif upper and n >= 0:
            low = found.part[n]
        return part, part * (low + 0.5 * part - 0.5), 0.0, 0, 0.0, 0.0
    values, crossing = values_at(phi, axis, i, j, k), edges_of(axis, i, j, k, found)
    listed = np.empty(8, np.int64)
    joined = of_one_geometry(listed[: crossings_on(values, crossing, listed)], found)
    sums, corners = np.zeros(5), 0
    p, exit, waits = (0.0, 0.0), -1, False
    for turn in range(8):
        n, m, first = turn % 4, (turn + 1) % 4, turn < 4
        if not first and not waits:
            break
        begins, ends = values[n] < 0.0, values[m] < 0.0
        ahead, f = crossing_from(found, crossing[n], values[n], values[m], n >= 2)
        back, g = crossing_from(found, crossing[n], values[m], values[n], n < 2)
        if not begins and ahead < 0.0:
            continue
        c, o = corner_of(n), corner_of(m)
        enters = c if begins else between(c, o, ahead)
        leaves = o if ends else between(o, c, back)
        if not (begins or ends or joined):
            if first:
                add_line(sums, enters, leaves)
                corners += add_wall(sums, leaves, enters, g, f, found, (s, t), straight)
            continue
        if not begins and waits:
            corners += add_wall(sums, p, enters, exit, f, found, (s, t), straight)
            waits = False
        if first:
            add_line(sums, enters, leaves)
            if not ends:
                p, exit, waits = leaves, g, True
    area = 0.5 * sums[2]
    if area <= 0.0:
        return 0.0, 0.0, 0.0, corners, sums[3], sums[4]
    return min(area, 1.0), sums[0] / 6.0, sums[1] / 6.0, corners, sums[3], sums[4]
