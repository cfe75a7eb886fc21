"""A small creature with turned bodies, and clips of its skeleton."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from flowborne.kernels.arrays import Array
from flowborne.motion.clip import Clip
from flowborne.motion.quaternions import about
from flowborne.solids.model import SolidModel

NAMES = ("Hips", "Hip", "Twist", "Knee", "Ankle", "Head")
PARENTS = np.array([-1, 0, 1, 2, 3, 0])
OFFSETS = np.array(
    [[0, 0, 0], [0, 0.1, -0.1], [0.03, 0, -0.4], [0, 0, 0], [0, 0.02, -0.4], [0.05, 0, 0.6]]
)
"""The clip's "Twist" turns where the knee is; the model has no body for it."""

MAPPING = {"root": "Hips", "hip": "Hip", "knee": "Knee", "ankle": "Ankle", "head": "Head"}
BODIES = {"root": "pelvis", "hip": "thigh", "knee": "shank", "ankle": "foot", "head": "head"}
REST = Rotation.random(6, random_state=5)
"""World rotations at rest of pelvis, thigh, shank, foot, waist and head."""

HINGE = np.array([0.0, 0.6, 0.8])
"""Axis of the ankle in the world at rest."""


def model() -> SolidModel:
    """Ball joints and a hinge at the ankle; a waist that no clip joint is mapped to."""
    pelvis, thigh, shank, foot, waist, head = REST
    waist_at, ankle = np.array([0.0, 0.01, 0.2]), foot.inv().apply(HINGE)
    return SolidModel.from_string(
        f"""<mujoco><worldbody>
        <body name="pelvis" {_at(None, pelvis, np.zeros(3))}><freejoint name="root"/>{GEOM}
          <body name="waist" {_at(pelvis, waist, waist_at)}><joint name="waist" type="ball"/>{GEOM}
            <body name="head" {_at(waist, head, OFFSETS[5] - waist_at)}>
              <joint name="head" type="ball"/>{GEOM}
            </body>
          </body>
          <body name="thigh" {_at(pelvis, thigh, OFFSETS[1])}>{HIP}{GEOM}
            <body name="shank" {_at(thigh, shank, OFFSETS[2])}>{KNEE}{GEOM}
              <body name="foot" {_at(shank, foot, OFFSETS[4])}>
                <joint name="ankle" type="hinge" axis="{_text(ankle)}" ref="11"/>{GEOM}
              </body>
            </body>
          </body>
        </body></worldbody></mujoco>"""
    )


GEOM = '<geom type="sphere" size="0.05"/>'
HIP, KNEE = (f'<joint name="{name}" type="ball"/>' for name in ("hip", "knee"))


def _at(parent: Rotation | None, here: Rotation, offset: Array) -> str:
    back = parent.inv() if parent is not None else Rotation.identity()
    quaternion = (back * here).as_quat(scalar_first=True)
    return f'pos="{_text(back.apply(offset))}" quat="{_text(quaternion)}"'


def _text(numbers: Array) -> str:
    return " ".join(f"{number:.17g}" for number in numbers)


def wandering(frames: int = 121, frame_time: float = 1.0 / 60.0, seed: int = 1) -> Clip:
    """Clip of smooth turns of all joints along a bent path; it does not end as it begins."""
    rng = np.random.default_rng(seed)
    time = frame_time * np.arange(frames)
    vectors = sum(
        rng.normal(0.0, 0.5, (6, 1, 3))
        * np.sin(rate * time[:, None] + rng.uniform(0, 6, (6, 1, 1)))
        for rate in (1.1, 3.0, 7.0)
    )
    rotations = Rotation.from_rotvec(vectors.reshape(-1, 3)).as_quat(scalar_first=True)
    rotations = rotations.reshape(6, frames, 4).swapaxes(0, 1)
    rotations[:, 4] = about(HINGE, 4.0 * np.sin(2.0 * time))
    turn = Rotation.from_rotvec(np.outer(0.4 * time, [0.0, 0.0, 1.0]))
    tilt = Rotation.from_quat(rotations[:, 0], scalar_first=True)
    rotations[:, 0] = (turn * tilt).as_quat(scalar_first=True)
    path = [1.3 * time, 0.2 * time**2, 0.9 + 0.05 * np.sin(5.0 * time)]
    translation = np.stack(path, axis=-1)
    rotations *= rng.choice([-1.0, 1.0], rotations.shape[:2])[..., None]  # the same rotations
    return Clip(NAMES, PARENTS, OFFSETS, {}, frame_time, rotations, translation)


def circling(frames: int = 61, turn: float = np.pi / 3.0) -> Clip:
    """One cycle of 1 s that ends as it begins, `turn` (rad) further on a circle of radius 2 m."""
    phase = np.linspace(0.0, 1.0, frames)
    wave = 2.0 * np.pi * phase[:, None] + np.arange(6)
    vectors = np.stack([0.5 * np.sin(wave), 0.3 * np.cos(wave), 0.2 * np.sin(2.0 * wave)], axis=-1)
    rotations = Rotation.from_rotvec(vectors.reshape(-1, 3)).as_quat(scalar_first=True)
    rotations = rotations.reshape(frames, 6, 4)
    rotations[:, 4] = about(HINGE, np.sin(wave[:, 4]))
    rotations[:, 5] = about(HINGE, wave[:, 5])  # once round: its quaternion ends with other signs
    heading = Rotation.from_rotvec(np.outer(turn * phase, [0.0, 0.0, 1.0]))
    tilt = Rotation.from_quat(rotations[:, 0], scalar_first=True)
    rotations[:, 0] = (heading * tilt).as_quat(scalar_first=True)
    angle = turn * phase
    height = 1.0 + 0.03 * np.sin(2.0 * wave[:, 0])
    translation = np.stack([2.0 * np.sin(angle), 2.0 - 2.0 * np.cos(angle), height], axis=-1)
    return Clip(NAMES, PARENTS, OFFSETS, {}, 1.0 / (frames - 1), rotations, translation)
