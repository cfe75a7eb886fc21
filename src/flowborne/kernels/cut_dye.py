"""Dye in cut cells: what is in one leaves first, then what comes in, well mixed.

So no cell is too small: where more flows through it in a step than it holds, it passes on what
comes in (implicit upwind values; May and Berger 2017 join them to an explicit scheme). One that a
body leaves takes what flows in, one that a body takes up gives what it has to where its fluid
goes, and nothing passes a closed face. Lists are of the cut cells, in ascending order; `way` is
2 axis for the lower and 2 axis + 1 for the upper face across an axis.
"""

from __future__ import annotations

import numpy as np
from numba import njit, prange

from flowborne.kernels.arrays import ROUNDING, Array, Integers, Marks
from flowborne.kernels.control_volumes import neighbour, place_of
from flowborne.kernels.jit import kernel

WHOLE, CUT, EMPTY = range(3)
"""What a cell is in a step: nothing but fluid, in part or for some time, or never any."""

SWEEPS = 500
"""Most times that what leaves all cut cells is worked out, one after the other; sooner where only
rounding errors change."""


@kernel
def sort_cells(
    kind: Marks,
    fullest: Array,
    before: Array,
    after: Array,
    rate: Array,
    x: Array,
    y: Array,
    z: Array,
    whole: float,
) -> None:
    """Tell the kind of each cell, and the largest part of a whole one that leaves it per time.

    kind           (nx, ny, nz) WHOLE, CUT or EMPTY; cells that mouths and sources fill are CUT
    fullest        (nx,) of each plane
    before, after  volumes at both ends of the step
    rate           volume per time that mouths and sources bring
    x, y, z        volume per time through the faces across each axis
    whole          volume from which a cell is whole
    """
    n0, n1, n2 = kind.shape
    for i in prange(n0):
        most = 0.0
        for j in range(n1):
            for k in range(n2):
                out = max(x[i + 1, j, k], 0.0) + max(-x[i, j, k], 0.0)
                out += max(y[i, j + 1, k], 0.0) + max(-y[i, j, k], 0.0)
                out += max(z[i, j, k + 1], 0.0) + max(-z[i, j, k], 0.0)
                come = max(-x[i + 1, j, k], 0.0) + max(x[i, j, k], 0.0)
                come += max(-y[i, j + 1, k], 0.0) + max(y[i, j, k], 0.0)
                come += max(-z[i, j, k + 1], 0.0) + max(z[i, j, k], 0.0)
                least = min(before[i, j, k], after[i, j, k])
                clear = least >= whole and rate[i, j, k] == 0.0
                held = abs(before[i, j, k]) + abs(after[i, j, k]) + abs(rate[i, j, k])
                nothing = held + out + come == 0.0
                kind[i, j, k] = WHOLE if clear else (EMPTY if nothing else CUT)
                most = max(most, out / max(least, whole) if clear else 0.0)
        fullest[i] = most


@njit(nogil=True, cache=True)
def face_of(shape: Integers, axis: int, f: int, upper: int) -> int:
    """Flat index of the lower or upper face of cell f among the faces across an axis."""
    n1, n2 = shape[1], shape[2]
    if axis == 0:
        return int(f + upper * n1 * n2)
    if axis == 1:
        return int(f + (f // (n1 * n2) + upper) * n2)
    return int(f + f // n2 + upper)


@njit(nogil=True, cache=True)
def list_flows(
    listed: Integers,
    axis: int,
    flux: Array,
    wraps: Integers,
    shape: Integers,
    beside: Integers,
    row: Integers,
    out: Array,
) -> None:
    """Take the faces of cut cells across an axis out of the fluxes.

    flux    volume per time through the faces across the axis; 0 at those of cut cells afterwards
    wraps   (3,) number of cells along each periodic axis, else 0
    shape   (3,) of the cells
    beside  (n, 6) flat index of the cell beside, -1 beyond a side
    row     (n, 6) its place in the list, -1 if it is not there
    out     (n, 6) volume per time that leaves through each face
    """
    through = flux.reshape(-1)
    for n in range(listed.size):
        for upper in range(2):
            way, to = 2 * axis + upper, neighbour(shape, wraps, listed[n], 2 * axis + upper)
            beside[n, way] = to
            at = place_of(listed, to, 0)
            row[n, way] = at if to >= 0 and at < listed.size and listed[at] == to else -1
            out[n, way] = (2.0 * upper - 1.0) * through[face_of(shape, axis, listed[n], upper)]
    for n in range(listed.size):
        for upper in range(2):
            through[face_of(shape, axis, listed[n], upper)] = 0.0
            to = beside[n, 2 * axis + upper]
            if to >= 0:  # the same face, which a periodic axis has twice
                through[face_of(shape, axis, to, 1 - upper)] = 0.0


@njit(nogil=True, cache=True)
def pass_on(
    field: Array,
    volume: Array,
    listed: Integers,
    beside: Integers,
    row: Integers,
    out: Array,
    entering: Array,
    gain: Array,
    brought: Array,
    local: Array,
    least: float,
    most: float,
) -> float:
    """Carry a field through the faces of cut cells, in place; gives the amount that came in through
    sides of the domain, mouths and sources.

    volume    (nx, ny, nz) of the cells, in place
    out       (n, 6) volume that leaves through each face in the step
    entering  (n, 6) value of what comes in through sides of the domain
    gain      (n,) volume that mouths bring with
    brought   (n,) amount
    local     (n,) volume that comes in with the value that is there; negative leaves
    least, most  bounds of all values, which a volume below 0 would break by as little as it is
    """
    values, volumes = field.reshape(-1), volume.reshape(-1)
    count = listed.size
    came, known = gain.copy(), brought.copy()
    old, mixed, leaving = np.empty(count), np.empty(count), np.empty(count)
    share, was, gained = np.ones(count), np.zeros((count, 6)), 0.0
    for n in range(count):
        own = listed[n]
        old[n] = mixed[n] = leaving[n] = values[own]
        gone = max(-local[n], 0.0)
        for way in range(6):
            gone += max(out[n, way], 0.0)
            arrives = max(-out[n, way], 0.0)
            came[n] += arrives
            if beside[n, way] < 0:
                known[n] += arrives * entering[n, way]
                gained += arrives * entering[n, way]
            elif row[n, way] < 0:
                was[n, way] = values[beside[n, way]]
                known[n] += arrives * was[n, way]
        held = max(volumes[own] + max(local[n], 0.0), 0.0)
        if gone > held and came[n] > 0.0:
            share[n] = held / gone
        gained += brought[n] + max(local[n], 0.0) * old[n]
        volumes[own] += gain[n] + local[n]
        for way in range(6):
            volumes[own] -= out[n, way]
    for sweep in range(SWEEPS):
        change, scale = 0.0, 0.0
        for step in range(count):
            n = step if sweep % 2 == 0 else count - 1 - step
            if came[n] > 0.0:
                total = known[n]
                for way in range(6):
                    if row[n, way] >= 0 and out[n, way] < 0.0:
                        total -= out[n, way] * leaving[row[n, way]]
                mixed[n] = min(max(total / came[n], least), most)
            now = share[n] * old[n] + (1.0 - share[n]) * mixed[n]
            change = max(change, abs(now - leaving[n]))
            scale = max(scale, abs(now))
            leaving[n] = now
        if change <= ROUNDING * scale:
            break
    for n in range(count):
        own = listed[n]
        values[own] = mixed[n]
        if share[n] == 1.0 and volumes[own] > 0.0:
            part = min(came[n] / volumes[own], 1.0)
            values[own] = old[n] + part * (mixed[n] - old[n])
        gained -= max(-local[n], 0.0) * leaving[n]
        for way in range(6):
            if beside[n, way] < 0:
                gained -= max(out[n, way], 0.0) * leaving[n]
            elif row[n, way] < 0:
                volumes[beside[n, way]] += out[n, way]
    for n in range(count):
        for way in range(6):
            if beside[n, way] >= 0 and row[n, way] < 0 and out[n, way] > 0.0:
                to = beside[n, way]
                values[to] += out[n, way] * (leaving[n] - was[n, way]) / volumes[to]
    return gained
