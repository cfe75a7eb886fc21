"""One V-cycle of the multigrid as an operator on fields (see `kernels.v_cycle`)."""

from __future__ import annotations

import numpy as np

from flowborne.kernels.arrays import Array, Faces, Mask
from flowborne.kernels.levels import at_level
from flowborne.kernels.v_cycle import v_cycle
from flowborne.solvers.pressure import PressureSystem


class VCycle:
    """V, symmetric positive definite and close to the inverse of a diagonal less links.

    weights   links on the faces between cells, 0 on the outer ones but where the grid wraps
    rest      (nx, ny, nz) what the diagonal is more than the sum of the links of a cell, at least 0
    diagonal  (nx, ny, nz) of which cells without a link have the inverse; 0 where nothing is solved
    wraps     (3,) of each axis
    """

    def __init__(self, weights: Faces, rest: Array, diagonal: Array, wraps: Mask) -> None:
        periodic = bool(wraps[0]), bool(wraps[1]), bool(wraps[2])
        self.system = PressureSystem(weights, periodic, rest)
        alone = self.system.buffers.finest[3][self.system.inside].reshape(diagonal.shape) == 0.0
        self.own = np.divide(
            1.0, diagonal, out=np.zeros(diagonal.shape), where=alone & (diagonal > 0.0)
        )

    def times(self, field: Array) -> Array:
        """V field; a field that wraps may have its first layer again at the end."""
        own = tuple(slice(0, n) for n in self.own.shape)
        buffers, inside = self.system.buffers, self.system.inside
        x, b, _ = buffers.cycle
        table = buffers.hierarchy[0]
        z, source = at_level(x, table, 0), at_level(b, table, 0)
        most = float(np.abs(field).max())
        out = np.zeros_like(field)
        if most == 0.0:
            return out
        source[inside] = (field[own] / most).reshape(source[inside].shape)
        v_cycle(buffers.hierarchy, *buffers.cycle)
        scale = most * self.system.scale
        out[own] = scale * z[inside].reshape(self.own.shape) + self.own * field[own]
        return out
