"""Elastic stresses in flesh, from the places of its nodes."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from flowborne.kernels.elastic import STABLE_NEO_HOOKEAN
from flowborne.solids.elasticity import Elasticity
from flowborne.solids.elements import shape_gradients

Array = NDArray[np.float64]


def deformation_gradients(elasticity: Elasticity, places: Array) -> Array:
    """(m, 3, 3) F at the centroid of every element, nodes being at `places` (n, 3), m; flesh of
    slabs is in plane strain."""
    slopes = shape_gradients(elasticity.rest, elasticity.elements)[0][:, -1]
    shift = (places - elasticity.rest)[elasticity.elements]
    return np.asarray(np.eye(3) + np.einsum("mai,maj->mij", shift, slopes))


def cauchy_stress(elasticity: Elasticity, F: Array) -> Array:
    """(m, 3, 3) Cauchy stress P F^T / det F of every element at F (m, 3, 3), Pa.

    P is the derivative of the energy that `kernels.elastic` states; what damping adds is left out.
    An element that is flat has none, which is said by nan.
    """
    mu, lame = (modulus[:, None, None] for modulus in elasticity.moduli.T)
    J = np.linalg.det(F)[:, None, None]
    C = np.swapaxes(F, 1, 2) @ F
    # the derivative of det F
    cofactor = np.stack([np.cross(F[:, (i + 1) % 3], F[:, (i + 2) % 3]) for i in range(3)], axis=1)
    soft = mu * F + ((lame + mu) * (J - 1.0) - mu) * cofactor
    strain = 0.5 * (C - np.eye(3))
    trace = np.trace(strain, axis1=1, axis2=2)[:, None, None]
    linear = F @ (lame * trace * np.eye(3) + 2.0 * mu * strain)
    is_soft = (np.asarray(elasticity.laws) == STABLE_NEO_HOOKEAN)[:, None, None]
    P = np.where(is_soft, soft, linear)
    return np.asarray(P @ np.swapaxes(F, 1, 2) / np.where(J == 0.0, np.nan, J))


def von_mises(stress: Array) -> Array:
    """(m,) von Mises' equivalent stress of stresses (m, 3, 3), Pa."""
    mean = np.trace(stress, axis1=1, axis2=2)[:, None, None] / 3.0
    apart = stress - mean * np.eye(3)
    return np.asarray(np.sqrt(1.5 * np.sum(apart**2, axis=(1, 2))))
