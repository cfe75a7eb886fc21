"""The joints of the human at rest, and the tree of its bodies."""

from __future__ import annotations

from collections.abc import Container, Mapping
from dataclasses import dataclass, field
from types import MappingProxyType

import numpy as np

from flowborne.kernels.arrays import Array

SIDES = ("left", "right")

Names = tuple[str, str, str]

STATURE = 1.741
"""m, mean of de Leva's men."""

HEAD, UPPER_TRUNK, MIDDLE_TRUNK, LOWER_TRUNK = 0.2429, 0.2421, 0.2155, 0.1457

THIGH, SHANK, FOOT = 0.4222, 0.4340, 0.2581

UPPER_ARM, FOREARM, HAND = 0.2817, 0.2689, 0.1879
"""m at that stature (de Leva 1996, Table 4, men): vertex to C7; parts of the trunk, which end at
xiphoid, navel and mid hip; limbs between joint centres; heel to toe tip; wrist to fingertip."""

HIP, SHOULDER = 0.085, 0.202
"""m from the mid-plane, at that stature: hip joints 17 cm apart; outer sides of the upper arms as
far apart as the deltoids, 49.2 cm for men of 1.756 m (Gordon et al. 1989)."""

BALL = 0.73
"""Distance from heel to toe joint, per length of the foot (Gordon et al. 1989)."""

VERTEX, NAPE = 0.01, -0.045
"""Forward position relative to mid hip, m, of vertex and C7: de Leva's head and trunk are straight
lines between them."""


def _leg(side: str) -> tuple[Names, ...]:
    return (
        (f"{side}_thigh", f"{side}_hip", "root"),
        (f"{side}_shank", f"{side}_knee", f"{side}_hip"),
        (f"{side}_foot", f"{side}_ankle", f"{side}_knee"),
        (f"{side}_toes", f"{side}_toes", f"{side}_ankle"),
    )


def _arm(side: str) -> tuple[Names, ...]:
    return (
        (f"{side}_clavicle", f"{side}_clavicle", "thorax"),
        (f"{side}_upper_arm", f"{side}_shoulder", f"{side}_clavicle"),
        (f"{side}_forearm", f"{side}_elbow", f"{side}_shoulder"),
        (f"{side}_hand", f"{side}_wrist", f"{side}_elbow"),
    )


BODIES: tuple[Names, ...] = (
    ("pelvis", "root", ""),
    *_leg("left"),
    *_leg("right"),
    ("lower_back", "lower_back", "root"),
    ("upper_back", "upper_back", "lower_back"),
    ("thorax", "thorax", "upper_back"),
    ("lower_neck", "lower_neck", "thorax"),
    ("upper_neck", "upper_neck", "lower_neck"),
    ("head", "head", "upper_neck"),
    *_arm("left"),
    *_arm("right"),
)
"""(body, its joint, its parent's joint) of the 23 bodies, parents first."""

TIPS: Mapping[str, str] = MappingProxyType(
    {"head_top": "head"}
    | {f"{side}_fingertip": f"{side}_wrist" for side in SIDES}
    | {f"{side}_toe_tip": f"{side}_toes" for side in SIDES}
)
"""End point of a last bone -> its joint."""

PARENTS: Mapping[str, str] = MappingProxyType(
    {joint: parent for _, joint, parent in BODIES[1:]} | dict(TIPS)
)
"""Joint or tip -> its parent joint; without the root."""

JOINTS = tuple(joint for _, joint, _ in BODIES)
"""Joints, parents first."""

JOINT_OF: Mapping[str, str] = MappingProxyType({body: joint for body, joint, _ in BODIES})
"""Body -> its joint."""

_BRANCHES = ("root", "thorax")

_FAR_ENDS = {parent: name for name, parent in PARENTS.items() if parent not in _BRANCHES}

_FAR_ENDS["thorax"] = "lower_neck"
"""Joint -> the joint or tip at the end of its body."""

HEEL = 1.0 / 3.0
"""Distance of the heel behind the ankle, per length from ankle to toe tip: 1/4 of the foot."""

SOLE = 0.06
"""Distance from the bone of the toes to the sole (half their thickness), per length of the foot."""

KNUCKLES = 86.2 / 187.9
"""Distance from wrist to third knuckle, per length from wrist to fingertip (de Leva 1996, Table 4,
men)."""


@dataclass(frozen=True, eq=False)
class Link:
    """An additional joint of a clip between two joints of the human.

    name      of its joint and body in the model
    bone      the clip's joint
    position  (3,) m, at rest
    """

    name: str
    bone: str
    position: Array


@dataclass(frozen=True, eq=False)
class Skeleton:
    """Positions at rest, where all rotations are zero, m; z up, x forward, y left.

    joints  name -> (3,), all 23
    tips    name -> (3,): head_top, left_ and right_fingertip and _toe_tip
    links   joint -> the links from its parent to itself, in this order
    """

    joints: Mapping[str, Array]
    tips: Mapping[str, Array]
    links: Mapping[str, tuple[Link, ...]] = field(default_factory=dict)

    def __getitem__(self, name: str) -> Array:
        """(3,) position of a joint or tip."""
        return self.joints[name] if name in self.joints else self.tips[name]

    @property
    def mid_hip(self) -> Array:
        """(3,) midpoint between the hips."""
        return 0.5 * (self.joints["left_hip"] + self.joints["right_hip"])

    def bone(self, body: str) -> tuple[Array, Array]:
        """Ends (3,) of a body's bone: its joint and the next one down; the pelvis starts at mid
        hip, a foot at the heel.
        """
        joint = JOINT_OF[body]
        if body == "pelvis":
            return self.mid_hip, self.joints["lower_back"]
        start = self.heel(body.split("_")[0]) if body.endswith("_foot") else self.joints[joint]
        return start, self[_FAR_ENDS[joint]]

    def along_foot(self, side: str) -> Array:
        """(3,) unit vector from the toe joint to the toe tip; the toes are flat at rest."""
        along = self.tips[f"{side}_toe_tip"] - self.joints[f"{side}_toes"]
        return np.asarray(along / np.linalg.norm(along))

    def heel(self, side: str) -> Array:
        """(3,) point on the line of the toes, a quarter of the foot behind the ankle."""
        along, tip = self.along_foot(side), self.tips[f"{side}_toe_tip"]
        before = float((tip - self.joints[f"{side}_ankle"]) @ along)
        return np.asarray(tip - (1.0 + HEEL) * before * along)

    def to_sole(self, side: str) -> Array:
        """(3,) m, vector from the line of heel and toes straight down to the sole."""
        along = self.along_foot(side)
        up = np.array([0.0, 0.0, 1.0]) - along[2] * along
        length = np.linalg.norm(self.tips[f"{side}_toe_tip"] - self.heel(side))
        return np.asarray(-SOLE * length * up / np.linalg.norm(up))

    def knuckle(self, side: str) -> Array:
        """(3,) third knuckle, on the line from wrist to fingertip."""
        wrist = self.joints[f"{side}_wrist"]
        return np.asarray(wrist + KNUCKLES * (self.tips[f"{side}_fingertip"] - wrist))


def ancestors(name: str) -> list[str]:
    """Joints above a joint or tip, the nearest first."""
    names = []
    while name in PARENTS:
        name = PARENTS[name]
        names.append(name)
    return names


def nearest_parent(name: str, among: Container[str]) -> str:
    """The nearest ancestor of a joint or tip in a collection that contains the root."""
    return next(joint for joint in ancestors(name) if joint in among)


def standard_skeleton(height: float = STATURE) -> Skeleton:
    """A skeleton that stands at the origin and faces +x with its arms hanging down.

    Lengths are de Leva's means for men times height / 1.741 m; the ankles are at the remaining
    height. C7 is behind the line from vertex to mid hip. Joints of the neck are C7, the atlas
    145 mm below the vertex (25 mm below the tragion, Gordon et al. 1989) and their midpoint.
    Collar bones start at the upper end of the breast bone, 71.4 mm below C7 along the trunk.

    height  m
    raises  ValueError when it is not a positive finite number
    """
    if not (np.isfinite(height) and height > 0.0):
        raise ValueError(f"a human cannot be {height} m tall. Give a height above 0.")
    points = {"head_top": (VERTEX, 0.0, STATURE), "head": (-0.005, 0.0, STATURE - 0.145)}
    nape = STATURE - np.sqrt(HEAD**2 - (VERTEX - NAPE) ** 2)
    trunk = UPPER_TRUNK + MIDDLE_TRUNK + LOWER_TRUNK
    drop = np.sqrt(trunk**2 - NAPE**2)

    def spine(below: float) -> tuple[float, float, float]:
        share = below / trunk
        return (NAPE * (1.0 - share), 0.0, float(nape - share * drop))

    points["root"] = spine(trunk)
    points["lower_back"] = spine(UPPER_TRUNK + MIDDLE_TRUNK)
    points["upper_back"] = spine(UPPER_TRUNK + 0.5 * MIDDLE_TRUNK)
    points["thorax"] = spine(UPPER_TRUNK)
    points["lower_neck"] = spine(0.0)
    points["upper_neck"] = tuple(0.5 * np.add(points["lower_neck"], points["head"]))
    for side, sign in zip(SIDES, (1.0, -1.0), strict=True):
        points |= {f"{side}_{k}": (x, sign * y, z) for k, (x, y, z) in _limbs(nape, drop).items()}
    scaled = {name: height / STATURE * np.array(point) for name, point in points.items()}
    return Skeleton({joint: scaled[joint] for joint in JOINTS}, {tip: scaled[tip] for tip in TIPS})


def _limbs(nape: float, drop: float) -> dict[str, tuple[float, float, float]]:
    """Joints and tips of the left limbs, from the height of C7 and the height of the trunk."""
    hip = nape - drop
    ankle = hip - THIGH - SHANK
    shoulder = nape - 0.105
    elbow = shoulder - UPPER_ARM
    wrist = elbow - FOREARM
    return {
        "hip": (0.0, HIP, hip),
        "knee": (0.0, HIP, hip - THIGH),
        "ankle": (0.0, HIP, ankle),
        "toes": ((BALL - 0.25) * FOOT, HIP, SOLE * FOOT),
        "toe_tip": (0.75 * FOOT, HIP, SOLE * FOOT),
        "clavicle": (0.03, 0.025, nape - 0.0714),
        "shoulder": (-0.02, SHOULDER, shoulder),
        "elbow": (-0.02, SHOULDER, elbow),
        "wrist": (-0.02, SHOULDER, wrist),
        "fingertip": (-0.02, SHOULDER, wrist - HAND),
    }
