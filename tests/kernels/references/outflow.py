"""The net outflow of cells in NumPy: slower, and nearer to what it means."""

from __future__ import annotations

import numpy as np

from flowborne.kernels.arrays import Array, Faces


def outflow_reference(velocity: Faces, opened: Faces) -> Array:
    """`net_out` of the flow through open parts in NumPy."""
    parts = [np.diff(a * u, axis=n) for n, (a, u) in enumerate(zip(opened, velocity, strict=True))]
    return parts[0] + parts[1] + parts[2]
