"""A shape: a ring about z."""

from dataclasses import dataclass

import numpy as np

from flowborne.parts import shape


@shape("torus")
@dataclass(frozen=True)
class Torus:
    radius: float
    tube: float

    def distance(self, points: np.ndarray) -> np.ndarray:
        ring = np.hypot(points[:, 0], points[:, 1]) - self.radius
        return np.hypot(ring, points[:, 2]) - self.tube

    def half_extents(self) -> list[float]:
        return [self.radius + self.tube, self.radius + self.tube, self.tube]
