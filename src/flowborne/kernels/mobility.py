"""A^-1 on a load, for a dense matrix or a factorised one."""

from __future__ import annotations

import numpy as np

from flowborne.kernels.arrays import Array, MobilityArrays
from flowborne.kernels.cholesky import solve_factored
from flowborne.kernels.jit import kernel


@kernel
def respond(load: Array, mobility: MobilityArrays) -> Array:
    """(k,) A^-1 load."""
    dense, t_start, t_column, t_value, value, blocks, order, taken = mobility
    size = load.size
    motion = np.zeros(size)
    if t_start.size == 1:
        for a in range(size):
            for b in range(size):
                motion[a] += dense[a, b] * load[b]
        return motion
    force = np.zeros(order.size)
    for a in range(size):
        if load[a] != 0.0:
            for e in range(t_start[a], t_start[a + 1]):
                force[t_column[e]] += t_value[e] * load[a]
    turned = np.empty((1, order.size))
    for i in range(order.size):
        turned[0, order[i]] = force[i]
    solve_factored(turned, value, blocks)
    answer = np.empty(order.size)
    for i in range(order.size):
        answer[i] = turned[0, order[i]]
    for c in range(taken.shape[1]):
        part = 0.0
        for i in range(order.size):
            part += taken[i, c] * force[i]
        for i in range(order.size):
            answer[i] -= part * taken[i, c]
    for a in range(size):
        for e in range(t_start[a], t_start[a + 1]):
            motion[a] += t_value[e] * answer[t_column[e]]
    return motion
