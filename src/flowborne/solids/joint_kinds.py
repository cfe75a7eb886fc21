"""Kinds of joints, and the unit in which people give their positions."""

from __future__ import annotations

import math

from flowborne.solids.model import BALL, FREE, HINGE, SLIDE, SolidModel

JOINT_KINDS = {HINGE: "hinge", SLIDE: "slide", BALL: "ball joint", FREE: "free joint"}


def joint_kind(model: SolidModel, joint: str) -> int:
    """MuJoCo's number of the joint's kind."""
    return int(model.mj.jnt_type[model.joint(joint)])


def joint_unit(model: SolidModel, joint: str) -> float:
    """SI value of one unit in a scene: pi / 180 rad of a degree, or 1 m for a slide."""
    return 1.0 if joint_kind(model, joint) == SLIDE else math.pi / 180.0
