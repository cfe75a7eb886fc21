"""What a character may ask for: sizes with which an import ends, checked before the work."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from flowborne.errors import SceneError

Array = NDArray[np.float64]

MOST_JOINTS = 500
"""Each is a body in the one above it."""

MOST_VERTICES = 500_000

MOST_WEIGHTS = 50_000_000
"""Vertices times joints."""

MOST_POSES = 3_000_000
"""Frames times nodes."""

MOST_SKINNED = 5e10
"""Frames times vertices times joints, some minutes of skinning."""

FARTHEST = 1e6
"""m from the origin."""

SMALLEST = 1e-6
"""m along the longest side of a surface."""

FRAME_TIMES = (1e-5, 1e4)
"""s between keys."""

LONGEST_NAME = 100
"""Letters of a joint's name."""


def check_size(joints: int, vertices: int, where: str) -> None:
    """Raise SceneError where there are more joints, vertices or weights than can be worked on."""
    for count, most, what in (
        (joints, MOST_JOINTS, "joints"),
        (vertices, MOST_VERTICES, "vertices"),
        (joints * vertices, MOST_WEIGHTS, "weights (vertices times joints)"),
    ):
        if count > most:
            raise SceneError(
                f"{where} has {count:,} {what}, and {most:,} are the most. Export a coarser mesh, "
                "or fewer joints."
            )


def check_surface(vertices: Array, where: str) -> None:
    """Raise SceneError unless a surface (k, 3), m, has a size and is near."""
    check_places(vertices, where)
    size = float(np.ptp(vertices, axis=0).max())
    if size < SMALLEST:
        raise SceneError(
            f"{where}: the surface is {size:.3g} m long, and {SMALLEST:g} m is the least. Scale it "
            "before exporting."
        )


def check_places(places: Array, where: str) -> None:
    """Raise SceneError unless places (..., 3), m, are finite and not too far away."""
    with np.errstate(all="ignore"):
        largest = float(np.abs(places).max(initial=0.0))
    if not largest <= FARTHEST:
        raise SceneError(
            f"{where}: a point has a coordinate of {largest:.3g} m, and {FARTHEST:g} m is the "
            "most. Look for stray points, or scale the character before exporting."
        )


def check_poses(matrices: Array, where: str) -> None:
    """Raise SceneError unless frames (..., 4, 4) are finite and not too far away."""
    check_places(matrices[..., :3, 3], where)
    with np.errstate(all="ignore"):
        largest = float(np.abs(matrices[..., :3, :3]).max(initial=0.0))
    if not largest < 1e12:
        raise SceneError(
            f"{where}: a joint is scaled by {largest:.3g}. Apply scales before exporting."
        )


def check_work(frames: int, joints: int, vertices: int, where: str) -> None:
    """Raise SceneError where skinning a surface in every frame takes hours."""
    if (work := float(frames) * joints * vertices) > MOST_SKINNED:
        raise SceneError(
            f"{where}: {frames:,} frames of {vertices:,} vertices on {joints} joints ask for "
            f"{work:.2g} sums, and {MOST_SKINNED:g} are the most. Export a coarser mesh or a "
            "shorter clip."
        )


def check_frames(frames: float, step: float, nodes: int, where: str) -> None:
    """Raise SceneError where a clip has too many frames, for as many nodes, or too close ones.

    step  s between keys
    """
    if not FRAME_TIMES[0] <= step <= FRAME_TIMES[1]:
        raise SceneError(
            f"{where} has a key every {step:.3g} s, and {FRAME_TIMES[0]:g} to {FRAME_TIMES[1]:g} s "
            "can be. Sample it anew before exporting."
        )
    if frames * nodes > MOST_POSES:
        raise SceneError(
            f"{where} asks for {frames:,.0f} frames of {nodes} nodes, and {MOST_POSES:,} poses "
            "are the most. Export a shorter clip, or one with fewer keys."
        )
