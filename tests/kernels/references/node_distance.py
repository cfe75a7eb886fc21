"""The kernels of `node_distance` in NumPy: slower, and nearer to what they mean."""

from __future__ import annotations

import numpy as np

from flowborne.kernels.arrays import Array, Integers
from flowborne.kernels.distance import Samples
from flowborne.kernels.node_distance import BAND

from .distance import signed_distance_reference


def node_box_reference(
    position: Array, rotation: Array, reach: Array, origin: Array, h: float, shape: Integers
) -> Integers:
    """`node_box` around all of the geometries in NumPy."""
    extent = np.einsum("gam,gm->ga", np.abs(rotation), reach)
    low, high = (position - extent).min(axis=0), (position + extent).max(axis=0)
    first, last = np.floor((low - origin) / h - BAND), np.ceil((high - origin) / h + BAND) + 1.0
    return np.clip(np.stack([first, last], axis=1), 0, shape[:, None] + 1).astype(np.int64)


def sample_body_reference(
    box: Integers,
    geoms: Integers,
    kind: Integers,
    size: Array,
    position: Array,
    rotation: Array,
    samples: Samples,
    origin: Array,
    h: float,
    flat: bool,
) -> Array:
    """`lower_to_body` in NumPy for some geometries: the distances."""
    shape = box[:, 1] - box[:, 0]
    x = origin + h * (np.moveaxis(np.indices(tuple(shape)), 0, -1).reshape(-1, 3) + box[:, 0])
    if flat:
        x[:, 2] = 0.0
    phi = np.full(len(x), BAND * h)
    for g in geoms:
        local = (x - position[g]) @ rotation[g]
        phi = np.minimum(phi, signed_distance_reference(kind[g], size[g], local, samples))
    return phi.reshape(shape)
