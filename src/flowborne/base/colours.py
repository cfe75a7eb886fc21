"""Conversion of colours between sRGB and linear light.

source  IEC 61966-2-1 (sRGB)
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray


def to_linear(shown: ArrayLike) -> NDArray[np.float64]:
    """Linear light, as in glTF and USD, of sRGB values from 0 to 1."""
    values = np.asarray(shown, float)
    return np.where(values <= 0.04045, values / 12.92, ((values + 0.055) / 1.055) ** 2.4)


def to_srgb(light: ArrayLike) -> NDArray[np.float64]:
    """sRGB values of linear light, which is clipped to 0 to 1."""
    values = np.clip(np.asarray(light, float), 0.0, 1.0)
    return np.where(values <= 0.0031308, 12.92 * values, 1.055 * values ** (1.0 / 2.4) - 0.055)
