"""Kinds of joints, the unit in which people give their positions, and their position actuators."""

from __future__ import annotations

import math

import mujoco
import numpy as np

from flowborne.solids.model import BALL, FREE, HINGE, SLIDE, SolidModel

JOINT_KINDS = {HINGE: "hinge", SLIDE: "slide", BALL: "ball joint", FREE: "free joint"}


def joint_kind(model: SolidModel, joint: str) -> int:
    """MuJoCo's number of the joint's kind."""
    return int(model.mj.jnt_type[model.joint(joint)])


def joint_unit(model: SolidModel, joint: str) -> float:
    """SI value of one unit in a scene: pi / 180 rad of a degree, or 1 m for a slide."""
    return 1.0 if joint_kind(model, joint) == SLIDE else math.pi / 180.0


def position_actuator(model: SolidModel, joint: str) -> tuple[float, float] | None:
    """Natural frequency (rad/s) and largest force (N m or N) of the joint's position actuator.

    The frequency is sqrt(kp / M), where M is the joint's inertia at rest. None without such an
    actuator.
    """
    mj, number = model.mj, model.joint(joint)
    for actuator in np.flatnonzero(mj.actuator_trnid[:, 0] == number):
        if mj.actuator_trntype[actuator] != mujoco.mjtTrn.mjTRN_JOINT:
            continue
        gear, gain = mj.actuator_gear[actuator, 0], mj.actuator_gainprm[actuator, 0]
        stiffness = -gear * gear * mj.actuator_biasprm[actuator, 1]
        if stiffness <= 0.0 or gain <= 0.0:
            continue
        inertia = mj.dof_M0[model.dofs_of(joint)[0]]
        limit = np.inf
        if mj.actuator_forcelimited[actuator]:
            limit = abs(gear) * np.abs(mj.actuator_forcerange[actuator]).min()
        return math.sqrt(stiffness / inertia), float(limit) or np.inf
    return None
