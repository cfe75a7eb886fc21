"""One symmetric V-cycle on K: the preconditioner of the pressure solve.

Both ways it smooths by the same polynomial in D^-1 K, so that the cycle is a symmetric positive
definite operator.
"""

from __future__ import annotations

from flowborne.kernels.arrays import Hierarchy, Real
from flowborne.kernels.jit import kernel
from flowborne.kernels.levels import (
    COMMON,
    OFFSET,
    at_level,
    even_at,
    interpolation_at,
    orphans_at,
    weights_at,
    wrap_ghosts,
)
from flowborne.kernels.smoothing import (
    STEPS,
    defect,
    first_smooth,
    smooth,
    smooth_down,
    smooth_up,
)
from flowborne.kernels.transfer import (
    interpolate,
    restrict,
)

COARSEST = 15
"""Times that all steps are made on the coarsest level, of at most 4 cells along an axis; odd."""

SERIAL = 40_000
"""Cells of a level, ghosts included, below which threads would cost more than they save."""


@kernel
def leg(hierarchy: Hierarchy, x: Real, b: Real, r: Real, level: int, down: bool) -> None:
    """The cycle's work on one level, on its way down (from x = 0, then b of the next level) or up
    (from x of the next level)."""
    table, periodic, weights, _, inverse, even, interpolation, marks, orphans, aggregates = (
        hierarchy
    )
    coarsest = table.shape[0] - 2
    (w0, w1, w2), a = weights_at(weights, table, level), at_level(inverse, table, level)
    operator = (w0, w1, w2, a, even_at(even, table, level), table[level, COMMON])
    xl, bl = at_level(x, table, level), at_level(b, table, level)
    rl = at_level(r, table, level)
    fine = not periodic.any() and level < coarsest
    between = (
        at_level(marks, table, level),
        interpolation_at(interpolation, table, level),
        orphans_at(orphans, table, level),
        at_level(aggregates, table, level),
    )
    if not down:
        interpolate(rl, xl, at_level(x, table, level + 1), *between)
    if fine and down:
        smooth_down(xl, rl, bl, operator)
    elif fine:
        smooth_up(xl, rl, bl, operator)
    else:
        if down:
            first_smooth(xl, bl, a)
        here, there = (xl, rl) if down else (rl, xl)
        steps = STEPS * COARSEST if level == coarsest else STEPS
        for n in range(1 if down else 0, steps):
            wrap_ghosts(here, periodic)
            smooth(there, here, bl, operator, n % STEPS if down else STEPS - 1 - n)
            here, there = there, here
        wrap_ghosts(xl, periodic)
        if down and level < coarsest:
            defect(rl, xl, bl, operator)
            wrap_ghosts(rl, periodic)
    if down and level < coarsest:
        restrict(at_level(b, table, level + 1), rl, *between)


serial_leg = leg.serial
"""For levels too small for threads, in the cycle's parallel twin as well."""


@kernel
def v_cycle(hierarchy: Hierarchy, x: Real, b: Real, r: Real) -> None:
    """x = V b on the finest level, V symmetric positive definite, close to the inverse of K.

    x, b, r  packed over the levels; b's finest level is given, all else is overwritten
    """
    table = hierarchy[0]
    coarsest = table.shape[0] - 2
    for n in range(2 * coarsest + 1):
        down = n <= coarsest
        level = n if down else 2 * coarsest - n
        if table[level + 1, OFFSET] - table[level, OFFSET] < SERIAL:
            serial_leg(hierarchy, x, b, r, level, down)
        else:
            leg(hierarchy, x, b, r, level, down)
