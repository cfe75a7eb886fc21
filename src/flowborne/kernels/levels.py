"""Levels of the multigrid hierarchy in packed arrays, and how coarse ones follow from fine ones.

Every level is a weighted cell Laplacian like the finest,

    (K p)_c = sum over faces f of c of  w_f (p_c - p_neighbour)

held by its lower-face weights in arrays with one layer of ghost cells, all levels of one quantity
in one flat array. Ghost values of p are 0, which is what lies beyond an open side, or those of the
opposite side where the domain is periodic. A coarse cell covers two fine ones along each axis that
is coarsened, fewer at the upper end of an odd count; a coarse weight is the sum of the fine ones
that its face covers, times the ratio of the fine to the coarse distance between centres.

A slab (nx, ny, 1) is held as (1, nx, ny), the same order in memory, with no ghosts across it.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import prange
from numpy.typing import NDArray

from flowborne.kernels.aggregates import (
    OWN,
    add_orphan_weights,
    assign_orphans,
    mark_interpolated,
    mark_own,
)
from flowborne.kernels.arrays import (
    Array,
    Finest,
    Hierarchy,
    Indices,
    Integers,
    Marks,
    Periodic,
    Real,
    Triple,
)
from flowborne.kernels.even import ROUNDING, SINGLE, find_even
from flowborne.kernels.faces import largest_size
from flowborne.kernels.jit import inlined, kernel
from flowborne.kernels.vectors import scaled


@inlined
def width(c: int, size: int, cells: int, periodic: bool) -> int:
    """Finest cells in cell c of `size` along an axis of `cells`: fewer at the upper end, none
    beyond the ends of one that is not periodic."""
    count = (cells + size - 1) // size
    if periodic:
        c = c % count
    return min(size, cells - c * size) if 0 <= c < count else 0


@kernel
def distance_ratio(face: int, factor: int, fine: int, cells: int, periodic: bool) -> float:
    """Distance between the centres beside fine face `factor * face` over that of the coarse face.

    face    of the coarse level, 0 to its last
    factor  1 or 2, the coarsening of this axis
    fine    finest cells in a fine cell of this axis; `cells` finest cells in all
    """
    at, wide = min(factor * face, (cells + fine - 1) // fine), fine * factor
    near = width(at - 1, fine, cells, periodic) + width(at, fine, cells, periodic)
    return near / (width(face - 1, wide, cells, periodic) + width(face, wide, cells, periodic))


@kernel
def interpolation_weights(
    interpolation: Real, n: int, factor: int, size: int, cells: int, periodic: bool
) -> None:
    """How far each fine cell's centre lies from its coarse cell's towards the next coarse cell.

    interpolation  (n + 2,) with ghosts: fraction of the distance between the coarse centres (at
                   an open side: of that to the side), negative towards the lower neighbour
    size      finest cells in a fine cell of this axis, `cells` finest cells in all
    """
    interpolation[:] = 0.0
    for i in range(n - n % 2 if factor == 2 else 0):
        c, upper = i // 2, i % 2
        a, b = width(2 * c, size, cells, periodic), width(2 * c + 1, size, cells, periodic)
        reach = a + b + width(c - 1 + 2 * upper, 2 * size, cells, periodic)
        interpolation[i + 1] = (a if upper else -b) / reach
    if periodic and factor == 2:
        interpolation[0], interpolation[n + 1] = interpolation[n], interpolation[1]


OFFSET, N0, N1, N2, INTERPOLATION, S0, S1, S2, ORPHANS, ROW, COMMON = range(11)
"""Columns of the table of levels: where it begins in the packed arrays, cells along each axis,
where its interpolation coefficients begin, the finest cells in one of its cells, how many of its
cells are orphans, where its rows begin, its common cell (see `even`)."""


@kernel
def padded_size(n0: int, n1: int, n2: int) -> int:
    """Cells of a level with its ghosts."""
    return (n0 + 2 if n0 > 1 else 1) * (n1 + 2) * (n2 + 2)


@kernel
def at_level(packed: NDArray[Any], table: Integers, level: int) -> NDArray[Any]:
    """The padded array of one level."""
    n0, n1, n2 = table[level, N0], table[level, N1], table[level, N2]
    p0 = n0 + 2 if n0 > 1 else 1
    first = table[level, OFFSET]
    last = first + p0 * (n1 + 2) * (n2 + 2)
    return packed[first:last].reshape((p0, n1 + 2, n2 + 2))


@kernel
def weights_at(packed: Triple, table: Integers, level: int) -> Triple:
    """The weights across each axis of one level."""
    w0, w1, w2 = packed
    return at_level(w0, table, level), at_level(w1, table, level), at_level(w2, table, level)


@kernel
def even_at(even: Marks, table: Integers, level: int) -> Marks:
    """Which padded rows of one level are even."""
    p0 = table[level, N0] + 2 if table[level, N0] > 1 else 1
    p1, first = table[level, N1] + 2, table[level, ROW]
    return even[first : first + p0 * p1].reshape((p0, p1))


@kernel
def interpolation_at(interpolation: Real, table: Integers, level: int) -> Triple:
    """The interpolation coefficients of one level along each axis, with ghosts."""
    a = table[level, INTERPOLATION]
    b = a + table[level, N0] + 2
    c = b + table[level, N1] + 2
    return interpolation[a:b], interpolation[b:c], interpolation[c : c + table[level, N2] + 2]


@kernel
def orphans_at(orphans: Indices, table: Integers, level: int) -> Indices:
    """Padded flat cells of one level that are orphans."""
    first = table[level, OFFSET]
    return orphans[first : first + table[level, ORPHANS]]


@kernel
def wrap_ghosts(x: NDArray[Any], periodic: Periodic) -> None:
    """Copy the values at each end of a periodic axis to the ghosts at the other end."""
    flat, shape, stride = x.reshape(-1), x.shape, (x.shape[1] * x.shape[2], x.shape[2], 1)
    for axis in range(3):
        n, step = shape[axis] - 2, stride[axis]
        if not periodic[axis] or n < 1:
            continue
        one, other = int(axis == 0), 2 - int(axis == 2)
        for a in range(shape[one]):
            for b in range(shape[other]):
                at = a * stride[one] + b * stride[other]
                flat[at] = flat[at + n * step]
                flat[at + (n + 1) * step] = flat[at + step]


@kernel
def finest_weights(
    faces: tuple[Array, Array, Array], w: tuple[Array, Array, Array], diagonal: Array
) -> None:
    """Face weights into the padded arrays of the finest level, and the diagonal of K.

    faces  weights (n0+1, n1, n2), (n0, n1+1, n2), (n0, n1, n2+1)
    w      padded with 0; entry c is the face between c and the cell before it along that axis
    """
    x, y, z = faces
    w0, w1, w2 = w
    d = 1 if w0.shape[0] > 1 else 0
    n1, n2 = w0.shape[1] - 2, w0.shape[2] - 2
    for i in prange(w0.shape[0] - d):
        inside = i < w0.shape[0] - 2 * d
        m = i + d
        for j in range(n1 + 1):
            for k in range(n2):
                if d and j < n1:
                    w0[m, j + 1, k + 1] = x[i, j, k]
                if inside:
                    w1[m, j + 1, k + 1] = y[i, j, k]
            if inside and j < n1:
                for k in range(n2 + 1):
                    w2[m, j + 1, k + 1] = z[i, j, k]
                for k in range(n2):
                    total = y[i, j, k] + y[i, j + 1, k] + z[i, j, k] + z[i, j, k + 1]
                    if d:
                        total += x[i, j, k] + x[i + 1, j, k]
                    diagonal[m, j + 1, k + 1] = total


@kernel
def coarse_weights(
    fine: Real, coarse: Real, marks: Marks, axis: int, factor: Integers, ratio: Array
) -> None:
    """Coarse lower-face weights across `axis` from faces between fine cells marked as OWN.

    factor  fine cells in a coarse one along each axis
    ratio   of distances, per coarse face across `axis`; see `distance_ratio`
    """
    f0, f1, f2 = factor
    d = 1 if fine.shape[0] > 1 else 0
    n0, n1, n2 = fine.shape[0] - 2 * d, fine.shape[1] - 2, fine.shape[2] - 2
    coarse[:] = 0.0
    if axis == 0 and not d:
        return
    s0, s1, s2 = int(axis == 0), int(axis == 1), int(axis == 2)
    planes = coarse.shape[0] - 2 * d + s0
    for i in prange(planes):
        row = np.empty(n2 + 2, fine.dtype)
        first0 = min(f0 * i, n0) + d
        end0 = first0 + 1 if axis == 0 else min(f0 * i + f0, n0) + d
        for j in range(coarse.shape[1] - 2 + s1):
            first1 = min(f1 * j, n1) + 1
            end1 = first1 + 1 if axis == 1 else min(f1 * j + f1, n1) + 1
            row[:] = 0.0
            for a in range(first0, end0):
                for b in range(first1, end1):
                    for k in range(1, n2 + 2):
                        both = marks[a, b, k] & marks[a - s0, b - s1, k - s2]
                        row[k] += fine[a, b, k] if both >= OWN else 0.0
            for k in range(coarse.shape[2] - 2 + s2):
                first2 = min(f2 * k, n2) + 1
                total = row[first2]
                if axis != 2 and first2 + 1 < min(f2 * k + f2, n2) + 1:
                    total += row[first2 + 1]
                shrink = ratio[i] if axis == 0 else (ratio[j] if axis == 1 else ratio[k])
                coarse[i + d, j + 1, k + 1] = total * shrink


@kernel
def inverse_diagonal(w: Triple, added: Real, inverse: Real) -> None:
    """1 / diagonal of K from padded weights and what is added to it; 0 in cells without an open
    face and in ghosts."""
    w0, w1, w2 = w
    d = 1 if w0.shape[0] > 1 else 0
    inverse[:] = 0.0
    for i in prange(w0.shape[0] - 2 * d):
        m = i + d
        for j in range(1, w0.shape[1] - 1):
            for k in range(1, w0.shape[2] - 1):
                total = w1[m, j, k] + w1[m, j + 1, k] + w2[m, j, k] + w2[m, j, k + 1]
                if d:
                    total += w0[m, j, k] + w0[m + 1, j, k]
                share = np.divide(1.0, total + added[m, j, k])  # no check for 0: vector code
                inverse[m, j, k] = share if total > 0.0 else 0.0


@kernel
def coarse_sums(
    fine: Real, coarse: Real, marks: Marks, factor: Integers, orphans: Indices, aggregates: Indices
) -> None:
    """What is added to the diagonal of coarse cells: the sum over the fine cells that have their
    value."""
    f0, f1, f2 = factor
    d = 1 if fine.shape[0] > 1 else 0
    n0, n1, n2 = fine.shape[0] - 2 * d, fine.shape[1] - 2, fine.shape[2] - 2
    coarse[:] = 0.0
    for i in range(n0):
        for j in range(n1):
            for k in range(n2):
                if marks[i + d, j + 1, k + 1] & OWN:
                    coarse[i // f0 + d, j // f1 + 1, k // f2 + 1] += fine[i + d, j + 1, k + 1]
    flat, wide, aggregate = fine.reshape(-1), coarse.reshape(-1), aggregates.reshape(-1)
    for g in range(orphans.size):
        wide[aggregate[orphans[g]]] += flat[orphans[g]]


@kernel
def has_any(values: Real) -> bool:
    """Whether some value is not 0."""
    found, flat = 0, values.reshape(-1)
    for n in range(flat.size):
        found += int(flat[n] != 0.0)
    return found > 0


@kernel
def columns_to_diagonal(weights: Triple, added: Real, periodic: Periodic) -> None:
    """Move the weights of outer faces behind which p = 0 is more than a cell away to what is added
    to the diagonal, in place; they are less than those of the faces opposite.

    Such a weight hardly depends on the size of the cells, and p does not fall towards the side: its
    sums are right on coarse levels, where the side of an open one is halved.

    weights, added  padded
    """
    shape = added.shape
    stride = shape[1] * shape[2], shape[2], 1
    more = added.reshape(-1)
    for axis in range(3):
        n, step, w = shape[axis] - 2, stride[axis], weights[axis].reshape(-1)
        if periodic[axis] or n < 1:
            continue
        one, other = int(axis == 0), 2 - int(axis == 2)
        for cell, outer, inner in ((1, 1, 2), (n, n + 1, n)):
            for a in range(shape[one]):
                for b in range(shape[other]):
                    at = a * stride[one] + b * stride[other]
                    moved = w[at + outer * step]
                    if moved < w[at + inner * step]:
                        more[at + cell * step] += moved
                        w[at + outer * step] = 0.0


@kernel
def coarsen(hierarchy: Hierarchy) -> None:
    """Fill all levels from the weights of the finest, from what is added to its diagonal, and from
    which of its rows are even."""
    table, periodic, weights, reaction, inverse, even, interpolation = hierarchy[:7]
    marks, orphans, aggregates = hierarchy[7:]
    reacts = has_any(at_level(reaction, table, 0))
    for level in range(table.shape[0] - 1):
        w, share = weights_at(weights, table, level), at_level(inverse, table, level)
        added = at_level(reaction, table, level)
        if level > 0:
            rows = even_at(even, table, level)
            table[level, COMMON] = find_even(w, periodic, rows, SINGLE)
        inverse_diagonal(w, added, share)
        if level == table.shape[0] - 2:
            break
        factor = np.empty(3, np.int64)
        most = max(table[level + 1, N0], table[level + 1, N1], table[level + 1, N2])
        ratio = np.empty((3, most + 1))
        towards = interpolation_at(interpolation, table, level)
        for axis in range(3):
            n, size, cells = table[level, N0 + axis], table[level, S0 + axis], table[0, N0 + axis]
            wraps = periodic[axis] != 0
            factor[axis] = table[level + 1, S0 + axis] // size
            interpolation_weights(towards[axis], n, factor[axis], size, cells, wraps)
            for face in range(table[level + 1, N0 + axis] + 1):
                ratio[axis, face] = distance_ratio(face, factor[axis], size, cells, wraps)
        mark, aggregate = at_level(marks, table, level), at_level(aggregates, table, level)
        wide = weights_at(weights, table, level + 1)
        coarse_shape = np.array(wide[0].shape)
        mark_own(mark, w, share, factor)
        wrap_ghosts(mark, periodic)
        mark_interpolated(mark, w, share, towards)
        wrap_ghosts(mark, periodic)
        space = orphans[table[level, OFFSET] : table[level + 1, OFFSET]]
        table[level, ORPHANS] = assign_orphans(
            mark, w, share, factor, periodic, coarse_shape, space, aggregate
        )
        if reacts:
            seated = orphans_at(orphans, table, level)
            coarse_sums(
                added, at_level(reaction, table, level + 1), mark, factor, seated, aggregate
            )
        else:
            at_level(reaction, table, level + 1)[:] = 0.0
        for axis in range(3):
            coarse_weights(w[axis], wide[axis], mark, axis, factor, ratio[axis])
        add_orphan_weights(
            mark, w, wide, factor, ratio, periodic, orphans_at(orphans, table, level), aggregate
        )


@kernel
def fill_levels(
    hierarchy: Hierarchy, faces: tuple[Array, Array, Array], reaction: Array, finest: Finest
) -> tuple[float, int]:
    """Fill finest level and hierarchy from the weights on the faces.

    reaction  of K + D, see `pressure.PressureSystem`
    returns   scale of the hierarchy's weights, common cell of the finest level (see `even`)
    """
    table, periodic, weights, even = hierarchy[0], hierarchy[1], hierarchy[2], hierarchy[5]
    w0, w1, w2, diagonal = finest
    finest_weights(faces, (w0, w1, w2), diagonal)
    most = largest_size(diagonal)
    scale = 1.0 / most if most > 0.0 else 1.0
    for source, target in ((w0, weights[0]), (w1, weights[1]), (w2, weights[2])):
        scaled(source, target[: source.size], scale)
    added = at_level(hierarchy[3], table, 0)
    added[:] = 0.0
    if reaction.size:
        d, more = int(added.shape[0] > 1), reaction.reshape(-1)
        n1, n2 = added.shape[1] - 2, added.shape[2] - 2
        for n in range(more.size):
            added[n // (n1 * n2) + d, (n // n2) % n1 + 1, n % n2 + 1] = scale * more[n]
    columns_to_diagonal(weights_at(weights, table, 0), added, periodic)
    common = find_even((w0, w1, w2), periodic, even_at(even, table, 0), ROUNDING)
    table[0, COMMON] = common
    coarsen(hierarchy)
    return scale, common
