"""Flesh by linear blend skinning, and morph targets for what skinning does not say."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flowborne.formats.creature import Array, Bound, Creature, Integers, Skeleton, Skin

FLAT = 1e-2
"""Singular value of a vertex's blended rotation below which no target reaches along it."""


@dataclass(frozen=True, eq=False)
class MorphedSkin:
    """A skin whose vertices are those of the run when morphed, then skinned.

    bones      (k, m) that carry each vertex, and shares (k, m), together 1
    targets    (t, k, 3) displacements in the model's own pose, m
    weights    (frames, t) of the targets, from 0 to 1: Blender takes no others
    error      largest distance of a vertex from the run's in any frame, m
    unmorphed  the same without targets, m
    """

    bones: Integers
    shares: Array
    targets: Array
    weights: Array
    error: float
    unmorphed: float


def morphed(creature: Creature, skin: Skin, influences: int, most: int, near: float) -> MorphedSkin:
    """A skin with as few targets as bring it to the run.

    The displacements that each frame needs before skinning are the rows of a matrix, and its first
    principal components are the targets, one to either side.

    influences  largest number of bones for a vertex
    most        largest number of targets
    near        m, distance from the run at which there are enough
    """
    bones, shares = strongest(skin, influences)
    turn, shift = blended(creature.skeleton, bones, shares)
    wanted = creature.run.every("flesh_vertices")[:, skin.chosen]
    placed = np.einsum("fkij,kj->fki", turn, skin.rest) + shift
    needed = np.einsum("fkij,fkj->fki", np.linalg.pinv(turn, rcond=FLAT), wanted - placed)
    frames, vertices = needed.shape[:2]
    left, sizes, modes = np.linalg.svd(needed.reshape(frames, -1), full_matrices=False)
    weights, targets = np.zeros((frames, 0)), np.zeros((0, vertices, 3))
    error = unmorphed = _farthest(wanted - placed)
    for column, mode in zip(left.T * sizes[:, None], modes, strict=True):
        pair, along = _to_and_fro(column, mode.reshape(-1, 3))
        if error <= near or len(targets) + len(pair) > most:
            break
        for target, weight in zip(pair, along, strict=True):
            placed += np.einsum("fkij,kj->fki", turn, target) * weight[:, None, None]
        targets = np.concatenate([targets, pair])
        weights = np.concatenate([weights, along.T], axis=1)
        error = _farthest(wanted - placed)
    return MorphedSkin(bones, shares, targets, weights, error, unmorphed)


def _to_and_fro(column: Array, mode: Array) -> tuple[Array, Array]:
    """Targets (s, k, 3) and their weights (s, frames) that make up a principal component, one for
    each sign that its factors `column` (frames,) have, in the precision of the file."""
    signed = [(sign, np.maximum(sign * column, 0.0)) for sign in (1.0, -1.0)]
    used = [(sign * part.max(), part / part.max()) for sign, part in signed if part.any()]
    targets = np.array([factor * mode for factor, _ in used], np.float32).astype(np.float64)
    weights = np.array([part for _, part in used], np.float32).astype(np.float64)
    return targets.reshape(-1, *mode.shape), weights.reshape(-1, len(column))


def strongest(skin: Skin | Bound, most: int) -> tuple[Integers, Array]:
    """Bones (k, m) and their shares (k, m), together 1, that carry most of each vertex."""
    count = min(most, int((skin.weights > 0.0).sum(axis=1).max()))
    bones = np.argsort(-skin.weights, axis=1, kind="stable")[:, :count]
    shares = np.take_along_axis(skin.weights, bones, axis=1)
    return bones, shares / shares.sum(axis=1, keepdims=True)


def blended(skeleton: Skeleton, bones: Integers, shares: Array) -> tuple[Array, Array]:
    """(frames, k, 3, 3) and (frames, k, 3) m of the motion x -> R x + t of each vertex from the
    model's own pose, the mean of its bones'."""
    turn, shift = skeleton.carried
    return (
        np.einsum("km,fkmij->fkij", shares, turn[:, bones]),
        np.einsum("km,fkmi->fki", shares, shift[:, bones]),
    )


def _farthest(apart: Array) -> float:
    return float(np.linalg.norm(apart, axis=2).max())
