"""The kernels of `v_cycle` in NumPy: slower, and nearer to what they mean."""

from __future__ import annotations

import numpy as np

from flowborne.kernels.arrays import Array, Hierarchy, Real
from flowborne.kernels.levels import at_level, interpolation_at, orphans_at, weights_at, wrap_ghosts
from flowborne.kernels.smoothing import STEPS
from flowborne.kernels.v_cycle import COARSEST

from .smoothing import defect_reference, smooth_reference
from .transfer import interpolate_reference, restrict_reference


def v_cycle_reference(hierarchy: Hierarchy, b: Real, level: int = 0) -> Array:
    """`v_cycle` in NumPy: x of a level for its b, both padded, ghosts of x as the sides have it."""
    table, periodic, weights, _, inverse, _, interpolation, marks, orphans, aggregates = hierarchy
    w, a = weights_at(weights, table, level), at_level(inverse, table, level)
    coarsest = level == table.shape[0] - 2
    x = np.zeros(b.shape)
    for step in [*range(STEPS)] * (COARSEST if coarsest else 1):
        x = smooth_reference(x, b, w, a, step)
        wrap_ghosts(x, periodic)
    if coarsest:
        return x
    parts = (
        at_level(marks, table, level),
        interpolation_at(interpolation, table, level),
        orphans_at(orphans, table, level),
        at_level(aggregates, table, level),
    )
    r = defect_reference(x, b, w, a)
    coarse = np.zeros(at_level(inverse, table, level + 1).shape)
    wrap_ghosts(r, periodic)
    coarse = restrict_reference(coarse, r, *parts, periodic)
    x = interpolate_reference(x, v_cycle_reference(hierarchy, coarse, level + 1), *parts)
    for step in reversed(range(STEPS)):
        wrap_ghosts(x, periodic)
        x = smooth_reference(x, b, w, a, step)
    wrap_ghosts(x, periodic)
    return x
