"""Elastic forces and stiffness of the nodes of flesh, as sparse matrices.

Nearly incompressible elements lock if their volume change costs energy at every quadrature point.
The part of lambda above FULL_RATIO mu is integrated at the centroid of the element only (selective
reduced integration, Malkus and Hughes 1978), the rest at all points: without the rest, one layer of
elements would bend too easily.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.sparse import csr_array

from flowborne.kernels.arrays import Array, Indices, Integers
from flowborne.kernels.elastic import (
    Elements,
    add_stiffness,
    elastic_energy,
    elastic_forces,
    volume_ratios,
)
from flowborne.solids.elements import shape_gradients

FULL_RATIO = 12.0
"""Largest lambda over mu that is fully integrated, that of Poisson's ratio 0.46: the bending of one
layer of elements is then right to 1 to 5 % at any ratio from 0 to 0.49."""


@dataclass(frozen=True)
class Elasticity:
    """Elastic forces between nodes of flesh.

    rest      (n, 3) positions at rest, m
    elements  (m, 6) or (m, 10) nodes
    moduli    (m, 2) Lame's constants mu and lambda of each element, N/m^2
    laws      (m,) see kernels.elastic
    """

    rest: Array
    elements: Integers
    moduli: Array
    laws: Integers

    def forces(self, positions: Array) -> Array:
        """(n, 3) forces on nodes at `positions` (n, 3), N."""
        return elastic_forces(positions - self.rest, self._elements)

    def energy(self, positions: Array) -> float:
        """Elastic energy, J."""
        return elastic_energy(positions - self.rest, self._elements)

    def volume_ratios(self, positions: Array) -> Array:
        """(m,) least det F of each element."""
        return volume_ratios(positions - self.rest, self._elements)

    def stiffness(self, positions: Array) -> csr_array:
        """(3n, 3n) positive semidefinite part of minus the derivative of the forces, N/m."""
        indices, starts, slot, stride = self._pattern
        values = np.zeros(len(indices))
        add_stiffness(positions - self.rest, self._elements, slot, stride, values)
        return csr_array((values, indices, starts), shape=(self.rest.size, self.rest.size))

    @cached_property
    def _elements(self) -> Elements:
        gradients, volume = shape_gradients(self.rest, self.elements)
        mu, lame = self.moduli.T
        points, beyond = gradients.shape[1] - 1, np.maximum(lame - FULL_RATIO * mu, 0.0)
        volumes = np.repeat(volume[:, None] / points, points + 1, axis=1)
        volumes[:, points] = volume
        moduli = np.repeat(np.stack([mu, lame - beyond], axis=1)[:, None], points + 1, axis=1)
        moduli[:, points] = np.stack([np.zeros_like(mu), beyond], axis=1)
        used = points + int(beyond.any())
        return (
            self.elements,
            np.ascontiguousarray(gradients[:, :used]),
            np.ascontiguousarray(volumes[:, :used]),
            np.ascontiguousarray(moduli[:, :used]),
            self.laws,
        )

    @cached_property
    def _pattern(self) -> tuple[Indices, Indices, Integers, Integers]:
        """Columns and row starts of the matrix, and `slot` and `stride` of `add_stiffness`."""
        count, k = len(self.rest), self.elements.shape[1]
        row, column = np.repeat(self.elements, k, axis=1), np.tile(self.elements, (1, k))
        pairs, at = np.unique(row.ravel() * count + column.ravel(), return_inverse=True)
        degree = np.bincount(pairs // count, minlength=count)
        first = np.cumsum(degree) - degree
        place = 9 * first[pairs // count] + 3 * (np.arange(len(pairs)) - first[pairs // count])
        columns = (3 * (pairs % count)[:, None] + np.arange(3)).reshape(-1, 3)
        indices = np.concatenate(
            [np.tile(columns[f : f + d].ravel(), 3) for f, d in zip(first, degree, strict=True)]
        )
        starts = np.concatenate([[0], np.cumsum(np.repeat(3 * degree, 3))])
        return (
            indices.astype(np.int32),
            starts.astype(np.int32),
            place[at].reshape(-1, k, k),
            3 * degree,
        )
