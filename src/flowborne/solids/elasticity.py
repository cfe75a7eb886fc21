"""Elastic forces and stiffness of the nodes of flesh, as sparse matrices.

Nearly incompressible elements lock where all of their volume change costs energy at every
quadrature point. What lambda is beyond MIXED mu is taken at the element's centroid alone (selective
reduced integration, Malkus and Hughes 1978); the rest at all points, for one layer of elements
would bend too easily without.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array

from flowborne.kernels.elastic import (
    Elements,
    add_stiffness,
    elastic_energy,
    elastic_forces,
    volume_ratios,
)
from flowborne.solids.elements import shape_gradients

Array = NDArray[np.float64]
Indices = NDArray[np.int64]


MIXED = 12.0
"""Largest lambda over mu that is integrated in full, that of Poisson's ratio 0.46: one layer of
elements then bends 1 to 5 % too little or too much at any ratio from 0 to 0.49."""


@dataclass(frozen=True)
class Elasticity:
    """What nodes of flesh exert on each other.

    rest      (n, 3) places at rest, m
    elements  (m, 6) or (m, 10) nodes
    moduli    (m, 2) Lame's constants mu and lambda of each element, N/m^2
    laws      (m,) see kernels.elastic
    """

    rest: Array
    elements: Indices
    moduli: Array
    laws: Indices

    def forces(self, places: Array) -> Array:
        """(n, 3) forces on nodes at `places` (n, 3), N."""
        return elastic_forces(places - self.rest, self._elements)

    def energy(self, places: Array) -> float:
        """J."""
        return elastic_energy(places - self.rest, self._elements)

    def volume_ratios(self, places: Array) -> Array:
        """(m,) least det F of each element."""
        return volume_ratios(places - self.rest, self._elements)

    def stiffness(self, places: Array) -> csr_array:
        """(3n, 3n) derivative of minus the forces, N/m, where it is positive semidefinite."""
        indices, starts, slot, stride = self._pattern
        values = np.zeros(len(indices))
        add_stiffness(places - self.rest, self._elements, slot, stride, values)
        return csr_array((values, indices, starts), shape=(self.rest.size, self.rest.size))

    @cached_property
    def _elements(self) -> Elements:
        gradients, volume = shape_gradients(self.rest, self.elements)
        mu, lame = self.moduli.T
        points, beyond = gradients.shape[1] - 1, np.maximum(lame - MIXED * mu, 0.0)
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
    def _pattern(self) -> tuple[Indices, Indices, Indices, Indices]:
        """Columns and starts of rows of the matrix, and `slot` and `stride` of `add_stiffness`."""
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
        return indices, starts, place[at].reshape(-1, k, k), 3 * degree
