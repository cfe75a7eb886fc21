"""Sums and steps of padded vectors.

Sums run plane after plane, so that they do not depend on how many threads there are.
"""

from __future__ import annotations

import numpy as np
from numba import prange

from flowborne.kernels.arrays import Array, Real
from flowborne.kernels.jit import inlined, kernel


@kernel
def scaled(source: Real, target: Real, scale: float) -> None:
    """target = scale x source, in target's precision."""
    a, b = source.reshape(-1), target.reshape(-1)
    for n in prange(a.size):
        b[n] = scale * a[n]


@inlined
def in_order(parts: Array) -> float:
    """Sum, first to last."""
    total = 0.0
    for i in range(parts.size):
        total += parts[i]
    return total


@kernel
def dot(a: Real, b: Array, scale: float = 1.0) -> float:
    """Sum of scale x a x b, planes in order."""
    planes, size = b.shape[0], b.shape[2]
    parts = np.zeros(planes)
    for i in prange(planes):
        row = np.zeros(size)
        for j in range(b.shape[1]):
            for k in range(size):
                row[k] += scale * a[i, j, k] * b[i, j, k]
        parts[i] = in_order(row)
    return in_order(parts)


@kernel
def descend(
    x: Array | None,
    r: Array,
    p: Array | None,
    q: Array,
    alpha: float,
    b: Real | None = None,
    scale: float = 1.0,
) -> float:
    """x += alpha p, r -= alpha q, and b = scale x r in b's precision; returns r . r."""
    planes, size = r.shape[0], r.shape[2]
    parts = np.zeros(planes)
    for i in prange(planes):
        row = np.zeros(size)
        for j in range(r.shape[1]):
            for k in range(size):
                if x is not None and p is not None:
                    x[i, j, k] += alpha * p[i, j, k]
                value = r[i, j, k] - alpha * q[i, j, k]
                r[i, j, k] = value
                if b is not None:
                    b[i, j, k] = scale * value
                row[k] += value * value
        parts[i] = in_order(row)
    return in_order(parts)


@kernel
def turn(p: Array, z: Array, beta: float) -> None:
    """p = z + beta p."""
    for i in prange(p.shape[0]):
        for j in range(p.shape[1]):
            for k in range(p.shape[2]):
                p[i, j, k] = z[i, j, k] + beta * p[i, j, k]


@kernel
def load_cells(target: Array, source: Array, diagonal: Array) -> None:
    """Cells into a padded array; 0 in ghosts and in cells without an open face."""
    d = 1 if target.shape[0] > 1 else 0
    n1, n2 = source.shape[1], source.shape[2]
    for i in prange(target.shape[0]):
        target[i] = 0.0
        if d == 0 or 0 < i < target.shape[0] - 1:
            for j in range(n1):
                for k in range(n2):
                    value, active = source[i - d, j, k], diagonal[i, j + 1, k + 1] > 0.0
                    target[i, j + 1, k + 1] = value if active else 0.0
