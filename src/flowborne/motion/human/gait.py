"""A synthetic walk as a clip of the human's joints."""

from __future__ import annotations

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.spatial.transform import Rotation

from flowborne.motion.clip import Clip
from flowborne.motion.human.skeleton import BODIES, PARENTS, SIDES, TIPS, Array, Skeleton

# fmt: off
ROWS = np.array(
    [
        (0, 12.19, 35.83, 5.55, -2.1),
        (2, 12.03, 35.69, 7.94, -3.87),
        (4, 11.84, 35.51, 10.92, -5.55),
        (6, 11.56, 35.11, 14.12, -5.59),
        (8, 11.23, 34.24, 16.86, -4.12),
        (10, 10.94, 32.85, 18.59, -2.11),
        (12, 10.76, 31.08, 19.29, -0.18),
        (14, 10.69, 29.07, 19.2, 1.49),
        (16, 10.72, 26.93, 18.57, 2.92),
        (18, 10.84, 24.73, 17.62, 4.15),
        (20, 11.02, 22.52, 16.47, 5.19),
        (22, 11.21, 20.29, 15.21, 6.07),
        (24, 11.39, 18.06, 13.9, 6.79),
        (26, 11.52, 15.83, 12.59, 7.43),
        (28, 11.62, 13.6, 11.32, 8.01),
        (30, 11.71, 11.41, 10.12, 8.57),
        (32, 11.82, 9.3, 9.03, 9.14),
        (34, 11.96, 7.27, 8.05, 9.69),
        (36, 12.12, 5.31, 7.22, 10.21),
        (38, 12.29, 3.43, 6.58, 10.7),
        (40, 12.41, 1.62, 6.24, 11.15),
        (42, 12.48, -0.11, 6.28, 11.54),
        (44, 12.46, -1.72, 6.8, 11.81),
        (46, 12.36, -3.15, 7.86, 11.84),
        (48, 12.21, -4.37, 9.47, 11.45),
        (50, 12.04, -5.28, 11.64, 10.4),
        (52, 11.88, -5.76, 14.48, 8.37),
        (54, 11.68, -5.68, 18.1, 4.95),
        (56, 11.4, -4.93, 22.59, -0.23),
        (58, 11.07, -3.36, 27.91, -6.92),
        (60, 10.78, -0.92, 33.88, -13.78),
        (62, 10.6, 2.32, 40.19, -18.55),
        (64, 10.54, 6.1, 46.35, -19.79),
        (66, 10.57, 10.11, 51.69, -18.0),
        (68, 10.69, 14.08, 55.7, -14.74),
        (70, 10.86, 17.87, 58.17, -11.19),
        (72, 11.05, 21.39, 59.13, -7.87),
        (74, 11.22, 24.59, 58.68, -4.89),
        (76, 11.35, 27.42, 56.91, -2.36),
        (78, 11.46, 29.89, 53.9, -0.34),
        (80, 11.57, 31.98, 49.78, 1.15),
        (82, 11.69, 33.71, 44.7, 2.1),
        (84, 11.84, 35.06, 38.83, 2.5),
        (86, 12.01, 36.02, 32.35, 2.37),
        (88, 12.19, 36.57, 25.52, 1.79),
        (90, 12.34, 36.72, 18.71, 0.97),
        (92, 12.41, 36.53, 12.49, 0.12),
        (94, 12.4, 36.16, 7.57, -0.59),
        (96, 12.29, 35.79, 4.64, -1.08),
        (98, 12.13, 35.56, 4.03, -1.45),
        (100, 11.95, 35.45, 5.37, -2.32),
    ]
)
# fmt: on
"""(51, 5): percent of the cycle from heel strike; degrees of forward tilt of the pelvis, flexion of
hip and knee and dorsiflexion of the ankle. Means of Schwartz, Rozumalski and Trost 2008,
J. Biomechanics 41:1639, free speed.
"""

PELVIS, HIP, KNEE, ANKLE = 1, 2, 3, 4

CYCLE = 1.05
"""s from one heel strike to the next of the same foot."""

RATE = 120.0
"""Frames a second, about: a cycle is a whole number of frames."""

NAMES = tuple(joint for _, joint, _ in BODIES)

LEG = ("hip", "knee", "ankle", "toes")

PHASE_LAG = {"left": 0.5, "right": 0.0}
"""Of a cycle, how much later a side does the same."""

SHOULDER, SHOULDER_SWING, ELBOW, ELBOW_SWING = np.radians([-8.0, 16.0, 32.5, 12.5])
"""Mean and amplitude of flexion: from 24 degrees back, where the heel of the same side strikes, to
8 forward, and an elbow bent by 20 to 45 (Perry 1992, Gait Analysis, chapter 8)."""

FLAT_TOE_TILT = np.radians(4.0)
"""Tilts of the foot around level over which the toes begin to bend."""

TOE_EXTENSION = np.radians(25.0)
"""Extension of the toes in swing and at heel strike (Perry 1992, chapter 4)."""

SUPPORT_HEIGHT = 0.003
"""m: what is so much higher than the lowest point of the soles carries 1 / e of what that does."""

SAMPLES = 1024
"""Instants of a cycle at which the support is found, for its integral."""


def curve(column: int) -> CubicSpline:
    """Periodic spline through a column: phase, 0 to 1 from heel strike -> rad.

    The first and the last row are the same instant; their mean stands for both.
    """
    angles = np.radians(ROWS[:, column])
    angles[0] = angles[-1] = 0.5 * (angles[0] + angles[-1])
    return CubicSpline(0.01 * ROWS[:, 0], angles, bc_type="periodic")


def gait_clip(skeleton: Skeleton, cycle: float = CYCLE) -> Clip:
    """One cycle of a straight walk along x from the right heel's strike, at about 120 Hz.

    The last frame is the first frame one stride later, in all derivatives too: a loop without the
    last frame has no seam. Legs follow `ROWS`, the left half a cycle after the right. The trunk
    stays upright: the lower back compensates the tilt of the pelvis. Toes stay flat on the floor
    while the heel lifts. The root moves such that the soles touch the ground and do not slide;
    where the support passes from one point of the soles to another, their heights and speeds are
    mixed over `SUPPORT_HEIGHT`, so that the root moves smoothly.

    skeleton  upright at rest, arms down, feet forward
    cycle     s
    raises    ValueError when the cycle does not last
    """
    if not (np.isfinite(cycle) and cycle > 0.0):
        raise ValueError(f"a walk cannot have a cycle of {cycle} s. Give a time above 0.")
    frames = max(round(cycle * RATE), 2)
    phase = np.arange(frames + 1) / frames
    turns = joint_turns(phase)
    return _clip(skeleton, cycle / frames, turns, root_path(skeleton, phase))


def pelvis_tilt(phase: Array) -> Array:
    """(n,) rad, forward; the mean over both sides, whose curves differ by 0.2 degrees."""
    tilt = curve(PELVIS)
    return np.asarray(0.5 * (tilt(phase % 1.0) + tilt((phase + 0.5) % 1.0)))


def leg_turns(phase: Array) -> Array:
    """(4, n) turns of hip, knee, ankle and toes at phases (n,) of the leg's own cycle, rad.

    They are relative to the parent, about the axis that points left: a positive turn carries what
    is below the joint backward.
    """
    phase = phase % 1.0
    hip, knee, ankle = (curve(column)(phase) for column in (HIP, KNEE, ANKLE))
    pitch = pelvis_tilt(phase) - hip + knee - ankle
    flat = 0.5 * (pitch + np.hypot(pitch, FLAT_TOE_TILT))
    swing = _rise(phase, 0.54, 0.74) + 1.0 - _rise(phase, 0.02, 0.1)
    return np.array([-hip, knee, -ankle, -(flat + (TOE_EXTENSION - flat) * swing)])


def _rise(phase: Array, start: float, end: float) -> Array:
    """(n,) from 0 at one phase to 1 at another, with two continuous derivatives."""
    x = np.clip((phase - start) / (end - start), 0.0, 1.0)
    return x**3 * (10.0 - 15.0 * x + 6.0 * x**2)


def joint_turns(phase: Array) -> dict[str, Array]:
    """Joint -> (n,) turn about the left-pointing axis, rad, of all 23 joints."""
    tilt = pelvis_tilt(phase)
    turns = {joint: np.zeros(len(phase)) for joint in NAMES}
    turns["root"], turns["lower_back"] = tilt, -tilt
    for side in SIDES:
        own = phase - PHASE_LAG[side]
        turns |= {f"{side}_{name}": turn for name, turn in zip(LEG, leg_turns(own), strict=True)}
        swing = np.cos(2.0 * np.pi * own)
        turns[f"{side}_shoulder"] = -(SHOULDER - SHOULDER_SWING * swing)
        turns[f"{side}_elbow"] = -(ELBOW - ELBOW_SWING * swing)
    return turns


def root_path(skeleton: Skeleton, phase: Array) -> Array:
    """(n, 3) m, place of the root at phases (n,) from 0 on, by what carries it."""
    instants = np.arange(SAMPLES) / SAMPLES
    x, z = _soles(skeleton, instants)
    weight = np.exp(-(z - z.min(axis=1, keepdims=True)) / SUPPORT_HEIGHT)
    weight /= weight.sum(axis=1, keepdims=True)
    speed = -(weight * _rate(x)).sum(axis=1)
    height = -(weight * z).sum(axis=1)
    around = np.append(instants, 1.0)
    distance = CubicSpline(around, np.append(speed, speed[0]), bc_type="periodic").antiderivative()
    level = CubicSpline(around, np.append(height, height[0]), bc_type="periodic")
    ahead = distance(phase % 1.0) + np.floor(phase) * distance(1.0)
    return np.stack([ahead, np.zeros(len(phase)), level(phase % 1.0)], axis=1)


def _rate(values: Array) -> Array:
    """Derivative of a periodic function by phase, from equal samples along axis 0."""
    around = np.concatenate([values, values[:1]])
    spline = CubicSpline(np.arange(len(around)) / len(values), around, bc_type="periodic")
    return np.asarray(spline(np.arange(len(values)) / len(values), 1))


def _soles(skeleton: Skeleton, phase: Array) -> tuple[Array, Array]:
    """x and z (n, 8) of points of both soles, from the root, m.

    A foot has its heel and its ball, the toes their ball and their tip.
    """
    points = [_sole(skeleton, side, phase) for side in SIDES]
    x, z = np.moveaxis(np.concatenate(points, axis=1), (0, 1, 2), (0, 2, 1))
    return x, z


def _sole(skeleton: Skeleton, side: str, phase: Array) -> Array:
    """(2, 4, n) x and z of the points of one sole, from the root, m."""
    turns = leg_turns(phase - PHASE_LAG[side])
    angles = np.cumsum([pelvis_tilt(phase), *turns], axis=0)
    names = ("root", *(f"{side}_{name}" for name in LEG))
    places = [skeleton[name] for name in names]
    joints = np.cumsum(
        [
            _turned(end - start, angle)
            for start, end, angle in zip(places, places[1:], angles, strict=False)
        ],
        axis=0,
    )
    down, ankle, toes = skeleton.to_sole(side), places[3], places[4]
    points = [
        joints[2] + _turned(skeleton.heel(side) + down - ankle, angles[3]),
        joints[2] + _turned(toes + down - ankle, angles[3]),
        joints[3] + _turned(down, angles[4]),
        joints[3] + _turned(skeleton[f"{side}_toe_tip"] + down - toes, angles[4]),
    ]
    return np.stack(points, axis=1)


def _turned(offset: Array, angle: Array) -> Array:
    """(2, n) x and z of an offset (3,) turned about y by angles (n,)."""
    cosine, sine = np.cos(angle), np.sin(angle)
    return np.array([offset[0] * cosine + offset[2] * sine, offset[2] * cosine - offset[0] * sine])


def _clip(skeleton: Skeleton, frame_time: float, turns: dict[str, Array], place: Array) -> Clip:
    parents = [NAMES.index(PARENTS[joint]) if joint in PARENTS else -1 for joint in NAMES]
    offsets = [
        skeleton[joint] - skeleton[PARENTS[joint]] if joint in PARENTS else np.zeros(3)
        for joint in NAMES
    ]
    axis = np.array([0.0, 1.0, 0.0])
    turned = [Rotation.from_rotvec(turns[joint][:, None] * axis) for joint in NAMES]
    return Clip(
        names=NAMES,
        parents=np.array(parents, dtype=np.int64),
        offsets=np.array(offsets),
        ends={joint: skeleton[tip] - skeleton[joint] for tip, joint in TIPS.items()},
        frame_time=frame_time,
        rotations=np.stack([turn.as_quat(scalar_first=True) for turn in turned], axis=1),
        translation=place,
    )
