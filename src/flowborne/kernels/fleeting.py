"""Control volumes through which more flows than they hold, carried implicitly: upwind values at the
end of a stage leave them, so none is too small (May and Berger 2017).

Lists are of these control volumes, flat indices in ascending order; `way` is 2 axis for the lower
and 2 axis + 1 for the upper side across an axis.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from flowborne.kernels.arrays import Array, Integers
from flowborne.kernels.control_volumes import place_of

SWEEPS = 1000
"""Most times that what leaves all of them is worked out, one after the other."""

SETTLED = 1e-15
"""Change of what leaves one, relative to the largest, at which that is done."""


@njit(nogil=True, cache=True)
def choose(
    index: Integers, beside: Integers, rate: Array, low: Array, high: Array, dt: float
) -> tuple[Integers, Integers, Array, Integers]:
    """Those of listed control volumes that more leaves in a substep than they hold at either end of
    it, with their rows of `beside` and `rate`, and the places of those beside them among them.

    low, high  volumes at both ends of the substep of dt
    """
    one, other = low.reshape(-1), high.reshape(-1)
    found = np.empty(index.size, np.int64)
    count = 0
    for n in range(index.size):
        gone = 0.0
        for way in range(6):
            gone += max(rate[n, way], 0.0)
        if dt * gone > max(one[index[n]], other[index[n]]):
            found[count] = n
            count += 1
    own, to = np.empty(count, np.int64), np.empty((count, 6), np.int64)
    through, row = np.empty((count, 6)), np.full((count, 6), -1)
    for n in range(count):
        own[n] = index[found[n]]
        to[n], through[n] = beside[found[n]], rate[found[n]]
    for n in range(count):
        for way in range(6):
            at = place_of(own, to[n, way], 0)
            if at < count and own[at] == to[n, way]:
                row[n, way] = at
    return own, to, through, row


@njit(nogil=True, cache=True)
def what_leaves(
    field: Array,
    later: Array,
    volumes: Array,
    listed: Integers,
    beside: Integers,
    row: Integers,
    out: Array,
    nothing: float,
) -> Array:
    """(n,) the value v with which each control volume V lets out what leaves it, from

        (V + sum of what leaves) v  =  amount without these sides + sum of what comes in x its v

    field    value of each control volume at the start, with which those not listed let it out
    later    after an explicit stage with the mean of both at these sides, amount where `volumes` is
             not above `nothing`
    volumes  after the stage
    listed   (n,); something leaves each of them
    beside   (n, 6) control volume beyond each side, -1 where the side is none of these
    row      (n, 6) its place in the list, -1 if it is not there
    out      (n, 6) volume that leaves through each side in the stage
    """
    values, after, volume = field.reshape(-1), later.reshape(-1), volumes.reshape(-1)
    known, gone = np.empty(listed.size), np.empty(listed.size)
    leaving = np.empty(listed.size)
    for n in range(listed.size):
        own = listed[n]
        leaving[n] = values[own]
        known[n] = after[own] * (volume[own] if volume[own] > nothing else 1.0)
        gone[n] = volume[own]
        for way in range(6):
            to, passed = beside[n, way], out[n, way]
            if to < 0:
                continue
            known[n] += passed * 0.5 * (values[own] + values[to])
            gone[n] += max(passed, 0.0)
            if row[n, way] < 0:
                known[n] -= min(passed, 0.0) * values[to]
    for sweep in range(SWEEPS):
        change, scale = 0.0, 0.0
        for step in range(listed.size):
            n = step if sweep % 2 == 0 else listed.size - 1 - step
            total = known[n]
            for way in range(6):
                if row[n, way] >= 0 and out[n, way] < 0.0:
                    total -= out[n, way] * leaving[row[n, way]]
            now = total / gone[n]
            change = max(change, abs(now - leaving[n]))
            scale = max(scale, abs(now))
            leaving[n] = now
        if change <= SETTLED * scale:
            break
    return leaving


@njit(nogil=True, cache=True)
def let_through(
    later: Array,
    net: Array,
    field: Array,
    volumes: Array,
    listed: Integers,
    beside: Integers,
    row: Integers,
    rate: Array,
    arriving: Array,
    leaving: Array,
    dt: float,
    nothing: float,
) -> None:
    """Let upwind values through the sides of listed control volumes in place of the mean of both
    beside them: what one gives another takes. In place in `later` and `net`.

    later     after an explicit stage of which this is `dt`, amount where `volumes` is not above
              `nothing`
    net       amount that leaves each control volume per time
    field     that the stage carried
    volumes   after it
    rate      (n, 6) volume per time that leaves through each side
    arriving  (n, 6) value with which it comes in from control volumes that are not listed
    leaving   (n,) value with which it leaves those listed
    beside, row  as in `what_leaves`
    """
    after, gone = later.reshape(-1), net.reshape(-1)
    values, volume = field.reshape(-1), volumes.reshape(-1)
    for n in range(listed.size):
        own = listed[n]
        for way in range(6):
            to, through, at = beside[n, way], rate[n, way], row[n, way]
            if to < 0:
                continue
            passed = leaving[n]
            if through < 0.0:
                passed = leaving[at] if at >= 0 else arriving[n, way]
            more = through * (passed - 0.5 * (values[own] + values[to]))
            gone[own] += more
            after[own] -= dt * more / (volume[own] if volume[own] > nothing else 1.0)
            if at < 0:
                gone[to] -= more
                after[to] += dt * more / (volume[to] if volume[to] > nothing else 1.0)
