"""Potentials of sources all over a grid, on planes of it.

Every source in a plane has the same potential about it, so sums over a plane are convolutions,
computed by Fourier transforms of twice the size: with no images, and to rounding. The planes are
added up one by one.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from scipy import fft

from flowborne.fluid.grid import Array
from flowborne.fluid.sides.side import Place
from flowborne.kernels.potentials import sum_layers


@lru_cache(maxsize=32)
def _weights(layers: int, size: tuple[int, ...]) -> Array:
    """(layers, k) transforms of the potential of a source of 1 around rings of these sizes, at so
    many cells beside its plane: -(1/2 pi) ln r in a slab, 1 / (4 pi r) in a room, r in cells."""
    square = np.arange(layers, dtype=float)[(slice(None), *(None,) * len(size))] ** 2
    for axis, n in enumerate(size):
        along = [-1 if a == axis else 1 for a in range(len(size))]
        square = square + np.reshape(np.minimum(np.arange(n), n - np.arange(n)), (1, *along)) ** 2
    square[(0,) * square.ndim] = 1.0
    one = 1.0 / (4.0 * np.pi * np.sqrt(square))
    potential = one if len(size) == 2 else np.log(square) / (-4.0 * np.pi)
    transform = fft.rfftn(potential, axes=range(1, square.ndim)).real
    found: Array = np.ascontiguousarray(transform).reshape(layers, -1)
    return found


def on_planes(sources: Array, axis: int, at: tuple[int, ...]) -> list[Array]:
    """Potential of sources on a grid of two or three axes, on planes across one of them.

    at       indices of planes, without sources
    returns  of each plane, an array of the other axes
    """
    layers = np.ascontiguousarray(np.moveaxis(sources, axis, 0))
    shape, axes = layers.shape[1:], tuple(range(1, layers.ndim))
    size = tuple(fft.next_fast_len(2 * n - 1, real=True) for n in shape)
    spectrum = fft.rfftn(layers, size, axes)
    weights, half = _weights(len(layers), size), spectrum.shape[1:]
    spectrum, found = spectrum.reshape(len(layers), -1), []
    for place in at:
        total = np.empty(spectrum.shape[1], complex)
        sum_layers(total, spectrum, weights, place)
        values = fft.irfftn(total.reshape(half), size)
        found.append(values[tuple(slice(n) for n in shape)])
    return found


def with_images(
    circulation: Array, axis: int, mirrors: tuple[Place, ...]
) -> tuple[Array, tuple[slice, ...]]:
    """Circulations round edges along `axis`, in a slab the nodes along z, with their images behind
    mirrors, and where the domain lies among them. Vorticity across a mirror has images of its sign,
    that along it of the other.
    """
    inside = [slice(None)] * circulation.ndim
    for place in mirrors:
        own, count = place.axis == axis, circulation.shape[place.axis]
        image = np.flip(circulation, place.axis) * (1.0 if own else -1.0)
        index = [slice(None)] * circulation.ndim
        if not own:  # edges on the mirror are their own images
            index[place.axis] = slice(1, None) if place.upper else slice(None, -1)
        parts = [circulation, image[tuple(index)]]
        inside[place.axis] = slice(count) if place.upper else slice(-count, None)
        circulation = np.concatenate(parts if place.upper else parts[::-1], place.axis)
    return circulation, tuple(inside)
