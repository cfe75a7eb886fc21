"""The kernels for transfer between levels in NumPy: slower, and nearer to what they mean."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from flowborne.kernels.aggregates import OWN
from flowborne.kernels.arrays import Array, Indices, Integers, Marks, Periodic, Real, Triple

from ..padded import cells_of


def coarse_parents(
    shape: tuple[int, int, int], coarse: tuple[int, int, int], marks: Marks, interpolation: Triple
) -> Iterator[tuple[tuple[Integers, Integers, Integers], Array]]:
    """Coarse cells that fine ones take their value from, orphans left aside.

    yields  padded indices of a coarse cell and its weight, for every fine cell: of the one over it,
            then of the next one along each axis
    """
    d = [int(n > 1) for n in shape]
    factor = [2 if n > c else 1 for n, c in zip(shape, coarse, strict=True)]
    fine = np.indices(tuple(n - 2 * s for n, s in zip(shape, d, strict=True)))
    over = [fine[n] // factor[n] + d[n] for n in range(3)]
    mark = marks[tuple(slice(s, n - s) for n, s in zip(shape, d, strict=True))]
    towards = [interpolation[n][fine[n] + 1] for n in range(3)]
    part = [np.abs(towards[n]) * ((mark & (1 << n)) > 0) for n in range(3)]
    yield (over[0], over[1], over[2]), ((mark & OWN) > 0) - part[0] - part[1] - part[2]
    for n in range(3):
        beyond = over.copy()
        beyond[n] = over[n] + d[n] * np.where(towards[n] > 0.0, 1, -1)
        yield (beyond[0], beyond[1], beyond[2]), part[n]


def interpolate_reference(
    x: Real,
    coarse: Real,
    marks: Marks,
    interpolation: Triple,
    orphans: Indices,
    aggregates: Indices,
) -> Array:
    """`interpolate` in NumPy: x after it."""
    out = np.array(x, np.float64)
    inside = cells_of(x)
    for index, weight in coarse_parents(x.shape, coarse.shape, marks, interpolation):
        out[inside] += weight * coarse[index]
    out.reshape(-1)[orphans] += coarse.reshape(-1)[aggregates.reshape(-1)[orphans]]
    return out


def restrict_reference(
    b: Real,
    r: Real,
    marks: Marks,
    interpolation: Triple,
    orphans: Indices,
    aggregates: Indices,
    periodic: Periodic,
) -> Array:
    """`restrict` in NumPy, the transpose of `interpolate_reference`: b with ghosts 0.

    periodic  what falls on the ghosts of such an axis belongs to the cells at its other end
    """
    out = np.zeros(b.shape)
    for index, weight in coarse_parents(r.shape, b.shape, marks, interpolation):
        np.add.at(out, index, weight * r[cells_of(r)])
    for axis in range(3):
        ends = np.moveaxis(out, axis, 0)
        if len(ends) > 1:
            if periodic[axis]:
                ends[-2] += ends[0]
                ends[1] += ends[-1]
            ends[0] = ends[-1] = 0.0
    np.add.at(out.reshape(-1), aggregates.reshape(-1)[orphans], r.reshape(-1)[orphans])
    return out
