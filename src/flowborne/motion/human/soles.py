"""The floor of a clip: under the soles of standing feet."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from itertools import product

import numpy as np
from numpy.typing import NDArray

from flowborne.motion.clip import Clip
from flowborne.motion.human.segments import Sex, inertias
from flowborne.motion.human.shapes import shapes
from flowborne.motion.human.skeleton import PARENTS, SIDES, Array, Skeleton, joint_of
from flowborne.motion.quaternions import turned

STILL = 0.3
"""Largest speed of the lowest point of a standing foot, m/s. In a walk a foot swings at 1 m/s and
more, and rolls off at less than 0.1 m/s."""

TREMOR = 1.0 / 30.0
"""Interval for that speed, s, long enough to suppress the noise of a capture."""

STEP = 0.25
"""Standard deviation of the weights that smooth the floor between steps, s."""

UNEVEN = 0.15
"""Largest height difference of a level floor, m. Floors of captures are wrong by 5 to 10 cm; larger
differences belong to the ground itself and are kept."""


def on_the_floor(
    clip: Clip, mapping: Mapping[str, str], skeleton: Skeleton, mass: float, sex: Sex
) -> Clip:
    """The clip, raised or lowered so that standing soles are at z = 0.

    The floor of a capture is not at 0, and neither even nor level: it is determined under every
    step, and changes smoothly from one to the next. Only the height of the root changes; a clip
    without a standing foot is returned unchanged.

    mapping  joint of the model -> joint of the clip
    mass     kg, of the person: how broad the feet are
    """
    places = [_lowest(clip, mapping, skeleton, side, mass, sex) for side in SIDES]
    stands = np.concatenate([_stands(place, clip.frame_time) for place in places])
    if not stands.any():
        return clip
    heights = np.concatenate([place[:, 2] for place in places])[stands]
    times = np.asarray(clip.frame_time * np.arange(clip.frames), np.float64)
    floor = np.full(clip.frames, float(np.median(heights)))
    low, high = np.percentile(heights, (2.0, 98.0))
    if high - low <= UNEVEN:
        floor = _smooth(times, np.concatenate([times, times])[stands], heights)
    translation = clip.translation.copy()
    translation[:, 2] -= floor
    return replace(clip, translation=translation)


def _lowest(
    clip: Clip,
    mapping: Mapping[str, str],
    skeleton: Skeleton,
    side: str,
    mass: float,
    sex: Sex,
) -> Array:
    """(frames, 3) m, the lowest corner of a foot and its toes."""
    masses = {body: inertia.mass for body, inertia in inertias(skeleton, mass, sex).items()}
    forms = shapes(skeleton, masses)
    places, rotations = clip.places()
    corners = []
    for body in (f"{side}_foot", f"{side}_toes"):
        joint = joint_of(body)
        while joint not in mapping:
            joint = PARENTS[joint]
        number = clip.names.index(mapping[joint])
        form = forms[body]
        for signs in product((-1.0, 1.0), repeat=3):
            corner = form.centre + form.axes @ (np.array(signs) * form.size)
            arm = corner - skeleton.joints[joint]
            corners.append(places[:, number] + turned(rotations[:, number], arm))
    points = np.stack(corners, axis=1)
    return np.asarray(points[np.arange(clip.frames), points[..., 2].argmin(axis=1)])


def _stands(place: Array, frame_time: float) -> NDArray[np.bool_]:
    """(frames,) whether the lowest point (frames, 3) of a foot is at rest."""
    apart = max(1, round(0.5 * TREMOR / frame_time))
    if len(place) <= 2 * apart:
        return np.zeros(len(place), bool)
    speed = np.linalg.norm(place[2 * apart :] - place[: -2 * apart], axis=1)
    speed /= 2.0 * apart * frame_time
    return np.pad(speed, apart, mode="edge") < STILL


def _smooth(times: Array, standing: Array, heights: Array) -> Array:
    """(frames,) m, weighted mean of the heights at the times (s) at which a foot stands."""
    nearest = np.abs(times[:, None] - standing).min(axis=1, keepdims=True)
    off = (times[:, None] - standing) ** 2 - nearest**2
    weights = np.exp(-0.5 * off / STEP**2)
    return np.asarray(weights @ heights / weights.sum(axis=1))
