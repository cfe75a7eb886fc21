"""Fleeting control volumes: a body leaves them or takes them up while much flows through them.

Volumes change evenly in a step, and its fluxes stay as they are. Where a body crosses many cells,
those that it leaves hold n V / N after n of N substeps, like all around them, and let through F / N
in each. Explicit values grow there by up to F / (n V) - 1 in the n-th substep, by exp(F / V) in
all, however many there are; and so they do ahead of the body. What leaves a fleeting control volume
has the value that it has at the end of the substep, an upwind one, and goes to the one beside it,
so that momentum is kept (implicit sides among explicit ones: May and Berger 2017).
"""

from __future__ import annotations

import numpy as np

from flowborne.kernels.arrays import Array, Integers, Marks
from flowborne.kernels.carry import Fleeting, Fluxes, Volumes, side_rates
from flowborne.kernels.flux import CUT

CROSSED = 4.0
"""Whole cells that flow through a control volume in a step, beyond which it may be fleeting: with
fewer nothing grows that is seen in the flow."""

CHANGED = 0.5
"""Part of the volume at one end of a step, below which it falls at the other end of one that is
left or taken up."""

NONE_FLEETING = Fleeting(np.zeros(0, np.int64), np.zeros((0, 6), np.int64), np.zeros((0, 6)))


def find_fleeting(
    held: tuple[Array, Array], flux: Fluxes, marks: Marks, volumes: Volumes, steps: float
) -> Fleeting:
    """Those of cut control volumes that may let through more in a substep than they hold.

    held   control volumes at both ends of the step, m^3
    marks  of all of them, padded, see `kernels.carry.mark_volumes`
    steps  duration of the step over the volume of a cell, s/m^3
    """
    one, other = (volume.reshape(-1)[volumes.cut] for volume in held)
    index = volumes.cut[np.minimum(one, other) < CHANGED * np.maximum(one, other)]
    rate = side_rates(flux, index, volumes.component, volumes.shape)
    crossed = steps * np.maximum(rate, 0.0).sum(axis=1) > CROSSED
    return Fleeting(index[crossed], beyond_sides(index[crossed], marks, volumes), rate[crossed])


def beyond_sides(index: Integers, marks: Marks, volumes: Volumes) -> Integers:
    """(n, 6) control volume beyond each side of some; -1 at a side of the domain, and before an
    open one, where what is upstream is carried."""
    shape, wraps = tuple(volumes.shape), volumes.wraps
    at, found = np.stack(np.unravel_index(index, shape)), np.full((index.size, 6), -1)
    depth = np.array([[(wide - n) // 2] for wide, n in zip(marks.shape, shape, strict=True)])
    for axis in range(3):
        for upper in (0, 1) if shape[axis] > 1 else ():
            to = at.copy()
            to[axis] += 2 * upper - 1
            if wraps[axis]:
                to[axis] %= wraps[axis]
            cut = (marks[tuple(to + depth)] == CUT) & (to[axis] >= 0) & (to[axis] < shape[axis])
            flat = np.ravel_multi_index(tuple(to), shape, mode="clip")
            found[:, 2 * axis + upper] = np.where(cut, flat, -1)
    return found
