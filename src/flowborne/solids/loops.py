"""Equalities of a model: the joints that they tie to others, and how far they are open."""

from __future__ import annotations

from collections.abc import Iterator

import mujoco
import numpy as np

from flowborne.solids.enclosed import tied_bodies
from flowborne.solids.geoms import element_name
from flowborne.solids.model import SolidModel


def active_equalities(mj: mujoco.MjModel) -> Iterator[tuple[int, str]]:
    """Number and name of each equality of a model that acts from the start."""
    if not mj.opt.disableflags & mujoco.mjtDisableBit.mjDSBL_EQUALITY:
        for number in np.flatnonzero(mj.eq_active0).tolist():
            yield number, element_name(mj, mujoco.mjtObj.mjOBJ_EQUALITY, number)


def tied_joints(model: SolidModel) -> dict[str, str]:
    """Joint -> what of the model ties it to other joints, as in "is ...".

    These are the joints of each loop that a <connect> or <weld> closes, those between one of its
    two bodies and the other, and the joints that follow another one by a <joint>.
    """
    mj, found = model.mj, {}
    for number, name in active_equalities(mj):
        first, second = int(mj.eq_obj1id[number]), int(mj.eq_obj2id[number])
        if mj.eq_type[number] == mujoco.mjtEq.mjEQ_JOINT and second >= 0:
            leader = model.joint_names[second]
            found[model.joint_names[first]] = f"tied to '{leader}' by the equality '{name}'"
        loop = set[int]()
        for body in tied_bodies(mj, number):
            loop ^= _above(mj, body)
        for joint in np.flatnonzero(np.isin(mj.jnt_bodyid, list(loop))).tolist():
            found[model.joint_names[joint]] = f"in the loop that the equality '{name}' closes"
    return found


def _above(mj: mujoco.MjModel, body: int) -> set[int]:
    """A body and its ancestors without the world."""
    found = set()
    while body > 0:
        found.add(body)
        body = int(mj.body_parentid[body])
    return found
