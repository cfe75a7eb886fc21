"""A synthetic walk as a clip of the human's joints."""

from __future__ import annotations

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.spatial.transform import Rotation

from flowborne.kernels.arrays import Array
from flowborne.motion.clip import Clip
from flowborne.motion.human.skeleton import JOINTS, PARENTS, SIDES, TIPS, Skeleton

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
"""(51, 5): percent of the cycle from heel strike; forward tilt of the pelvis, flexion of hip and
knee and dorsiflexion of the ankle in degrees. Means of Schwartz, Rozumalski and Trost 2008, J.
Biomechanics 41:1639, free speed.
"""

PELVIS, HIP, KNEE, ANKLE = 1, 2, 3, 4

CYCLE = 1.05
"""s from one heel strike to the next of the same foot."""

RATE = 120.0
"""Approximate frames per second: a cycle is a whole number of frames."""

LEG = ("hip", "knee", "ankle", "toes")

PHASE_LAG = {"left": 0.5, "right": 0.0}
"""Phase lag of a side, as part of a cycle."""

SHOULDER, SHOULDER_SWING, ELBOW, ELBOW_SWING = np.radians([-8.0, 16.0, 32.5, 12.5])
"""Mean and amplitude of flexion, rad: a shoulder goes from 24 degrees back at heel strike of its
side to 8 forward, an elbow from 20 to 45 (Perry 1992, Gait Analysis, chapter 8)."""

FLAT_TOE_TILT = np.radians(4.0)
"""Tilt of the foot, rad, over which the bending of the toes sets in smoothly."""

TOE_EXTENSION = np.radians(25.0)
"""Extension of the toes in swing and at heel strike, rad (Perry 1992, chapter 4)."""

SUPPORT_HEIGHT = 0.003
"""Height above the lowest point of the soles, m, at which the weight of support is 1 / e."""

SAMPLES = 1024
"""Number of times in a cycle at which the support is evaluated for its integral."""


def curve(column: int) -> CubicSpline:
    """Periodic spline through a column of ROWS: phase, 0 to 1 from heel strike -> rad.

    The first and the last row are the same phase; both are replaced by their mean.
    """
    angles = np.radians(ROWS[:, column])
    angles[0] = angles[-1] = 0.5 * (angles[0] + angles[-1])
    return CubicSpline(0.01 * ROWS[:, 0], angles, bc_type="periodic")


def gait_clip(skeleton: Skeleton, cycle: float = CYCLE) -> Clip:
    """One cycle of a straight walk along x from the strike of the right heel, at about 120 Hz.

    The last frame equals the first one stride later, including all derivatives: a loop without the
    last frame is smooth. Legs follow `ROWS`, the left one half a cycle after the right one. The
    trunk stays upright: the lower back compensates the tilt of the pelvis. Toes stay flat on the
    floor while the heel lifts. The root moves such that the soles touch the ground and do not
    slide. Heights and speeds of all points of the soles are averaged with weights that fall off
    over `SUPPORT_HEIGHT`, so that the root moves smoothly when the support changes.

    skeleton  upright at rest, arms down, feet forward
    cycle     s
    raises    ValueError when the cycle is not positive and finite
    """
    if not (np.isfinite(cycle) and cycle > 0.0):
        raise ValueError(f"a walk cannot have a cycle of {cycle} s. Give a time above 0.")
    frames = max(round(cycle * RATE), 2)
    phase = np.arange(frames + 1) / frames
    turns = joint_turns(phase)
    return _clip(skeleton, cycle / frames, turns, root_path(skeleton, phase))


def pelvis_tilt(phase: Array) -> Array:
    """(n,) rad, forward: the mean over both sides, which differ by 0.2 degrees."""
    tilt = curve(PELVIS)
    return np.asarray(0.5 * (tilt(phase % 1.0) + tilt((phase + 0.5) % 1.0)))


def leg_turns(phase: Array) -> Array:
    """(4, n) rotations of hip, knee, ankle and toes at phases (n,) of the leg's own cycle, rad.

    They are relative to the parent, about the axis that points left: a positive rotation moves the
    bodies below the joint backward.
    """
    phase = phase % 1.0
    hip, knee, ankle = (curve(column)(phase) for column in (HIP, KNEE, ANKLE))
    pitch = pelvis_tilt(phase) - hip + knee - ankle
    flat = 0.5 * (pitch + np.hypot(pitch, FLAT_TOE_TILT))
    swing = _rise(phase, 0.54, 0.74) + 1.0 - _rise(phase, 0.02, 0.1)
    return np.array([-hip, knee, -ankle, -(flat + (TOE_EXTENSION - flat) * swing)])


def _rise(phase: Array, start: float, end: float) -> Array:
    """(n,) smooth step from 0 at phase `start` to 1 at `end`, with two continuous derivatives."""
    x = np.clip((phase - start) / (end - start), 0.0, 1.0)
    return x**3 * (10.0 - 15.0 * x + 6.0 * x**2)


def joint_turns(phase: Array) -> dict[str, Array]:
    """Joint -> (n,) rotation about the left-pointing axis, rad, for all 23 joints."""
    tilt = pelvis_tilt(phase)
    turns = {joint: np.zeros(len(phase)) for joint in JOINTS}
    turns["root"], turns["lower_back"] = tilt, -tilt
    for side in SIDES:
        own = phase - PHASE_LAG[side]
        turns |= {f"{side}_{name}": turn for name, turn in zip(LEG, leg_turns(own), strict=True)}
        swing = np.cos(2.0 * np.pi * own)
        turns[f"{side}_shoulder"] = -(SHOULDER - SHOULDER_SWING * swing)
        turns[f"{side}_elbow"] = -(ELBOW - ELBOW_SWING * swing)
    return turns


def root_path(skeleton: Skeleton, phase: Array) -> Array:
    """(n, 3) m, position of the root at phases (n,) from 0, from the supporting points of the
    soles."""
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
    """x and z (n, 8) of points of both soles relative to the root, m: heel and ball of a foot, ball
    and tip of its toes."""
    points = [_sole(skeleton, side, phase) for side in SIDES]
    x, z = np.moveaxis(np.concatenate(points, axis=1), (0, 1, 2), (0, 2, 1))
    return x, z


def _sole(skeleton: Skeleton, side: str, phase: Array) -> Array:
    """(2, 4, n) x and z of the points of one sole relative to the root, m."""
    turns = leg_turns(phase - PHASE_LAG[side])
    angles = np.cumsum([pelvis_tilt(phase), *turns], axis=0)
    names = ("root", *(f"{side}_{name}" for name in LEG))
    points = [skeleton[name] for name in names]
    joints = np.cumsum(
        [
            _rotated(end - start, angle)
            for start, end, angle in zip(points, points[1:], angles, strict=False)
        ],
        axis=0,
    )
    down, ankle, toes = skeleton.to_sole(side), points[3], points[4]
    sole = [
        joints[2] + _rotated(skeleton.heel(side) + down - ankle, angles[3]),
        joints[2] + _rotated(toes + down - ankle, angles[3]),
        joints[3] + _rotated(down, angles[4]),
        joints[3] + _rotated(skeleton[f"{side}_toe_tip"] + down - toes, angles[4]),
    ]
    return np.stack(sole, axis=1)


def _rotated(offset: Array, angle: Array) -> Array:
    """(2, n) x and z of an offset (3,) rotated about y by angles (n,)."""
    cosine, sine = np.cos(angle), np.sin(angle)
    return np.array([offset[0] * cosine + offset[2] * sine, offset[2] * cosine - offset[0] * sine])


def _clip(skeleton: Skeleton, frame_time: float, turns: dict[str, Array], path: Array) -> Clip:
    bones = [(joint, PARENTS[joint]) for joint in JOINTS[1:]]
    axis = np.array([0.0, 1.0, 0.0])
    rotations = [Rotation.from_rotvec(turns[joint][:, None] * axis) for joint in JOINTS]
    return Clip(
        names=JOINTS,
        parents=np.array([-1, *(JOINTS.index(parent) for _, parent in bones)], dtype=np.int64),
        offsets=np.array([np.zeros(3), *(skeleton[end] - skeleton[start] for end, start in bones)]),
        ends={joint: skeleton[tip] - skeleton[joint] for tip, joint in TIPS.items()},
        frame_time=frame_time,
        rotations=np.stack([turn.as_quat(scalar_first=True) for turn in rotations], axis=1),
        translation=path,
    )
