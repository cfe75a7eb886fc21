"""The flow at points, as a sensor of a creature reads it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import map_coordinates

from flowborne.coupling.cut import cut_by_bodies
from flowborne.coupling.stream import Sampled
from flowborne.coupling.world import World
from flowborne.kernels.arrays import Array


@dataclass(frozen=True, eq=False)
class FlowState:
    """The fluid at points, in world axes.

    velocity  (n, 3) m/s
    pressure  (n,) dynamic pressure, Pa; nan where no fluid is within a cell
    """

    velocity: Array
    pressure: Array


def flow_at(world: World, x: Array) -> FlowState:
    """The fluid at points x (n, 3), linear between faces and between the centres of cells that hold
    fluid; beyond the domain that at its side. Raises ValueError without a fluid."""
    fluid, state = world.flow()
    grid = fluid.grid
    at = ((x - np.array(grid.origin)) / grid.spacing - 0.5).T
    if grid.is_slab:
        at[2] = 0.0
    wet = (cut_by_bodies(world).volume > 0.0).astype(np.float64)
    pressed, share = (
        map_coordinates(values, at, order=1, mode="nearest")
        for values in (wet * state.pressure, wet)
    )
    pressure = np.divide(pressed, share, out=np.full(share.shape, np.nan), where=share > 0.0)
    return FlowState(Sampled(state.velocity, grid)(x, world.time), pressure)
