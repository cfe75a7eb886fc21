"""Whole fields on the faces across one axis, in one pass each.

Sums and maxima run plane after plane, so that they do not depend on how many threads there are.
"""

from __future__ import annotations

import numpy as np
from numba import njit, prange

from flowborne.kernels.arrays import Array
from flowborne.kernels.jit import kernel

LANES = 64
"""Partial sums that a plane is added up in, so that the compiler makes vector code of it."""


@njit(nogil=True, cache=True)
def mean_row(row: Array, cells: Array, i: int, j: int, axis: int, periodic: bool) -> None:
    """Means of both cells of each face of row (i, j) across `axis`; 0 beyond the ends of an axis
    that is not periodic."""
    n = cells.shape[axis]
    if axis == 2:
        line = cells[i, j]
        low, high = (line[n - 1], line[0]) if periodic else (0.0, 0.0)
        row[0] = 0.5 * (low + line[0])
        for k in range(1, n):
            row[k] = 0.5 * (line[k - 1] + line[k])
        row[n] = 0.5 * (line[n - 1] + high)
    else:
        at = i if axis == 0 else j
        below, above = (at - 1) % n, at % n
        one, other = (
            (cells[below, j], cells[above, j]) if axis == 0 else (cells[i, below], cells[i, above])
        )
        first = 0.5 if periodic or at > 0 else 0.0
        second = 0.5 if periodic or at < n else 0.0
        for k in range(row.size):
            row[k] = first * one[k] + second * other[k]


@njit(forceinline=True, nogil=True, cache=True)
def flat(values: Array) -> Array:
    """The same field with its planes in line, so that a slab's rows are long as well."""
    return values.reshape((values.shape[0], values.shape[1] * values.shape[2]))


@kernel
def accelerate(out: Array, opened: Array, mass: Array, area: float) -> None:
    """a A / m: what a difference of pressures accelerates a face by; 0 where there is no mass."""
    rate, part, masses = flat(out), flat(opened), flat(mass)
    for i in prange(rate.shape[0]):
        for k in range(rate.shape[1]):
            m = masses[i, k]
            rate[i, k] = area * part[i, k] / m if m > 0.0 else 0.0


@kernel
def weigh(weight: Array, opened: Array, rate: Array, area: float) -> None:
    """a A rate: the weight in the pressure's matrix of a face with a rate a A / m."""
    w, part, rates = flat(weight), flat(opened), flat(rate)
    for i in prange(w.shape[0]):
        for k in range(w.shape[1]):
            w[i, k] = area * part[i, k] * rates[i, k]


@kernel
def mean_flux(
    flux: Array,
    weight: Array,
    velocity: Array,
    change: Array,
    before: Array,
    after: Array,
    area: float,
    whole: float,
) -> None:
    """Volume per time through the mean open part of each face in the middle of a step, and its
    weight.

    velocity, change  at the start of the step, and of the last step: in the middle it will be
                      velocity + change / 2
    before, after     open parts at both ends of a step
    whole             weight of a face that is wholly open
    """
    q, w, u, du = flat(flux), flat(weight), flat(velocity), flat(change)
    one, other = flat(before), flat(after)
    for i in prange(q.shape[0]):
        for k in range(q.shape[1]):
            mean = 0.5 * (one[i, k] + other[i, k])
            w[i, k] = whole * mean
            q[i, k] = area * mean * (u[i, k] + 0.5 * du[i, k])


@kernel
def changes_of_step(
    acceleration: Array, change: Array, velocity: Array, start: Array, advected: Array, dt: float
) -> None:
    """What a step to `velocity` changed, in all and per time by what is not advection.

    change  on entry the velocity before the step, on return velocity - it
    start   the velocity from which `advected` came: that before the step and what was added to it
    """
    rate, last, u = flat(acceleration), flat(change), flat(velocity)
    one, other = flat(start), flat(advected)
    for i in prange(u.shape[0]):
        for k in range(u.shape[1]):
            rate[i, k] = (u[i, k] - other[i, k] + one[i, k] - last[i, k]) / dt
            last[i, k] = u[i, k] - last[i, k]


@kernel
def still_to_come(out: Array, rate: Array, now: Array, was: Array, dt: float) -> None:
    """rate - 2 (now - was) / dt: of what goes along with a flow in dt, without the half, now - was,
    that is there already, and the other one."""
    left, whole, one, other = flat(out), flat(rate), flat(now), flat(was)
    for i in prange(left.shape[0]):
        for k in range(left.shape[1]):
            left[i, k] = whole[i, k] - 2.0 * (one[i, k] - other[i, k]) / dt


@kernel
def weighted_change(weight: Array, before: Array, after: Array) -> tuple[float, float]:
    """Sum of weight x (after - before), and of its sizes."""
    mass, one, other = flat(weight), flat(before), flat(after)
    planes, parts = one.shape[0], np.zeros((2, one.shape[0]))
    for i in prange(planes):
        row, sizes = np.zeros(LANES), np.zeros(LANES)
        for first in range(0, one.shape[1], LANES):
            last = min(first + LANES, one.shape[1])
            a, b, m = one[i, first:last], other[i, first:last], mass[i, first:last]
            for k in range(last - first):
                change = m[k] * (b[k] - a[k])
                row[k] += change
                sizes[k] += abs(change)
        for k in range(LANES):
            parts[0, i] += row[k]
            parts[1, i] += sizes[k]
    total, size = 0.0, 0.0
    for i in range(planes):
        total += parts[0, i]
        size += parts[1, i]
    return total, size


@kernel
def largest_size(field: Array, opened: Array | None = None) -> float:
    """Largest size of a field; of its faces that are not wholly closed, if open parts are given."""
    values, most = flat(field), np.zeros(field.shape[0])
    part = values if opened is None else flat(opened)
    for i in prange(values.shape[0]):
        found = 0.0
        for k in range(values.shape[1]):
            size = abs(values[i, k]) if opened is None or part[i, k] > 0.0 else 0.0
            found = size if size > found else found
        most[i] = found
    return float(most.max())
