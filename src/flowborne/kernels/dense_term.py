"""A term U diag(s) U^T between some cells, of few vectors that hold values in all of them."""

from __future__ import annotations

import numpy as np

from flowborne.kernels.arrays import Array, Integers
from flowborne.kernels.jit import inlined, kernel

LANES = 8
"""Partial sums of a scalar product, so that the compiler makes vector code of it."""


@inlined
def product(a: Array, b: Array) -> float:
    """a . b, in LANES sums."""
    parts, whole = np.zeros(LANES), a.size // LANES * LANES
    for start in range(0, whole, LANES):
        for lane in range(LANES):
            parts[lane] += a[start + lane] * b[start + lane]
    total = 0.0
    for lane in range(LANES):
        total += parts[lane]
    for n in range(whole, a.size):
        total += a[n] * b[n]
    return total


@kernel
def add_term(out: Array, p: Array, cells: Integers, vectors: Array, strengths: Array) -> float:
    """out += U diag(s) U^T p; returns p . U diag(s) U^T p.

    cells      (n,) padded flat; a cell may be there several times
    vectors    (m, n) U^T
    strengths  (m,) s
    """
    flat, added = p.reshape(-1), out.reshape(-1)
    held, given, energy = np.empty(cells.size), np.zeros(cells.size), 0.0
    for n in range(cells.size):
        held[n] = flat[cells[n]]
    for m in range(strengths.size):
        vector = vectors[m]
        load = product(vector, held)
        motion = strengths[m] * load
        energy += motion * load
        for n in range(cells.size):
            given[n] += motion * vector[n]
    for n in range(cells.size):
        added[cells[n]] += given[n]
    return energy
