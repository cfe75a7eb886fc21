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

from flowborne.fluid.boundary import Boundaries
from flowborne.fluid.control_volumes import wrapping
from flowborne.fluid.grid import Array, Faces, Grid
from flowborne.kernels.arrays import Integers, Marks
from flowborne.kernels.fleeting import let_through, what_leaves
from flowborne.kernels.flux import CUT, GHOSTS

CROSSED = 4.0
"""Whole cells that flow through a control volume in a step, beyond which it may be fleeting: with
fewer nothing grows that is seen in the flow."""

CHANGED = 0.5
"""Part of the volume at one end of a step, below which it falls at the other end of one that is
left or taken up."""


class Fleeting:
    """Those of one component: all of a step, of which those of a substep are chosen.

    index   (n,) flat, in ascending order
    beside  (n, 6) control volume beyond each side; -1 at a side of the domain, and before an open
            one, where what is upstream is carried
    rate    (n, 6) volume per time that leaves through each side, m^3/s
    """

    def __init__(self, index: Integers, beside: Integers, rate: Array, nothing: float) -> None:
        self.index, self.beside, self.rate, self.nothing = index, beside, rate, nothing
        self.gone = np.maximum(rate, 0.0).sum(axis=1)

    def choose(self, low: Array, high: Array, dt: float) -> None:
        """Choose those that more leaves in a substep than they hold at either end of it.

        low, high  their volumes there, m^3
        """
        held = np.maximum(low.reshape(-1)[self.index], high.reshape(-1)[self.index])
        chosen = dt * self.gone > held
        self.high, self.dt, self.own = high, dt, self.index[chosen]
        self.to, self.through = self.beside[chosen], self.rate[chosen]
        row = np.minimum(np.searchsorted(self.own, self.to), self.own.size - 1)
        self.row = np.where(self.own[row] == self.to, row, -1)

    def pass_on(self, later: Array, net: Array, field: Array, weight: float) -> None:
        """Let through their sides in a stage what leaves them and comes to them, in place.

        later   velocity after the stage with the mean of both beside a side, m/s
        net     amount that leaves each control volume per time
        field   velocity that the stage carried, m/s
        weight  of the stage; the first has 1, and the second lets through the same values
        """
        if self.own.size == 0:
            return
        field, lists = np.ascontiguousarray(field), (self.own, self.to, self.row)
        if weight == 1.0:
            self.arriving = field.reshape(-1)[self.to]
            self.leaving = what_leaves(
                field, later, self.high, *lists, self.dt * self.through, self.nothing
            )
        let_through(
            later, net, field, self.high, *lists, self.through, self.arriving, self.leaving,
            weight * self.dt, self.nothing,
        )  # fmt: skip


def left_or_taken_up(listed: Integers, start: Array, end: Array) -> Integers:
    """Those of listed control volumes that a body leaves or takes up.

    start, end  volumes at both ends of the step, m^3
    """
    one, other = start.reshape(-1)[listed], end.reshape(-1)[listed]
    return listed[np.minimum(one, other) < CHANGED * np.maximum(one, other)]


def beyond_sides(
    index: Integers, marks: Marks, component: int, grid: Grid, sides: Boundaries
) -> Integers:
    """(n, 6) `Fleeting.beside` of control volumes of a component.

    marks  of all of them, padded, see `transport.marks_of`
    """
    shape, wraps = grid.face_shape(component), wrapping(component, grid, sides)
    at, found = np.stack(np.unravel_index(index, shape)), np.full((index.size, 6), -1)
    depth = np.array([[GHOSTS * (axis in grid.axes)] for axis in range(3)])
    for axis in grid.axes:
        for upper in (0, 1):
            to = at.copy()
            to[axis] += 2 * upper - 1
            if wraps[axis]:
                to[axis] %= wraps[axis]
            cut = (marks[tuple(to + depth)] == CUT) & (to[axis] >= 0) & (to[axis] < shape[axis])
            flat = np.ravel_multi_index(tuple(to), shape, mode="clip")
            found[:, 2 * axis + upper] = np.where(cut, flat, -1)
    return found


def side_rates(
    flux: Faces, index: Integers, component: int, grid: Grid, place: Integers, share: Array
) -> Array:
    """(n, 6) volume per time that leaves control volumes of a component through their sides, m^3/s.

    flux          Faces, through the faces of the cells, m^3/s
    place, share  of which two of them those through the sides are means, see `transport.neighbours`
    """
    at, rate = np.unravel_index(index, grid.face_shape(component)), np.zeros((index.size, 6))
    for axis in grid.axes:
        for upper in (0, 1):
            side = [n + upper * (a == axis) for a, n in enumerate(at)]
            own, line = int(axis == component), side[component]
            for one in (0, 1):
                side[component] = place[own, line, one]
                through = share[own, line, one] * flux[axis][tuple(side)]
                rate[:, 2 * axis + upper] += (2 * upper - 1) * through
    return rate
