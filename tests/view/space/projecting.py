"""Where a camera shows a point."""

import numpy as np

from flowborne.kernels.arrays import Array
from flowborne.view.space.camera import Camera


def project(camera: Camera, number: int, points: Array) -> Array:
    """(n, 2) place of `points` (n, 3) on the map of a frame: 0 left and below, 1 right and
    above."""
    right, up, toward = camera.axes(number)
    offset = points - camera.focus[number]
    distance = np.linalg.norm(camera.away[number])
    height = 2.0 * distance * np.tan(0.5 * camera.lens)
    depth = 1.0 - offset @ toward / distance
    on_map = np.stack([offset @ right * camera.aspect / height, offset @ up / height], axis=-1)
    return np.asarray(0.5 + on_map / depth[:, None])
