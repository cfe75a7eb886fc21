"""Grid noise beside bodies that fluid slips along: eddies of two cells, which nothing else damps.

Control volumes that bodies cut get momentum through sides whose values are off by a fraction of a
cell's difference, which makes eddies of two cells beside a body, moving or held. Elsewhere values
of third order damp them; near cut faces means carry the momentum, which damp nothing. There the
circulation around edges of the grid evens out as fast as third-order values damp the velocity:
of a wave of two cells they take 4/3 while the flow crosses a cell. Momentum stays exact, and a flow
without circulation as it is (see `kernels.eddies`).

In viscous fluid there is none of it: it would act on boundary layers.
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
        held, number = (
            (volumes[one], volumes[other]),
            np.zeros(count + (np.arange(3) != axis), np.int32),
        )
        faces, beside, least = edges_near(
            number, held, (cut[one], cut[other]), axis, count * periodic, GHOSTS
        )
        u, v = fields[one], fields[other]
        found.append((u, v, held, faces, beside, exchanges(u, v, faces, beside, least, rate)))
    for each in found:
        exchange(*each)
    for axis in grid.axes:
        if sides.periodic()[axis]:
            velocity[axis][edge(axis, -1)] = velocity[axis][edge(axis, 0)]
