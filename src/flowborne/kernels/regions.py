"""Connected regions of a field: labels, sums, and null vectors that are constant in each."""

from __future__ import annotations

import numpy as np
from numba import prange

from flowborne.kernels.arrays import Array, Finest, Labels, Marks, Periodic, Rows
from flowborne.kernels.jit import inlined, kernel

NULL = 1e-10
"""Share of the largest below which a sum over a region counts as 0."""


@kernel
def root(parent: Labels, a: int) -> int:
    """Representative of a's set, with the path to it halved."""
    while parent[a] != a:
        parent[a] = parent[parent[a]]
        a = parent[a]
    return a


@kernel
def join(parent: Labels, a: int, b: int) -> None:
    """Make the sets of a and b one; the smaller representative stays."""
    a, b = root(parent, a), root(parent, b)
    if a < b:
        parent[b] = a
    else:
        parent[a] = b


@inlined
def is_whole(w2: Array, diagonal: Array, i: int, j: int) -> bool:
    """Whether all cells of a row are active and connected along it."""
    last = diagonal.shape[2] - 2
    found = int(diagonal[i, j, 1] > 0.0)
    for k in range(2, last + 1):
        found += int(diagonal[i, j, k] > 0.0) & int(w2[i, j, k] > 0.0)
    return found == last


@inlined
def is_crossed(w: Array, i: int, j: int) -> bool:
    """Whether some weight of a row of faces is above 0: the first, nearly always."""
    k = 1
    while k < w.shape[2] - 1 and not w[i, j, k] > 0.0:
        k += 1
    return k < w.shape[2] - 1


@kernel
def label_regions(
    finest: Finest, even: Marks, periodic: Periodic, label: Labels, parent: Labels, count: Labels
) -> int:
    """Number the regions that have no open side.

    finest    padded weights and diagonal of the finest level (see `levels`)
    even      which of its padded rows are even (see `even`)
    label     padded: filled with 0, 1, ... in regions without an open side, -1 elsewhere
    parent    scratch, one entry per padded cell and one more
    count     filled with the cells of each such region
    returns   number of regions without an open side
    """
    w0, w1, w2, diagonal = finest
    d = 1 if w0.shape[0] > 1 else 0
    p0, p1, p2 = diagonal.shape
    label[:] = -1
    parent[0] = 0
    used = 1
    whole = np.zeros((p0, p1), np.bool_)  # rows of one run, which need no look at every cell
    for i in range(d, p0 - d):
        for j in range(1, p1 - 1):
            whole[i, j] = even[i, j] or is_whole(w2, diagonal, i, j)
            above = whole[i, j - 1] and is_crossed(w1, i, j)
            before = d == 0 or (whole[i - 1, j] and is_crossed(w0, i, j))
            if whole[i, j] and above and before:
                parent[used] = used
                label[i, j, 1 : p2 - 1] = used
                join(parent, used, label[i, j - 1, 1])
                if d:
                    join(parent, used, label[i - 1, j, 1])
                used += 1
                continue
            run = -1
            last1, last0 = -1, -1
            for k in range(1, p2 - 1):
                if not diagonal[i, j, k] > 0.0:
                    run = -1
                    continue
                if run < 0 or not w2[i, j, k] > 0.0:
                    run = used
                    parent[run] = run
                    used += 1
                    last1, last0 = -1, -1
                label[i, j, k] = run
                if w1[i, j, k] > 0.0 and j > 1 and label[i, j - 1, k] != last1:
                    last1 = label[i, j - 1, k]
                    join(parent, run, last1)
                if d and w0[i, j, k] > 0.0 and i > 1 and label[i - 1, j, k] != last0:
                    last0 = label[i - 1, j, k]
                    join(parent, run, last0)
    cells, shape, stride = label.reshape(-1), (p0, p1, p2), (p1 * p2, p2, 1)
    for axis in range(1 - d, 3):
        n, step, w = shape[axis] - 2, stride[axis], finest[axis].reshape(-1)
        one, other = int(axis == 0), 2 - int(axis == 2)
        for a in range(shape[one]):
            for b in range(shape[other]):
                at = a * stride[one] + b * stride[other]
                for own, face, beyond in ((1, 1, n), (n, n + 1, 1)):
                    if w[at + face * step] > 0.0:
                        joined = cells[at + beyond * step] if periodic[axis] else 0
                        join(parent, cells[at + own * step], joined)
    regions = 0
    for a in range(1, used):
        top = parent[a]
        if top == a:
            parent[a] = -1 - regions
            count[regions] = 0
            regions += 1
        elif top > 0:
            parent[a] = parent[top]
    for i in range(d, p0 - d):
        for j in range(1, p1 - 1):
            if whole[i, j]:
                number = -1 - parent[label[i, j, 1]]
                label[i, j, 1 : p2 - 1] = number
                if number >= 0:
                    count[number] += p2 - 2
                continue
            for k in range(1, p2 - 1):
                if label[i, j, k] >= 0:
                    number = -1 - parent[label[i, j, k]]
                    label[i, j, k] = number
                    if number >= 0:
                        count[number] += 1
    return regions


@kernel
def region_sums(x: Array, label: Labels, regions: int) -> Array:
    """(regions,) sum of a padded field over each region, plane after plane."""
    d = 1 if x.shape[0] > 1 else 0
    planes = x.shape[0] - 2 * d
    parts = np.zeros((planes, regions))
    for i in prange(planes):
        row = np.zeros(x.shape[2])  # of the first region: nearly always the only one
        for j in range(1, x.shape[1] - 1):
            for k in range(1, x.shape[2] - 1):
                row[k] += x[i + d, j, k] if label[i + d, j, k] == 0 else 0.0
            for k in range(1, x.shape[2] - 1 if regions > 1 else 1):
                a = label[i + d, j, k]
                if a > 0:
                    parts[i, a] += x[i + d, j, k]
        for k in range(x.shape[2]):
            parts[i, 0] += row[k]
    total = np.zeros(regions)
    for i in range(planes):
        for a in range(regions):
            total[a] += parts[i, a]
    return total


@kernel
def remove_null(x: Array, label: Labels, basis: Array) -> None:
    """Take the null vectors' part out of a padded field, x -= N N^T x.

    basis  (regions, q): the vectors N have the constant basis[r] in region r, and are orthonormal
    """
    regions, q = basis.shape
    if q == 0:
        return
    sums = region_sums(x, label, regions)
    constants = np.zeros(regions)
    for n in range(q):
        part = 0.0
        for a in range(regions):
            part += basis[a, n] * sums[a]
        for a in range(regions):
            constants[a] -= basis[a, n] * part
    d = 1 if x.shape[0] > 1 else 0
    first = constants[0]
    for i in prange(x.shape[0] - 2 * d):
        for j in range(1, x.shape[1] - 1):
            for k in range(1, x.shape[2] - 1):
                x[i + d, j, k] += first if label[i + d, j, k] == 0 else 0.0
            for k in range(1, x.shape[2] - 1 if regions > 1 else 1):
                a = label[i + d, j, k]
                if a > 0:
                    x[i + d, j, k] += constants[a]


@kernel
def region_loads(label: Labels, regions: int, size: int, rows: Rows) -> Array:
    """(regions, size) J^T 1_r of each region without an open side.

    What is left by rounding of contributions that cancel is made 0.
    """
    cells, row_start, columns, values = rows
    flat = label.reshape(-1)
    load, amount = np.zeros((regions, size)), np.zeros((regions, size))
    for n in range(cells.size):
        a = flat[cells[n]]
        if a >= 0:
            for e in range(row_start[n], row_start[n + 1]):
                load[a, columns[e]] += values[e]
                amount[a, columns[e]] += abs(values[e])
    for a in range(regions):
        for c in range(size):
            if abs(load[a, c]) < NULL * amount[a, c]:
                load[a, c] = 0.0
    return load
