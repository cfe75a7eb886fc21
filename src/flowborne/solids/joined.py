"""Contact between a creature's fixed base and the bodies that a joint holds on it.

MuJoCo leaves out contact between a body and the one that it hangs on, but not where the latter is
fixed to the world: a base that floats in its own simulator, and is fixed here, would push away the
hips that it overlaps.
"""

from __future__ import annotations

import mujoco
import numpy as np

from flowborne.solids.geoms import element_name, floors

LEFT_OUT = "overlap at rest: "
"""What stands before the names of two bodies in the name of their <exclude>."""

TURNING = (mujoco.mjtJoint.mjJNT_HINGE, mujoco.mjtJoint.mjJNT_BALL)


def exclude_joined(spec: mujoco.MjSpec, mj: mujoco.MjModel) -> bool:
    """Leave out contact between fixed bodies and those that hinges and ball joints hold on them,
    where they overlap at rest; whether any was left out. Bodies with a floor are as they are."""
    data = mujoco.MjData(mj)
    mujoco.mj_kinematics(mj, data)
    mujoco.mj_comPos(mj, data)
    mujoco.mj_collision(mj, data)
    with_floor = mj.geom_bodyid[floors(mj)]
    overlapping = mj.geom_bodyid[data.contact.geom[data.contact.dist < 0.0]]
    pairs = {(base, other) for ends in overlapping.tolist() for base, other in (ends, ends[::-1])}
    bodies = {body.id: body for body in spec.bodies}
    excluded = False
    for base, other in sorted(pairs):
        if mj.body_weldid[base] or base in with_floor or not _hangs_on_the_world(mj, other):
            continue
        names = [element_name(mj, mujoco.mjtObj.mjOBJ_BODY, body) for body in (base, other)]
        for body, name in zip((base, other), names, strict=True):
            bodies[body].name = name  # <exclude> knows bodies by their names alone
        spec.add_exclude(
            name=LEFT_OUT + " and ".join(names), bodyname1=names[0], bodyname2=names[1]
        )
        excluded = True
    return excluded


def _hangs_on_the_world(mj: mujoco.MjModel, body: int) -> bool:
    """Whether joints that turn, and no others, hold a body on what does not move."""
    top = mj.body_weldid[body]
    first, count = mj.body_jntadr[top], mj.body_jntnum[top]
    held = top > 0 and mj.body_weldid[mj.body_parentid[top]] == 0
    return bool(held and count and np.isin(mj.jnt_type[first : first + count], TURNING).all())


def joined_pairs(mj: mujoco.MjModel) -> list[str]:
    """Both names of the pairs whose contact was left out, joined by "and"."""
    names = [
        mujoco.mj_id2name(mj, mujoco.mjtObj.mjOBJ_EXCLUDE, number) for number in range(mj.nexclude)
    ]
    return [name.removeprefix(LEFT_OUT) for name in names if name and name.startswith(LEFT_OUT)]
