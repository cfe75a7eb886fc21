"""Open volume of the cells, from where the bodies cut their corners' distances."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from flowborne.kernels.closed_fractions import closed_fraction

Array = NDArray[np.float64]


KUHN = np.array(
    [[0, 1, 3, 7], [0, 1, 5, 7], [0, 2, 3, 7], [0, 2, 6, 7], [0, 4, 5, 7], [0, 4, 6, 7]]
)
"""Corners 4 x + 2 y + z of six tetrahedra that make up a cube, all with one main diagonal."""

TETRAHEDRA = np.concatenate([KUHN ^ flip for flip in (0, 1, 2, 4)])
"""The same with each of the four diagonals: the mean over them knows no left and right."""


@njit(nogil=True, cache=True)
def closed_tetrahedron(a: float, b: float, c: float, d: float) -> float:
    """Part of a tetrahedron where the linear function with these corner values is negative."""
    if a > b:
        a, b = b, a
    if c > d:
        c, d = d, c
    if a > c:
        a, c = c, a
    if b > d:
        b, d = d, b
    if b > c:
        b, c = c, b
    if a >= 0.0:
        return 0.0
    if d < 0.0:
        return 1.0
    if b >= 0.0:
        return float(a / (a - b) * (a / (a - c)) * (a / (a - d)))
    if c < 0.0:
        return float(1.0 - d / (d - a) * (d / (d - b)) * (d / (d - c)))
    p, q, r, s = a / (a - c), a / (a - d), b / (b - c), b / (b - d)
    return float(p * q + (1.0 - p) * q * r + (1.0 - q) * r * s)


@njit(nogil=True, cache=True)
def is_clear(distance: Array, ox: Array, oy: Array, oz: Array, i: int, j: int) -> bool:
    """Whether no body touches a row of cells: outside of bodies at all corners, all faces open."""
    touched = 0
    for a in range(2):
        for b in range(2):
            row = distance[i + a, j + b]
            for k in range(row.size):
                touched += int(row[k] < 0.0)
        one, other = ox[i + a, j], oy[i, j + a]
        for k in range(one.size):
            touched += int(one[k] == 0.0) | int(other[k] == 0.0)
    if oz.shape[2] > 2:
        row = oz[i, j]
        for k in range(row.size):
            touched += int(row[k] == 0.0)
    return touched == 0


@njit(nogil=True, cache=True)
def open_parts(out: Array, distance: Array, ox: Array, oy: Array, oz: Array) -> None:
    """Open part of every cell; 0 where all its faces are closed.

    In a slab that of its cross-section; else the mean of four cubes of six tetrahedra, exact for a
    plane and the same for mirrored bodies.

    distance    to the bodies at the nodes
    ox, oy, oz  open parts of the faces
    """
    flat = out.shape[2] == 1
    phi = np.empty(8)
    for i in range(out.shape[0]):
        for j in range(out.shape[1]):
            if is_clear(distance, ox, oy, oz, i, j):
                out[i, j] = 1.0
                continue
            for k in range(out.shape[2]):
                least = np.inf
                for corner in range(8):
                    phi[corner] = distance[i + corner // 4, j + (corner // 2) % 2, k + corner % 2]
                    least = min(least, phi[corner])
                faces = ox[i, j, k] + ox[i + 1, j, k] + oy[i, j, k] + oy[i, j + 1, k]
                if not flat:
                    faces += oz[i, j, k] + oz[i, j, k + 1]
                if faces == 0.0:
                    out[i, j, k] = 0.0
                elif least >= 0.0:
                    out[i, j, k] = 1.0
                elif flat:
                    out[i, j, k] = 1.0 - closed_fraction(phi[0], phi[4], phi[6], phi[2])
                else:
                    closed = 0.0
                    for n in range(len(TETRAHEDRA)):
                        t = TETRAHEDRA[n]
                        closed += closed_tetrahedron(phi[t[0]], phi[t[1]], phi[t[2]], phi[t[3]])
                    out[i, j, k] = 1.0 - closed / len(TETRAHEDRA)
