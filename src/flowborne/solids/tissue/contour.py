"""The closed surface at some distance from the bones."""

from __future__ import annotations

import numpy as np

from flowborne.extras import flesh_library
from flowborne.shapes.shape import Mesh
from flowborne.solids.tissue.bones import Bones

MOST_SAMPLES = 2_000_000
"""Where a lattice would have more samples than this, it is coarser than asked for."""


def finest(bones: Bones, level: float) -> float:
    """Least distance of the samples from which a contour is made, m."""
    low, high = bones.box
    return float(np.cbrt((high - low + 2.0 * level).prod() / MOST_SAMPLES))


def contour(bones: Bones, level: float, pitch: float) -> Mesh:
    """Closed outward surface `level` m outside the union of the bones, in world axes.

    Sampled `pitch` m apart: edges that are sharper than that are cut off.
    """
    pv = flesh_library()
    low, high = bones.box
    low, high = low - level, high + level
    pitch = max(pitch, finest(bones, level))
    counts = np.ceil((high - low) / pitch).astype(int) + 5
    lattice = pv.ImageData(dimensions=counts, spacing=(pitch,) * 3, origin=low - 2.0 * pitch)
    distance = bones.distance(np.asarray(lattice.points, dtype=np.float64))
    lattice.point_data["distance"] = distance
    surface = lattice.contour([level], scalars="distance", method="flying_edges")
    inward = surface.regular_faces.astype(np.int64)
    return np.asarray(surface.points, dtype=np.float64), inward[:, ::-1]
