"""Actuators of an MJCF model: motors, position and velocity servos on hinges and slides."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

import mujoco
import numpy as np

from flowborne.solids.model import HINGE, SLIDE, SolidModel


@dataclass(frozen=True)
class Actuator:
    """What an actuator does to its joint, for a control u.

    name         in the model
    joint        that it drives
    kind         "motor": it pushes with gain u; "position": it drives the joint towards gain u, as
                 a spring; "velocity": it drives it at gain u, as a damper
    gain         N m or N, rad or m, rad/s or m/s for each unit of u
    offset       what it does at u = 0, likewise
    least, most  of u
    limit        largest torque or force, N m or N
    frequency    rad/s, sqrt(kp / M) of a position servo with the joint's inertia M at rest
    """

    name: str
    joint: str
    kind: Literal["motor", "position", "velocity"]
    gain: float
    offset: float
    least: float
    most: float
    limit: float
    frequency: float

    def wanted(self, u: float) -> float:
        """What it does for a control, which is held within its range."""
        return self.offset + self.gain * min(max(u, self.least), self.most)


def actuators(model: SolidModel) -> Iterator[Actuator]:
    """Those of the model that are understood: the force gear (g u + b0 + b1 l + b2 v) on a joint,
    with l and v gear times its position and velocity (MuJoCo's affine bias)."""
    mj, plain, Bias = model.mj, mujoco.mjtGain.mjGAIN_FIXED, mujoco.mjtBias
    for a in range(mj.nu):
        on_joint = mj.actuator_trntype[a] == mujoco.mjtTrn.mjTRN_JOINT
        number, gear = int(mj.actuator_trnid[a, 0]), float(mj.actuator_gear[a, 0])
        bias = mj.actuator_biastype[a]
        known = bias == Bias.mjBIAS_NONE or bias == Bias.mjBIAS_AFFINE
        known &= mj.actuator_gaintype[a] == plain
        known &= mj.actuator_dyntype[a] == mujoco.mjtDyn.mjDYN_NONE and gear != 0.0
        if not (on_joint and known and mj.jnt_type[number] in (HINGE, SLIDE)):
            continue
        g, (b0, b1, b2) = float(mj.actuator_gainprm[a, 0]), mj.actuator_biasprm[a, :3].tolist()
        kind: Literal["motor", "position", "velocity"] = "motor"
        unit, frequency = 1.0 / gear, 0.0
        if b1 < 0.0:
            kind, unit = "position", -b1 * gear
            frequency = math.sqrt(-b1 * gear * gear / mj.dof_M0[mj.jnt_dofadr[number]])
        elif b2 < 0.0:
            kind, unit = "velocity", -b2 * gear
        limit = math.inf
        if mj.actuator_forcelimited[a]:
            limit = abs(gear) * float(np.abs(mj.actuator_forcerange[a]).min())
        least, most = -math.inf, math.inf
        if mj.actuator_ctrllimited[a]:
            least, most = mj.actuator_ctrlrange[a].tolist()
        name, joint = mj.actuator(a).name, model.joint_names[number]
        yield Actuator(name, joint, kind, g / unit, b0 / unit, least, most, limit, frequency)
