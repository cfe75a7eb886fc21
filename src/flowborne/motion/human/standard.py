"""A skeleton of published proportions."""

from __future__ import annotations

import numpy as np

from flowborne.motion.human.skeleton import BODIES, SIDES, SOLE, TIPS, Skeleton

STATURE = 1.741
"""m, mean of de Leva's men."""

HEAD, UPPER_TRUNK, MIDDLE_TRUNK, LOWER_TRUNK = 0.2429, 0.2421, 0.2155, 0.1457
THIGH, SHANK, FOOT = 0.4222, 0.4340, 0.2581
UPPER_ARM, FOREARM, HAND = 0.2817, 0.2689, 0.1879
"""m at that stature (de Leva 1996, Table 4, men): vertex to C7, the trunk's parts from there at
xiphoid, navel and mid hip, joint centres of the limbs, heel to toe tip, wrist to fingertip."""

HIP, SHOULDER = 0.085, 0.202
"""m from the middle, at that stature: 17 cm between the hip joints; outer sides of the upper arms
as far apart as the deltoids, 49.2 cm in men 1.756 m tall (Gordon et al. 1989)."""

BALL = 0.73
"""Of the foot's length, heel to the joint of the toes (Gordon et al. 1989)."""

VERTEX, NAPE = 0.01, -0.045
"""m before mid hip, of vertex and C7: de Leva's head and trunk are straight lines between them."""


def standard_skeleton(height: float = STATURE) -> Skeleton:
    """Skeleton standing at the origin, facing +x, its arms hanging down.

    Lengths are de Leva's means for men times height / 1.741 m; the ankles stand at what height is
    left below them. C7 is behind the line from vertex to mid hip. The neck's joints: C7, the atlas
    145 mm below the vertex (25 mm below the tragion, Gordon et al. 1989), and half way. The
    collar bones start at the upper end of the breast bone, 71.4 mm below C7 along the trunk.

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
    scaled = {name: height / STATURE * np.array(place) for name, place in points.items()}
    return Skeleton({j: scaled[j] for _, j, _ in BODIES}, {tip: scaled[tip] for tip in TIPS})


def _limbs(nape: float, drop: float) -> dict[str, tuple[float, float, float]]:
    """Joints and tips of the left limbs, below a nape at that height and a trunk that drops so."""
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
