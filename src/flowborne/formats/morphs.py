"""Flesh by linear blend skinning, with morph targets that correct the skinning error."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flowborne.formats.creature import Creature, Skin
from flowborne.kernels.arrays import Array, Integers

MIN_SINGULAR_VALUE = 1e-2
"""Singular value of a vertex's blended rotation below which targets do not act in its direction."""


@dataclass(frozen=True, eq=False)
class MorphedSkin:
    """A skin whose vertices follow the run when first morphed, then skinned.

    bones      (k, m) that carry each vertex, with weights shares (k, m); rows sum to 1
    targets    (t, k, 3) displacements in the rest pose, m
    weights    (frames, t) of the targets, from 0 to 1, the range that Blender supports
    error      largest distance of a vertex from the run in any frame, m
    unmorphed  the same without targets, m
    """

    bones: Integers
    shares: Array
    targets: Array
    weights: Array
    error: float
    unmorphed: float


def morphed(
    creature: Creature, skin: Skin, influences: int, most: int, tolerance: float
) -> MorphedSkin:
    """A skin with the fewest targets that reach the tolerance.

    The displacements before skinning that each frame needs are the rows of a matrix. The targets
    are its first principal components, one target per sign.

    influences  maximum number of bones per vertex
    most        maximum number of targets
    tolerance   m, error below which no target is added
    """
    bones, shares = strongest(skin.weights, influences)
    R, t = creature.skeleton.carried
    R = np.einsum("km,fkmij->fkij", shares, R[:, bones])  # of each vertex: x -> R x + t
    t = np.einsum("km,fkmi->fki", shares, t[:, bones])
    wanted = creature.run.every("flesh_vertices")[:, skin.chosen]
    skinned = np.einsum("fkij,kj->fki", R, skin.vertices) + t
    inverse = np.linalg.pinv(R, rcond=MIN_SINGULAR_VALUE)
    needed = np.einsum("fkij,fkj->fki", inverse, wanted - skinned)
    frames, vertices = needed.shape[:2]
    left, sizes, modes = np.linalg.svd(needed.reshape(frames, -1), full_matrices=False)
    weights, targets = np.zeros((frames, 0)), np.zeros((0, vertices, 3))
    error = unmorphed = _largest(wanted - skinned)
    for column, mode in zip(left.T * sizes[:, None], modes, strict=True):
        pair, pair_weights = _split_by_sign(column, mode.reshape(-1, 3))
        if error <= tolerance or len(targets) + len(pair) > most:
            break
        for target, weight in zip(pair, pair_weights, strict=True):
            skinned += np.einsum("fkij,kj->fki", R, target) * weight[:, None, None]
        targets = np.concatenate([targets, pair])
        weights = np.concatenate([weights, pair_weights.T], axis=1)
        error = _largest(wanted - skinned)
    return MorphedSkin(bones, shares, targets, weights, error, unmorphed)


def _split_by_sign(column: Array, mode: Array) -> tuple[Array, Array]:
    """Targets (s, k, 3) and weights (s, frames) of a principal component, in single precision.

    One target for each sign that occurs in the coefficients `column` (frames,).
    """
    signed = [(sign, np.maximum(sign * column, 0.0)) for sign in (1.0, -1.0)]
    used = [(sign * part.max(), part / part.max()) for sign, part in signed if part.any()]
    targets = np.array([factor * mode for factor, _ in used], np.float32).astype(np.float64)
    weights = np.array([part for _, part in used], np.float32).astype(np.float64)
    return targets.reshape(-1, *mode.shape), weights.reshape(-1, len(column))


def strongest(weights: Array, most: int) -> tuple[Integers, Array]:
    """The bones (k, m <= most) with the largest weights (k, n) for each vertex, and these (k, m).

    The weights are scaled so that rows sum to 1.
    """
    count = min(most, int((weights > 0.0).sum(axis=1).max()))
    bones = np.argsort(-weights, axis=1, kind="stable")[:, :count]
    shares = np.take_along_axis(weights, bones, axis=1)
    return bones, shares / shares.sum(axis=1, keepdims=True)


def _largest(distance: Array) -> float:
    return float(np.linalg.norm(distance, axis=2).max())
