"""Grid noise beside bodies that the fluid slips along: eddies of two cells.

A cut control volume gets momentum through sides whose values are off by a fraction of a cell's
difference. That makes eddies of two cells, beside moving and held bodies alike. Values of third
order damp such eddies; the means that carry the momentum near cut faces do not. There the
circulation around the edges of the grid evens out, as fast as third-order values damp a wave of two
cells. Momentum stays exact, and so does a flow without circulation (see `kernels.eddies`).

Viscous fluid has none of it: it would act on boundary layers.
"""

from __future__ import annotations

import numpy as np

from flowborne.fluid.boundary import Boundaries
from flowborne.fluid.control_volumes import NONE
from flowborne.fluid.ghosts import edge, planes
from flowborne.fluid.grid import Faces, Grid
from flowborne.fluid.transport import Transport
from flowborne.kernels.eddies import edges_near, exchange, exchanges
from flowborne.kernels.flux import GHOSTS

UPWIND_DAMPING = 4.0 / 3.0
"""What a third-order upwind value takes of a wave of two cells while the flow crosses a cell."""


def damp_eddies(velocity: Faces, transport: Transport, grid: Grid, sides: Boundaries) -> None:
    """Even out the circulation near faces cut at the end of a step, in place."""
    fields, volumes = planes(velocity, grid), planes(transport.after.moving, grid)
    count, cut, periodic = np.array(grid.shape), transport.after.cut, np.array(sides.periodic())
    if grid.is_slab:
        count, cut, periodic = np.roll(count, 1), (NONE, *cut[:2]), np.roll(periodic, 1)
    rate, found = UPWIND_DAMPING * transport.dt / grid.spacing, []
    for axis in range(1 if grid.is_slab else 3):
        one, other = (axis + 1) % 3, (axis + 2) % 3
        number = np.zeros(count + (np.arange(3) != axis), np.int32)
        u, v, held = fields[one], fields[other], (volumes[one], volumes[other])
        near = edges_near(number, held, (cut[one], cut[other]), axis, count * periodic, GHOSTS)
        found.append((u, v, held, *near[:2], exchanges(u, v, *near, rate)))
    for each in found:
        exchange(*each)
    for axis in grid.axes:
        if sides.periodic()[axis]:
            velocity[axis][edge(axis, -1)] = velocity[axis][edge(axis, 0)]
