"""A standing pose of a clip's person, and the clip relative to that pose.

The angles of a file are relative to a pose chosen by its author, in which bones may lie along any
axis. Relative to a standing pose, the clip has the same motion with comparable angles.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace

import numpy as np
from scipy.spatial.transform import Rotation

from flowborne.base.errors import SceneError
from flowborne.kernels.arrays import Array
from flowborne.motion.clip import Clip
from flowborne.motion.human.skeleton import SIDES, standard_skeleton
from flowborne.motion.quaternions import angle, inverse, product, rotated
from flowborne.shapes.shape import unit

BODY_LINES = {
    ("hip", "knee"): 1.0,
    ("knee", "ankle"): 1.0,
    ("ankle", "toes"): 0.25,
    ("root", "shoulder"): 0.5,
    ("lower_neck", "head"): 0.25,
}
ARM_LINES = {("shoulder", "elbow"): 1.0, ("elbow", "wrist"): 1.0}
"""End points of a line of the body and of an arm, on either side -> its weight in the deviation of
a pose from standing, the weighted sum of 1 - cosine of the angles."""

MAX_STANDING_DEVIATION = 0.5
"""Largest deviation of a standing pose: about 25 degrees for every line."""

MAX_POSES = 400
"""Largest number of evaluated frames of a clip, evenly spaced."""

ROTATION_ROUNDING = 1e-6
"""Rounding error of rotations in a file, rad."""

MAX_ZERO_ROTATION = np.radians(60.0)
"""Largest rotation, rad, of a joint of trunk or leg from zero to the standing pose, if the zeros of
the file are the pose of a person."""


def posture_of(clip: Clip, mapping: Mapping[str, str]) -> tuple[Array, Array]:
    """A standing pose of a clip's person, and the mean direction from ankles to shoulders.

    Trunk and legs get the pose of the clip closest to standing, or the zeros of the file if these
    are a standing pose. Each arm gets the pose in which it is closest to hanging down, which can be
    the zeros of the file only if the arm hangs there.

    mapping  joint of the human -> joint of the clip; hips, knees, ankles and shoulders among them
    returns  (n, 4) rotations of the clip's joints from its zeros to a pose in which the person
             stands upright and faces forward, and (3,) the mean over the clip of the unit vector
             from the middle of the ankles to the middle of the shoulders, in the clip's axes
    raises   SceneError when hips, shoulders and ankles are collinear
    """
    frames = np.unique(np.linspace(0, clip.frames - 1, MAX_POSES).astype(np.int64))
    number = {joint: clip.names.index(bone) for joint, bone in mapping.items()}
    positions, rotations = clip.poses(frames)
    own = body_axes(positions, number)
    if not np.allclose(np.linalg.det(own), 1.0):
        raise SceneError(
            "its hips, shoulders and ankles are on one line. Correct the mapping or the file."
        )
    up = own[:, :, 2].mean(axis=0)
    axes, cost = _deviations(positions, number, BODY_LINES, SIDES)
    best = int(cost.argmin())
    unturned = np.tile([1.0, 0.0, 0.0, 0.0], (1, len(clip.names), 1))
    zero_positions = clip.rest[None]
    zero_axes, zero_cost = _deviations(zero_positions, number, BODY_LINES, SIDES)
    zero_cost[~np.isclose(np.linalg.det(zero_axes), 1.0)] = np.inf  # collinear zeros
    not_body = ("root", "shoulder", "elbow", "wrist")
    body = [n for joint, n in number.items() if not joint.endswith(not_body)]
    if (
        zero_cost[0] < MAX_STANDING_DEVIATION
        and angle(clip.rotations[frames[best], body]).max() < MAX_ZERO_ROTATION
    ):
        rest = product(_inverse_of(zero_axes[0]), unturned[0])
        positions = np.concatenate([positions, zero_positions])
        rotations, axes = np.concatenate([rotations, unturned]), np.concatenate([axes, zero_axes])
    else:
        rest = product(_inverse_of(axes[best]), rotations[best])
    for side in SIDES:
        deviation = _deviations(positions, number, ARM_LINES, (side,))[1]
        if len(deviation) > len(frames) and deviation[-1] > MAX_STANDING_DEVIATION:
            deviation = deviation[:-1]
        hanging = int(deviation.argmin())
        shoulder = number[f"{side}_shoulder"]
        arm = [n for n, name in enumerate(clip.names) if shoulder in clip.lineage(name)]
        rest[arm] = product(_inverse_of(axes[hanging]), rotations[hanging, arm])
    return rest, up


def _inverse_of(axes: Array) -> Array:
    """(4,) inverse of a rotation (3, 3); the identity if it is within rounding errors of a file."""
    if np.abs(axes - np.eye(3)).max() < ROTATION_ROUNDING:
        return np.array([1.0, 0.0, 0.0, 0.0])
    return np.asarray(Rotation.from_matrix(axes.T).as_quat(scalar_first=True))


def relative_to_pose(clip: Clip, rest: Array) -> Clip:
    """The same motion with rotations relative to another pose.

    rest  (n, 4) rotations of the joints in that pose, relative to the zeros of the clip
    """
    parents = clip.parents.clip(0)
    above = np.where((clip.parents < 0)[:, None], [1.0, 0.0, 0.0, 0.0], rest[parents])
    number = {name: n for n, name in enumerate(clip.names)}
    return replace(
        clip,
        offsets=rotated(above, clip.offsets),
        ends={name: rotated(rest[number[name]], end) for name, end in clip.ends.items()},
        rotations=product(product(above, clip.rotations), inverse(rest)),
    )


def body_axes(positions: Array, number: Mapping[str, int]) -> Array:
    """(frames, 3, 3) columns: forward, left and up of a person, from positions (frames, n, 3).

    number  joint of the human -> its index among the n
    """
    ends = {joint: positions[:, n] for joint, n in number.items()}
    left = ends["left_hip"] - ends["right_hip"] + ends["left_shoulder"] - ends["right_shoulder"]
    up = ends["left_shoulder"] - ends["left_ankle"] + ends["right_shoulder"] - ends["right_ankle"]
    up = unit(up)
    left = unit(left - np.sum(left * up, axis=-1, keepdims=True) * up)
    return np.stack([np.cross(left, up), left, up], axis=-1)


def _deviations(
    positions: Array,
    number: Mapping[str, int],
    lines: Mapping[tuple[str, str], float],
    sides: Iterable[str],
) -> tuple[Array, Array]:
    """(frames, 3, 3) rotations from a standing person to these positions, and (frames,) weighted
    deviations of some lines from those of the rotated standing person."""
    standard = standard_skeleton()
    names = [*standard.joints]
    still = np.array([standard[name] for name in names])[None]
    own = body_axes(still, {name: n for n, name in enumerate(names)})[0]
    axes = body_axes(positions, number) @ own.T
    cost = np.zeros(len(positions))
    for joints, weight in lines.items():
        for side in sides:
            start, end = (j if j in number else f"{side}_{j}" for j in joints)
            if start in number and end in number:
                line = unit(positions[:, number[end]] - positions[:, number[start]])
                usual = unit(standard[end] - standard[start])
                cost += weight * (1.0 - np.einsum("fi,fij,j->f", line, axes, usual))
    return axes, cost
