"""The pose of a clip in which its person stands, and the clip relative to that pose.

The angles of a file are relative to a pose chosen by its author, in which the bones may lie along
any axis. A clip relative to a standing person instead has the same motion.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial.transform import Rotation

from flowborne.errors import SceneError
from flowborne.motion.clip import Clip
from flowborne.motion.human.skeleton import SIDES, Array, standard_skeleton
from flowborne.motion.quaternions import angle, inverse, product, turned
from flowborne.shapes.shape import unit

BODY = {
    ("hip", "knee"): 1.0,
    ("knee", "ankle"): 1.0,
    ("ankle", "toes"): 0.25,
    ("root", "shoulder"): 0.5,
    ("lower_neck", "head"): 0.25,
}
ARM = {("shoulder", "elbow"): 1.0, ("elbow", "wrist"): 1.0}
"""Ends of a line of the body, on either side, and of an arm -> weight of its direction in the
deviation of a pose from standing, which sums 1 - cosine of the angles."""

PERSON = 0.5
"""Largest deviation of the pose of a standing person: about 25 degrees everywhere."""

POSES = 400
"""Most frames of a clip that are evaluated, evenly spaced."""

DIGITS = 1e-6
"""Rounding error of rotations in a file, rad."""

FAR = np.radians(60.0)
"""Largest rotation of a joint of trunk or leg from the zeros of a file to its standing pose, for
zeros that are the pose of a person."""


@dataclass(frozen=True, eq=False)
class Posture:
    """The posture of the person of a clip.

    rest  (n, 4) rotations of the clip's joints, from the pose of its zeros to a pose in which the
          person stands upright and faces forward
    up    (3,) mean over the clip of the unit vector from between the ankles to between the
          shoulders, in the clip's axes
    """

    rest: Array
    up: Array


def posture_of(clip: Clip, mapping: Mapping[str, str]) -> Posture:
    """A standing pose of a clip's person, and the mean direction.

    Trunk and legs take the pose of the clip closest to standing, or the zeros of the file if these
    are a standing person; each arm takes the pose in which it hangs most, without zeros that hold
    it out.

    mapping  joint of the human -> joint of the clip; hips, knees, ankles and shoulders among them
    raises   SceneError when hips, shoulders and ankles lie on a line
    """
    frames = np.unique(np.linspace(0, clip.frames - 1, POSES).astype(np.int64))
    number = {joint: clip.names.index(bone) for joint, bone in mapping.items()}
    places, rotations = clip.places(frames)
    own = axes_of_bodies(places, number)
    if not np.allclose(np.linalg.det(own), 1.0):
        raise SceneError(
            "its hips, shoulders and ankles lie on a line. Correct the mapping or the file."
        )
    up = own[:, :, 2].mean(axis=0)
    axes, cost = _judged(places, number, BODY, SIDES)
    best = int(cost.argmin())
    unturned = np.tile([1.0, 0.0, 0.0, 0.0], (1, len(clip.names), 1))
    zero = replace(clip, rotations=unturned, translation=np.zeros((1, 3)))
    zero_axes, zero_cost = _judged(zero.places()[0], number, BODY, SIDES)
    zero_cost[~np.isclose(np.linalg.det(zero_axes), 1.0)] = np.inf  # zeros on a line
    body = [n for joint, n in number.items() if joint != "root" and not _of_an_arm(joint)]
    if zero_cost[0] < PERSON and angle(clip.rotations[frames[best], body]).max() < FAR:
        rest = product(_back(zero_axes[0]), unturned[0])
        places = np.concatenate([places, zero.places()[0]])
        rotations, axes = np.concatenate([rotations, unturned]), np.concatenate([axes, zero_axes])
    else:
        rest = product(_back(axes[best]), rotations[best])
    for side in SIDES:
        far = _judged(places, number, ARM, (side,))[1]
        if len(far) > len(frames) and far[-1] > PERSON:
            far = far[:-1]
        hanging = int(far.argmin())
        arm = [n for n in range(len(clip.names)) if _is_below(clip, n, number[f"{side}_shoulder"])]
        rest[arm] = product(_back(axes[hanging]), rotations[hanging, arm])
    return Posture(rest, up)


def _of_an_arm(joint: str) -> bool:
    return joint.endswith(("_shoulder", "_elbow", "_wrist"))


def _is_below(clip: Clip, joint: int, above: int) -> bool:
    """Whether a joint is another one or hangs on it."""
    while joint > above:
        joint = int(clip.parents[joint])
    return joint == above


def _back(axes: Array) -> Array:
    """(4,) the inverse of a rotation (3, 3); the identity for rounding errors of a file."""
    if np.abs(axes - np.eye(3)).max() < DIGITS:
        return np.array([1.0, 0.0, 0.0, 0.0])
    return np.asarray(Rotation.from_matrix(axes.T).as_quat(scalar_first=True))


def counted_from(clip: Clip, rest: Array) -> Clip:
    """The clip with the same positions, its rotations relative to another pose.

    rest  (n, 4) rotations of the joints in that pose, relative to the zeros of the clip
    """
    parents = clip.parents.clip(0)
    above = np.where((clip.parents < 0)[:, None], [1.0, 0.0, 0.0, 0.0], rest[parents])
    number = {name: n for n, name in enumerate(clip.names)}
    return replace(
        clip,
        offsets=turned(above, clip.offsets),
        ends={name: turned(rest[number[name]], end) for name, end in clip.ends.items()},
        rotations=product(product(above, clip.rotations), inverse(rest)),
    )


def axes_of_bodies(places: Array, number: Mapping[str, int]) -> Array:
    """(frames, 3, 3) columns: forward, left and up of a person, from positions (frames, n, 3).

    number  joint of the human -> its index among the n
    """
    ends = {joint: places[:, n] for joint, n in number.items()}
    left = ends["left_hip"] - ends["right_hip"] + ends["left_shoulder"] - ends["right_shoulder"]
    up = ends["left_shoulder"] - ends["left_ankle"] + ends["right_shoulder"] - ends["right_ankle"]
    up = unit(up)
    left = unit(left - np.sum(left * up, axis=-1, keepdims=True) * up)
    return np.stack([np.cross(left, up), left, up], axis=-1)


def _judged(
    places: Array,
    number: Mapping[str, int],
    lines: Mapping[tuple[str, str], float],
    sides: Iterable[str],
) -> tuple[Array, Array]:
    """(frames, 3, 3) rotations from a standing person to these positions, and (frames,) deviations
    of some lines from those of the rotated standing person."""
    standard = standard_skeleton()
    names = [*standard.joints]
    still = np.array([standard[name] for name in names])[None]
    own = axes_of_bodies(still, {name: n for n, name in enumerate(names)})[0]
    axes = axes_of_bodies(places, number) @ own.T
    cost = np.zeros(len(places))
    for joints, weight in lines.items():
        for side in sides:
            start, end = (j if j in number else f"{side}_{j}" for j in joints)
            if start in number and end in number:
                line = unit(places[:, number[end]] - places[:, number[start]])
                usual = unit(standard[end] - standard[start])
                cost += weight * (1.0 - np.einsum("fi,fij,j->f", line, axes, usual))
    return axes, cost
