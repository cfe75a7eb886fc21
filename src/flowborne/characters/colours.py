"""Colours of the faces of a surface: of a texture, and few enough to draw each as a skin."""

from __future__ import annotations

import numpy as np
from PIL import Image

from flowborne.characters.rig import Array, Integers

PLAIN = 0.5
"""Red, green and blue of a surface whose file gives it no colour."""

MOST_COLOURS = 8
"""Colours of a surface at most."""


def texture_at(image: Image.Image, places: Array) -> Array:
    """(m, 3) sRGB values from 0 to 1 of the pixels nearest to places.

    places  (m, 2) of a texture: 0 left, 0 above; it repeats beyond 1
    """
    pixels = np.asarray(image.convert("RGB"))
    height, width = pixels.shape[:2]
    inside = np.nan_to_num(places) % 1.0
    columns = np.minimum((inside[:, 0] * width).astype(int), width - 1)
    rows = np.minimum((inside[:, 1] * height).astype(int), height - 1)
    return np.asarray(pixels[rows, columns] / 255.0)


def few_colours(colours: Array) -> tuple[Array, Integers]:
    """MOST_COLOURS colours (n, 3) or fewer, and which of them (m,) stands for each of (m, 3)."""
    bytes_of = np.rint(255.0 * np.clip(np.nan_to_num(colours), 0.0, 1.0)).astype(np.uint8)
    found, which = np.unique(bytes_of, axis=0, return_inverse=True)
    if len(found) > MOST_COLOURS:
        reduced = Image.fromarray(bytes_of[None]).quantize(
            MOST_COLOURS, Image.Quantize.MEDIANCUT, MOST_COLOURS
        )
        palette = np.array(reduced.getpalette(), np.uint8).reshape(-1, 3)
        used, which = np.unique(np.asarray(reduced)[0], return_inverse=True)
        found = palette[used]
    return found / 255.0, which.reshape(-1).astype(np.int64)
