"""Colours as screens show them and as light adds up.

source  IEC 61966-2-1 (sRGB)
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]


def to_linear(shown: ArrayLike) -> Array:
    """Light, as glTF and USD have colours, of sRGB values from 0 to 1."""
    values = np.asarray(shown, float)
    return np.where(values <= 0.04045, values / 12.92, ((values + 0.055) / 1.055) ** 2.4)


def to_srgb(light: ArrayLike) -> Array:
    """The way back; what is below 0 or above 1 is 0 or 1."""
    values = np.clip(np.asarray(light, float), 0.0, 1.0)
    return np.where(values <= 0.0031308, 12.92 * values, 1.055 * values ** (1.0 / 2.4) - 0.055)
