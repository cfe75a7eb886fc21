"""Actuators of an MJCF model by what they are: servos of a hinge or slide, which drive it as other
motions do, and all others, whose force MuJoCo computes (`motors`)."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

import mujoco

from flowborne.solids.model import HINGE, SLIDE, SolidModel

Dyn = mujoco.mjtDyn


@dataclass(frozen=True)
class ActuatorServo:
    """What a position or velocity actuator does to its joint, for a control u.

    number     in the model
    joint      that it drives
    kind       "position": it drives the joint towards gain u, as a spring; "velocity": it drives
               it at gain u, as a damper
    gain       rad or m, rad/s or m/s for each unit of u
    offset     what it does at u = 0, likewise
    limit      largest torque or force to either side, N m or N
    even       whether it has no more to one side
    frequency  rad/s, sqrt(kp / M) of a position servo with the joint's inertia M at rest
    """

    number: int
    joint: str
    kind: Literal["position", "velocity"]
    gain: float
    offset: float
    limit: float
    even: bool
    frequency: float

    def wanted(self, u: float) -> float:
        """What it does for a control."""
        return self.offset + self.gain * u


def actuator_servos(model: SolidModel) -> Iterator[ActuatorServo]:
    """Those of the model with the force gear (g u + b0 + b1 l + b2 v) on a hinge or slide, with l
    and v gear times its position and velocity (MuJoCo's affine bias), b1 < 0 or b2 < 0, and forces
    to both sides."""
    mj, plain, Bias = model.mj, mujoco.mjtGain.mjGAIN_FIXED, mujoco.mjtBias
    for a in range(mj.nactuator):
        on_joint = mj.actuator_trntype[a] == mujoco.mjtTrn.mjTRN_JOINT
        number, gear = int(mj.actuator_trnid[a, 0]), float(mj.actuator_gear[a, 0])
        bias = mj.actuator_biastype[a]
        known = bias == Bias.mjBIAS_NONE or bias == Bias.mjBIAS_AFFINE
        known &= mj.actuator_gaintype[a] == plain
        known &= mj.actuator_dyntype[a] == Dyn.mjDYN_NONE and gear != 0.0
        if not (on_joint and known and mj.jnt_type[number] in (HINGE, SLIDE)):
            continue
        g, (b0, b1, b2) = float(mj.actuator_gainprm[a, 0]), mj.actuator_biasprm[a, :3].tolist()
        kind: Literal["position", "velocity"] = "velocity"
        unit, frequency = -b2 * gear, 0.0
        if b1 < 0.0:
            kind, unit = "position", -b1 * gear
            frequency = math.sqrt(-b1 * gear * gear / mj.dof_M0[mj.jnt_dofadr[number]])
        elif b2 >= 0.0:
            continue
        low, high = -math.inf, math.inf
        if mj.actuator_forcelimited[a]:
            low, high = sorted((gear * mj.actuator_forcerange[a]).tolist())
        if mj.jnt_actfrclimited[number]:
            least, most = mj.jnt_actfrcrange[number].tolist()
            low, high = max(low, least), min(high, most)
        if low < 0.0 < high:
            force = min(-low, high), -low == high
            joint = model.joint_names[number]
            yield ActuatorServo(a, joint, kind, g / unit, b0 / unit, *force, frequency)


def unusable_actuator(model: SolidModel, number: int) -> str | None:
    """Why an actuator cannot act, a sentence; None where it can."""
    mj, name = model.mj, model.actuator_names[number]
    own = mj.actuator_plugin[number] >= 0 or mj.actuator_dyntype[number] == Dyn.mjDYN_USER
    own |= mj.actuator_gaintype[number] == mujoco.mjtGain.mjGAIN_USER
    own |= mj.actuator_biastype[number] == mujoco.mjtBias.mjBIAS_USER
    if own:
        return (
            f"actuator '{name}' is computed by a plugin or callback, which is not called. "
            "Give it a type of MuJoCo's own, or tell joints."
        )
    if mj.actuator_delay[number] > 0.0:
        return f"actuator '{name}' has a delay, which is not simulated. Remove it from the model."
    return None
