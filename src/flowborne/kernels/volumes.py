"""Open volume of the cells: that of the polyhedron that the open parts of its faces bound."""

from __future__ import annotations

import numpy as np
from numba import njit

from flowborne.kernels.arrays import Array, Integers
from flowborne.kernels.cut_faces import closed_face, is_cut, nodes_inside, open_edge, other_axes
from flowborne.kernels.edge_crossings import Crossings


@njit(nogil=True, cache=True)
def wall_point(
    distance: Array, found: Crossings, i: int, j: int, k: int, point: Array, scratch: Array
) -> bool:
    """Find a point of the wall within cell (i, j, k), if it has one: triangles join it to where the
    wall meets the faces.

    Where the wall has an edge, the middle of this. A smooth wall is a paraboloid, whose tangent
    planes at the crossings pass its top twice as high as it is; a cone three quarters as high as
    they do has its volume.

    point    (3,) from the lower corner of the cell, cells, overwritten
    scratch  (3, 3)
    """
    middle, mean, place = scratch
    middle[:], mean[:] = 0.0, 0.0
    corners = 0
    for axis in range(3):
        s, t = other_axes(axis)
        for side in range(2):
            a, b, c = (
                i + side * int(axis == 0),
                j + side * int(axis == 1),
                k + side * int(axis == 2),
            )
            if is_cut(distance, found, axis, a, b, c):
                _, _, _, count, x, y = closed_face(distance, found, axis, a, b, c, False, False)
                corners += count
                middle[axis] += side * count
                middle[s] += x
                middle[t] += y
    if corners > 0:
        point[:] = middle / corners
        return True
    count, rise = 0, 0.0
    for d in range(3):
        s, t = other_axes(d)
        for n in range(4):
            place[s], place[t] = n // 2, n % 2
            place[d] = 0.0
            a, b, c = i + int(place[0]), j + int(place[1]), k + int(place[2])
            low = distance[a, b, c]
            high = distance[a + int(d == 0), b + int(d == 1), c + int(d == 2)]
            first = found.at[d, a, b, c]
            twice = min(low, high) >= 0.0
            if first < 0 if twice else (low < 0.0) == (high < 0.0):
                continue
            for e in range(first, first + 1 + int(twice)):
                part = open_edge(distance, found, d, a, b, c)
                if twice:
                    part = found.part[e]
                upward = e > first if twice else low < 0.0
                place[d] = 1.0 - part if upward else part
                count += 1
                for m in range(3):
                    middle[m] += place[m]
                    if e >= 0:
                        mean[m] += found.normal[e, m]
                        rise += found.normal[e, m] * place[m]
    if count == 0:
        return False
    rise = (rise - (mean * middle).sum() / count) / max(np.sqrt((mean**2).sum()), 1e-300) / count
    for m in range(3):
        point[m] = min(max(middle[m] / count + 0.75 * rise * mean[m], 0.0), 1.0)
    return True


@njit(nogil=True, cache=True)
def open_cells(
    part: Array, distance: Array, found: Crossings, ox: Array, oy: Array, oz: Array, box: Integers
) -> None:
    """Open part of the cells in a box of nodes; 0 where all faces of a cell are closed.

    In a slab that of its cross-section, the open part of its faces across z; else the sum of the
    pyramids from a point of the wall over the open parts of the faces: its own triangles add none.

    part        (nx, ny, nz), overwritten in the box
    distance    to the bodies at the nodes;  found  where edges cross these
    ox, oy, oz  open parts of the faces
    """
    flat = part.shape[2] == 1
    point, scratch = np.empty(3), np.empty((3, 3))
    for i in range(box[0, 0], box[0, 1] - 1):
        for j in range(box[1, 0], box[1, 1] - 1):
            for k in range(box[2, 0], box[2, 1] - 1):
                shut = 4.0 - ox[i, j, k] - ox[i + 1, j, k] - oy[i, j, k] - oy[i, j + 1, k]
                if not flat:
                    shut += 2.0 - oz[i, j, k] - oz[i, j, k + 1]
                inside = nodes_inside(distance, 0, i, j, k) + nodes_inside(distance, 0, i + 1, j, k)
                if shut == (4.0 if flat else 6.0) or inside == 8:
                    part[i, j, k] = 0.0
                elif inside == 0 and shut == 0.0:
                    part[i, j, k] = 1.0
                elif flat:
                    part[i, j, k] = 1.0 - closed_face(distance, found, 2, i, j, k, True, False)[0]
                elif not wall_point(distance, found, i, j, k, point, scratch):
                    part[i, j, k] = 1.0
                else:
                    x, y, z = point
                    volume = (
                        x * ox[i, j, k] + (1.0 - x) * ox[i + 1, j, k]
                        + y * oy[i, j, k] + (1.0 - y) * oy[i, j + 1, k]
                        + z * oz[i, j, k] + (1.0 - z) * oz[i, j, k + 1]
                    ) / 3.0  # fmt: skip
                    part[i, j, k] = min(max(volume, 0.0), 1.0)
