"""Limits of a character, checked before an import does expensive work."""

from __future__ import annotations

import numpy as np

from flowborne.base.errors import SceneError
from flowborne.kernels.arrays import Array

MAX_FILE_BYTES = 1 << 30
"""Size of a file, and total size of its buffers."""

MAX_JOINTS = 500
"""Each joint is a body nested in that of its parent."""

MAX_VERTICES = 500_000

MAX_WEIGHTS = 50_000_000
"""Vertices times joints."""

MAX_POSES = 3_000_000
"""Frames times nodes."""

MAX_SKINNING = 5e10
"""Frames times vertices times joints: some minutes of skinning."""

MAX_COORDINATE = 1e6
"""m"""

MAX_SCALE = 1e12
"""Entry of a joint's frame."""

MIN_SIZE = 1e-6
"""m along the longest side of a surface."""

KEY_INTERVALS = (1e-5, 1e4)
"""s between keys."""

MAX_NAME_LENGTH = 100
"""Characters of a joint's name."""


def wrong(said: str) -> SceneError:
    """The error of a file that contradicts itself."""
    return SceneError(f"{said}. Export it again.")


def check_size(joints: int, vertices: int, where: str) -> None:
    """Raise SceneError for more joints, vertices or weights than an import can process."""
    for count, most, what in (
        (joints, MAX_JOINTS, "joints"),
        (vertices, MAX_VERTICES, "vertices"),
        (joints * vertices, MAX_WEIGHTS, "weights (vertices times joints)"),
    ):
        if count > most:
            raise SceneError(
                f"{where} has {count:,} {what}; the maximum is {most:,}. Export a coarser mesh or "
                "fewer joints."
            )


def check_surface(vertices: Array, where: str) -> None:
    """Raise SceneError for a surface (k, 3), m, without a size or far from the origin."""
    check_points(vertices, where)
    size = float(np.ptp(vertices, axis=0).max())
    if size < MIN_SIZE:
        raise SceneError(
            f"{where}: the surface is {size:.3g} m long; the minimum is {MIN_SIZE:g} m. Scale it "
            "before exporting."
        )


def check_points(points: Array, where: str) -> None:
    """Raise SceneError unless points (..., 3), m, are finite and near the origin."""
    with np.errstate(all="ignore"):
        largest = float(np.abs(points).max(initial=0.0))
    if not largest <= MAX_COORDINATE:
        raise SceneError(
            f"{where}: a point has a coordinate of {largest:.3g} m; the maximum is "
            f"{MAX_COORDINATE:g} m. Look for stray points, or scale the character before exporting."
        )


def check_work(frames: int, joints: int, vertices: int, where: str) -> None:
    """Raise SceneError if skinning a surface in every frame would take hours."""
    if (work := float(frames) * joints * vertices) > MAX_SKINNING:
        raise SceneError(
            f"{where}: {frames:,} frames of {vertices:,} vertices on {joints} joints need "
            f"{work:.2g} sums; the maximum is {MAX_SKINNING:g}. Export a coarser mesh or a shorter "
            "clip."
        )


def check_frames(frames: float, step: float, nodes: int, where: str) -> None:
    """Raise SceneError for a clip with too many frames for its nodes, or a bad key interval.

    step  s between keys
    """
    if not KEY_INTERVALS[0] <= step <= KEY_INTERVALS[1]:
        raise SceneError(
            f"{where} has a key every {step:.3g} s; it must be {KEY_INTERVALS[0]:g} to "
            f"{KEY_INTERVALS[1]:g} s. Resample it before exporting."
        )
    if frames * nodes > MAX_POSES:
        raise SceneError(
            f"{where} needs {frames:,.0f} frames of {nodes} nodes; the maximum is {MAX_POSES:,} "
            "poses. Export a shorter clip, or one with fewer keys."
        )
