"""The floor of a clip, from the soles of standing feet."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from itertools import product

import numpy as np

from flowborne.kernels.arrays import Array, Mask
from flowborne.motion.clip import Clip
from flowborne.motion.human.segments import Sex, inertias
from flowborne.motion.human.shapes import Shape, shapes
from flowborne.motion.human.skeleton import JOINT_OF, SIDES, Skeleton, nearest_parent
from flowborne.motion.quaternions import rotated

STANDING_SPEED = 0.3
"""Largest speed of the lowest point of a standing foot, m/s. In a walk a foot swings at 1 m/s or
more, and rolls off at less than 0.1 m/s."""

SPEED_INTERVAL = 1.0 / 30.0
"""Interval over which that speed is measured, s: it suppresses the noise of a capture."""

SMOOTHING_TIME = 0.25
"""Standard deviation of the weights that smooth the floor from step to step, s."""

MAX_FLOOR_RANGE = 0.15
"""Largest height difference of a level floor, m. Floors of captures have errors of 5 to 10 cm;
larger differences are real slopes or steps, and are kept."""


def with_soles_on_floor(
    clip: Clip, mapping: Mapping[str, str], skeleton: Skeleton, mass: float, sex: Sex
) -> Clip:
    """The clip, raised or lowered so that standing soles are at z = 0.

    The floor of a capture is neither at 0 nor level. It is determined under every step, and changes
    smoothly from one step to the next. Only the height of the root changes; a clip without a
    standing foot is returned unchanged.

    mapping  joint of the model -> joint of the clip
    mass     kg, of the person; it determines the width of the feet
    """
    masses = {body: inertia.mass for body, inertia in inertias(skeleton, mass, sex).items()}
    geometries = shapes(skeleton, masses)
    points = [_lowest(clip, mapping, skeleton, side, geometries) for side in SIDES]
    stands = np.concatenate([_stands(point, clip.frame_time) for point in points])
    if not stands.any():
        return clip
    heights = np.concatenate([point[:, 2] for point in points])[stands]
    times = np.asarray(clip.frame_time * np.arange(clip.frames), np.float64)
    floor = np.full(clip.frames, float(np.median(heights)))
    low, high = np.percentile(heights, (2.0, 98.0))
    if high - low <= MAX_FLOOR_RANGE:
        floor = _smooth(times, np.concatenate([times, times])[stands], heights)
    translation = clip.translation.copy()
    translation[:, 2] -= floor
    return replace(clip, translation=translation)


def _lowest(
    clip: Clip,
    mapping: Mapping[str, str],
    skeleton: Skeleton,
    side: str,
    geometries: Mapping[str, Shape],
) -> Array:
    """(frames, 3) m, the lowest corner of a foot and its toes."""
    positions, rotations = clip.poses()
    corners = []
    for body in (f"{side}_foot", f"{side}_toes"):
        joint, box = JOINT_OF[body], geometries[body]
        if joint not in mapping:
            joint = nearest_parent(joint, mapping)
        number = clip.names.index(mapping[joint])
        for signs in product((-1.0, 1.0), repeat=3):
            corner = box.centre + box.axes @ (np.array(signs) * box.size)
            arm = corner - skeleton.joints[joint]
            corners.append(positions[:, number] + rotated(rotations[:, number], arm))
    points = np.stack(corners, axis=1)
    return np.asarray(points[np.arange(clip.frames), points[..., 2].argmin(axis=1)])


def _stands(point: Array, frame_time: float) -> Mask:
    """(frames,) whether the lowest point (frames, 3) of a foot is at rest."""
    apart = max(1, round(0.5 * SPEED_INTERVAL / frame_time))
    if len(point) <= 2 * apart:
        return np.zeros(len(point), bool)
    speed = np.linalg.norm(point[2 * apart :] - point[: -2 * apart], axis=1)
    speed /= 2.0 * apart * frame_time
    return np.pad(speed, apart, mode="edge") < STANDING_SPEED


def _smooth(times: Array, standing: Array, heights: Array) -> Array:
    """(frames,) m, weighted mean of the heights at the times (s) at which a foot stands."""
    nearest = np.abs(times[:, None] - standing).min(axis=1, keepdims=True)
    excess = (times[:, None] - standing) ** 2 - nearest**2  # avoids underflow of all weights
    weights = np.exp(-0.5 * excess / SMOOTHING_TIME**2)
    return np.asarray(weights @ heights / weights.sum(axis=1))
