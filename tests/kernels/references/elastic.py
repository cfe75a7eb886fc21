"""The kernels of `elastic` in NumPy: slower, and nearer to what they mean."""

from __future__ import annotations

import numpy as np

from flowborne.kernels.arrays import Array
from flowborne.kernels.elastic import STABLE_NEO_HOOKEAN


def stress_reference(F: Array, mu: float, lame: float, law: int) -> Array:
    """(3, 3) first Piola-Kirchhoff stress in NumPy."""
    if law == STABLE_NEO_HOOKEAN:
        J = np.linalg.det(F)
        return np.asarray(mu * F + ((lame + mu) * (J - 1.0) - mu) * J * np.linalg.inv(F).T)
    E = 0.5 * (F.T @ F - np.eye(3))
    return np.asarray(F @ (lame * np.trace(E) * np.eye(3) + 2.0 * mu * E))


def stiffness_reference(
    u: Array, gradients: Array, volumes: Array, moduli: Array, law: int
) -> Array:
    """(3k, 3k) stiffness of one element displaced by (k, 3) m, by differences of the stress, in
    NumPy; `gradients` (q, k, 3), `volumes` (q,), `moduli` (q, 2)."""
    K: Array = np.zeros((u.size, u.size))
    eps = 1e-5
    for g, volume, (mu, lame) in zip(gradients, volumes, moduli, strict=True):
        F = np.eye(3) + u.T @ g
        A = np.empty((9, 9))
        for n, one in enumerate(np.eye(9).reshape(9, 3, 3)):
            ahead, back = (
                stress_reference(F + sign * eps * one, mu, lame, law) for sign in (1.0, -1.0)
            )
            A[n] = ((ahead - back) / (2.0 * eps)).ravel()
        share, axes = np.linalg.eigh(0.5 * (A + A.T))
        A = (axes * np.maximum(share, 0.0)) @ axes.T
        B = np.einsum("mn,aj->mjan", np.eye(3), g).reshape(9, -1)
        K += volume * B.T @ A @ B
    return K
