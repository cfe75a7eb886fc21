"""Whole fields on the faces across one axis, in one pass each.

Sums and maxima run plane after plane, so that they do not depend on how many threads there are.
"""

from __future__ import annotations

import numpy as np
from numba import prange

from flowborne.kernels.arrays import Array
from flowborne.kernels.jit import inlined, kernel

LANES = 64
"""Partial sums that a plane is added up in, so that the compiler makes vector code of it."""


@kernel
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


@inlined
def flat(values: Array) -> Array:
    """The same field with its planes in line, so that a slab's rows are long as well."""
    return values.reshape((values.shape[0], values.shape[1] * values.shape[2]))


@kernel
def accelerate(out: Array, opened: Array, volume: Array, density: float, area: float) -> None:
    """a A / m: what a difference of pressures accelerates a face by; 0 where there is no mass."""
    rate, part, volumes = flat(out), flat(opened), flat(volume)
    for i in prange(rate.shape[0]):
        for k in range(rate.shape[1]):
            m = density * volumes[i, k]
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
def add_weighted(
    sums: Array, volume: Array, density: float, first: Array, before: Array, after: Array
) -> None:
    """Add those of a row to sums (5, LANES), see `weighted_sums`; apart from its loop, which Numba
    does not vectorise where that runs on threads."""
    ones, lows, highs, changes, sizes = sums[0], sums[1], sums[2], sums[3], sums[4]
    for at in range(0, volume.size, LANES):
        lane = slice(at, min(at + LANES, volume.size))
        v, a, b, c = volume[lane], first[lane], before[lane], after[lane]
        for k in range(v.size):
            m = density * v[k]
            change = m * (c[k] - b[k])
            ones[k] += m * a[k]
            lows[k] += m * b[k]
            highs[k] += m * c[k]
            changes[k] += change
            sizes[k] += abs(change)


@kernel
def weighted_sums(
    volume: Array, density: float, first: Array, before: Array, after: Array
) -> Array:
    """(5,) sums of density x volume x each of three fields, of that x (after - before), and of the
    sizes of the last."""
    held, other, low, high = flat(volume), flat(first), flat(before), flat(after)
    parts = np.zeros((held.shape[0], 5))
    for i in prange(held.shape[0]):
        sums = np.zeros((5, LANES))
        add_weighted(sums, held[i], density, other[i], low[i], high[i])
        for n in range(5):
            for k in range(LANES):
                parts[i, n] += sums[n, k]
    total = np.zeros(5)
    for i in range(held.shape[0]):
        for n in range(5):
            total[n] += parts[i, n]
    return total


@kernel
def is_finite(field: Array) -> bool:
    """Whether all values of a field are finite numbers."""
    values, wrong = flat(field), np.zeros(field.shape[0], np.int64)
    for i in prange(values.shape[0]):
        found = 0
        for k in range(values.shape[1]):
            found += int(not abs(values[i, k]) < np.inf)
        wrong[i] = found
    return not wrong.any()


@kernel
def largest_size(field: Array) -> float:
    """Largest size of a field."""
    values, most = flat(field), np.zeros(field.shape[0])
    for i in prange(values.shape[0]):
        found = 0.0
        for k in range(values.shape[1]):
            size = abs(values[i, k])
            found = size if size > found else found
        most[i] = found
    return float(most.max())


@kernel
def largest_open(field: Array, opened: Array, more_than: float) -> float:
    """Largest size of a field on faces of which more than a part is open."""
    values, part, most = flat(field), flat(opened), np.zeros(field.shape[0])
    for i in prange(values.shape[0]):
        found = 0.0
        for k in range(values.shape[1]):
            size = abs(values[i, k]) if part[i, k] > more_than else 0.0
            found = size if size > found else found
        most[i] = found
    return float(most.max())
