"""L L^T of a sparse symmetric positive definite matrix, by blocks of columns with the same rows.

A block of columns first..last has its own triangle (w, w) and, below it, the rows (m,) that all of
them share: m values of each column in turn, so that the innermost loops run along memory. After
Ng and Peyton (1993), with each block's update given to the blocks on its right at once.

Also A^-1 on a load by such a factor, see `solvers.mobility`.
"""

from __future__ import annotations

import numpy as np

from flowborne.kernels.arrays import Array, Blocks, Indices, Integers, MobilityArrays
from flowborne.kernels.jit import kernel


@kernel
def factorise(value: Array, blocks: Blocks, within: Indices, slot: Integers, entry: Array) -> bool:
    """L of the matrix of these entries; False when it is not positive definite.

    value   of L, set; see `Blocks`
    within  see `give_update`
    slot    where in `value` each entry belongs, -1 for none
    """
    first, below, _, at, _ = blocks
    value[:] = 0.0
    for e in range(entry.size):
        if slot[e] >= 0:
            value[slot[e]] = entry[e]
    most, used = 0, 0
    for s in range(first.size - 1):
        most = max(most, below[s + 1] - below[s])
    update = np.empty(most * most)
    for s in range(first.size - 1):
        m, w = below[s + 1] - below[s], first[s + 1] - first[s]
        if not factor_block(value[at[s] : at[s + 1]], w, m):
            return False
        panel = value[at[s] + w * w : at[s + 1]]
        multiply_panel(update, panel, w, m)
        used += give_update(value, blocks, s, update, within[used:])
    return True


@kernel
def factor_block(block: Array, w: int, m: int) -> bool:
    """Cholesky's factor of a block's triangle (columns in turn), and L below it, in place; False
    when the triangle is not positive definite."""
    for c in range(w):
        own = block[c * w + c : (c + 1) * w]
        lower = block[w * w + c * m : w * w + (c + 1) * m]
        if not own[0] > 0.0:
            return False
        root = np.sqrt(own[0])
        inverse = 1.0 / root
        own[0] = root
        for r in range(1, w - c):
            own[r] *= inverse
        for k in range(m):
            lower[k] *= inverse
        for d in range(c + 1, w):
            share = own[d - c]
            later = block[d * w + d : (d + 1) * w]
            beneath = block[w * w + d * m : w * w + (d + 1) * m]
            for r in range(w - d):
                later[r] -= share * own[d - c + r]
            for k in range(m):
                beneath[k] -= share * lower[k]
    return True


@kernel
def multiply_panel(update: Array, panel: Array, w: int, m: int) -> None:
    """update[i, j] = sum over the columns of panel (w, m) of panel[:, i] panel[:, j] for j >= i."""
    for i in range(m):
        wanted = update[i * m + i : (i + 1) * m]
        size = m - i
        wanted[:] = 0.0
        c = 0
        while c + 3 < w:
            p0 = panel[c * m + i : (c + 1) * m]
            p1 = panel[(c + 1) * m + i : (c + 2) * m]
            p2 = panel[(c + 2) * m + i : (c + 3) * m]
            p3 = panel[(c + 3) * m + i : (c + 4) * m]
            a0, a1, a2, a3 = p0[0], p1[0], p2[0], p3[0]
            for k in range(size):
                wanted[k] += (a0 * p0[k] + a1 * p1[k]) + (a2 * p2[k] + a3 * p3[k])
            c += 4
        while c < w:
            p0 = panel[c * m + i : (c + 1) * m]
            a0 = p0[0]
            for k in range(size):
                wanted[k] += a0 * p0[k]
            c += 1


@kernel
def give_update(value: Array, blocks: Blocks, s: int, update: Array, within: Indices) -> int:
    """Take the update of block s from the columns that its rows are.

    within   for each block that has such columns: where in its rows those of block s beyond it are
    returns  how many of these were used
    """
    first, below, rows, at, owner = blocks
    shared = rows[below[s] : below[s + 1]]
    m, i, used = shared.size, 0, 0
    while i < m:
        target, inner = owner[shared[i]], i
        begin, end = first[target], first[target + 1]
        w, height = end - begin, below[target + 1] - below[target]
        while inner < m and shared[inner] < end:
            inner += 1
        place = within[used : used + m - inner]
        used += m - inner
        together = place.size > 0 and place[-1] - place[0] == place.size - 1
        for row in range(i, inner):
            c, mine = shared[row] - begin, update[row * m : (row + 1) * m]
            own = value[at[target] + c * w : at[target] + (c + 1) * w]
            start = at[target] + w * w + c * height
            lower, taken = value[start : start + height], mine[inner:]
            for j in range(row, inner):
                own[shared[j] - begin] -= mine[j]
            if together:
                across = lower[place[0] : place[0] + taken.size]
                for j in range(taken.size):
                    across[j] -= taken[j]
            else:
                for j in range(taken.size):
                    lower[np.uint32(place[j])] -= taken[j]
        i = inner
    return used


@kernel
def solve_factored(x: Array, value: Array, blocks: Blocks) -> None:
    """x = (L L^T)^-1 x for every row of x (k, n), in place."""
    first, below, rows, at, _ = blocks
    count, most = first.size - 1, 0
    for s in range(count):
        most = max(most, below[s + 1] - below[s])
    work = np.empty(most)
    for s in range(count):
        shared = rows[below[s] : below[s + 1]]
        for b in range(x.shape[0]):
            forwards(x[b], first[s], first[s + 1], shared, value[at[s] : at[s + 1]], work)
    for s in range(count - 1, -1, -1):
        shared = rows[below[s] : below[s + 1]]
        for b in range(x.shape[0]):
            backwards(x[b], first[s], first[s + 1], shared, value[at[s] : at[s + 1]], work)


@kernel
def forwards(x: Array, begin: int, end: int, shared: Indices, block: Array, work: Array) -> None:
    """L y = x for the columns of one block begin..end, and what they take from the others."""
    w, m = end - begin, shared.size
    here, part, panel = x[begin:end], work[:m], block[w * w :]
    used = False
    for c in range(w):
        used |= here[c] != 0.0
    if not used:
        return
    for c in range(w):
        own = block[c * w : (c + 1) * w]
        here[c] /= own[c]
        for r in range(c + 1, w):
            here[r] -= own[r] * here[c]
    part[:] = 0.0
    c = 0
    while c + 2 < w:
        p0, p1 = panel[c * m : (c + 1) * m], panel[(c + 1) * m : (c + 2) * m]
        p2, y0, y1, y2 = panel[(c + 2) * m : (c + 3) * m], here[c], here[c + 1], here[c + 2]
        for k in range(m):
            part[k] = ((part[k] + p0[k] * y0) + p1[k] * y1) + p2[k] * y2
        c += 3
    while c < w:
        p0, y0 = panel[c * m : (c + 1) * m], here[c]
        for k in range(m):
            part[k] += p0[k] * y0
        c += 1
    for k in range(m):
        x[np.uint32(shared[k])] -= part[k]


@kernel
def backwards(x: Array, begin: int, end: int, shared: Indices, block: Array, work: Array) -> None:
    """L^T y = x for the columns of one block begin..end, when the later ones are known."""
    w, m = end - begin, shared.size
    here, part, whole = x[begin:end], work[:m], m // 4 * 4
    for k in range(m):
        part[k] = x[np.uint32(shared[k])]
    c = 0
    while c + 2 < w:
        low = w * w + c * m
        a, b, d = block[low : low + m], block[low + m : low + 2 * m], block[low + 2 * m :]
        t0, t1, t2, t3 = 0.0, 0.0, 0.0, 0.0
        u0, u1, u2, u3 = 0.0, 0.0, 0.0, 0.0
        v0, v1, v2, v3 = 0.0, 0.0, 0.0, 0.0
        for k in range(0, whole, 4):
            p0, p1, p2, p3 = part[k], part[k + 1], part[k + 2], part[k + 3]
            t0, t1 = t0 + a[k] * p0, t1 + a[k + 1] * p1
            t2, t3 = t2 + a[k + 2] * p2, t3 + a[k + 3] * p3
            u0, u1 = u0 + b[k] * p0, u1 + b[k + 1] * p1
            u2, u3 = u2 + b[k + 2] * p2, u3 + b[k + 3] * p3
            v0, v1 = v0 + d[k] * p0, v1 + d[k + 1] * p1
            v2, v3 = v2 + d[k + 2] * p2, v3 + d[k + 3] * p3
        for k in range(whole, m):
            t0, u0, v0 = t0 + a[k] * part[k], u0 + b[k] * part[k], v0 + d[k] * part[k]
        here[c] -= (t0 + t1) + (t2 + t3)
        here[c + 1] -= (u0 + u1) + (u2 + u3)
        here[c + 2] -= (v0 + v1) + (v2 + v3)
        c += 3
    while c < w:
        lower = block[w * w + c * m : w * w + (c + 1) * m]
        t0, t1, t2, t3 = 0.0, 0.0, 0.0, 0.0
        for k in range(0, whole, 4):
            t0, t1 = t0 + lower[k] * part[k], t1 + lower[k + 1] * part[k + 1]
            t2, t3 = t2 + lower[k + 2] * part[k + 2], t3 + lower[k + 3] * part[k + 3]
        for k in range(whole, m):
            t0 += lower[k] * part[k]
        here[c] -= (t0 + t1) + (t2 + t3)
        c += 1
    for c in range(w - 1, -1, -1):
        own = block[c * w : (c + 1) * w]
        total = here[c]
        for r in range(c + 1, w):
            total -= own[r] * here[r]
        here[c] = total / own[c]


@kernel
def respond(loads: Array, mobility: MobilityArrays) -> Array:
    """(n, k) A^-1 on every row of loads (n, k)."""
    dense, t_start, t_column, t_value, value, blocks, order, taken = mobility
    count, size = loads.shape
    motions = np.zeros((count, size))
    if t_start.size == 1:
        for n in range(count):
            for a in range(size):
                for b in range(size):
                    motions[n, a] += dense[a, b] * loads[n, b]
        return motions
    forces, turned = np.zeros((count, order.size)), np.empty((count, order.size))
    for n in range(count):
        for a in range(size):
            if loads[n, a] != 0.0:
                for e in range(t_start[a], t_start[a + 1]):
                    forces[n, t_column[e]] += t_value[e] * loads[n, a]
        for i in range(order.size):
            turned[n, order[i]] = forces[n, i]
    solve_factored(turned, value, blocks)
    answer = np.empty(order.size)
    for n in range(count):
        force, motion = forces[n], motions[n]
        for i in range(order.size):
            answer[i] = turned[n, order[i]]
        for c in range(taken.shape[1]):
            part = 0.0
            for i in range(order.size):
                part += taken[i, c] * force[i]
            for i in range(order.size):
                answer[i] -= part * taken[i, c]
        for a in range(size):
            for e in range(t_start[a], t_start[a + 1]):
                motion[a] += t_value[e] * answer[t_column[e]]
    return motions
