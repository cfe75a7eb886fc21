"""A BVH file as a clip."""

from __future__ import annotations

from pathlib import Path

from flowborne.motion.bvh import check_rigid, clip_of
from flowborne.motion.bvh_file import load_bvh
from flowborne.motion.clip import Clip


def read_bvh(path: str | Path, unit: float = 1.0, up: str = "y", skip: int = 0) -> Clip:
    """Its motion; raises SceneError when a bone changes its length by more than 1 mm."""
    bvh = load_bvh(Path(path))
    clip = clip_of(bvh, unit, up, skip)
    check_rigid(bvh, clip, clip.names)
    return clip
