"""Joints without a drive, and joints that a scene holds."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flowborne.fluid.grid import Array
from flowborne.scenes.schema import Scene
from flowborne.solids.actuators import actuators
from flowborne.solids.model import BALL, HINGE, SLIDE, SolidModel
from flowborne.solids.trajectories import Servo, ServoExact, ServoPD, Trajectory, driven


@dataclass(frozen=True)
class TrajectoryHeld:
    """A joint that stays where it is.

    dofs   (k,)
    place  (m,) rad, m, or a unit quaternion
    """

    dofs: NDArray[np.int64]
    place: Array

    def position(self, time: float) -> Array:
        """(m,) as `place`."""
        return self.place

    def velocity(self, time: float) -> Array:
        """(k,) zeros."""
        return np.zeros(len(self.dofs))


def driven_dofs(
    scene: Scene, model: SolidModel, motions: Iterable[Trajectory]
) -> NDArray[np.bool_]:
    """(nv,) which dofs are moved by motions, the controller or the policy, or locked in a slab."""
    moved = model.locked.copy()
    for motion in motions:
        moved[motion.dofs] = True
    told = () if scene.policy is None else scene.policy.joints
    for joint in (*scene.controlled_joints(), *told):
        moved[model.dofs_of(joint)] = True
    return moved


def undriven(scene: Scene, model: SolidModel, motions: Iterable[Trajectory]) -> list[str]:
    """Joints between bodies without a drive and without stiffness.

    Joints on the world are left out, as creatures float or swing on them, and so are joints between
    bones of the same flesh, which stiffens them.
    """
    mj, moved, limp = model.mj, driven_dofs(scene, model, motions), []
    for j, name in enumerate(model.joint_names):
        body = int(mj.jnt_bodyid[j])
        if body >= model.nbody or mj.jnt_type[j] not in (HINGE, SLIDE, BALL):
            continue
        parent = int(mj.body_parentid[body])
        ends = {model.body_names[body], model.body_names[parent]}
        if (
            parent > 0
            and mj.jnt_stiffness[j] == 0.0
            and not moved[model.dofs_of(name)].all()
            and not any(ends <= set(flesh.bones) for flesh in scene.flesh)
        ):
            limp.append(name)
    return limp


def held(
    scene: Scene, model: SolidModel, motions: Iterable[Trajectory], start: Array
) -> Iterator[Trajectory]:
    """Motions of the joints that [solids] hold keeps at `start` (nq,).

    A joint's position actuator becomes its servo; without one the servo is exact.
    """
    hold = () if scene.solids is None else scene.solids.hold
    if isinstance(hold, bool):
        hold = tuple(undriven(scene, model, motions)) if hold else ()
    servos: dict[str, Servo] = {
        a.joint: ServoPD(a.frequency, a.limit or math.inf)
        for a in actuators(model)
        if a.kind == "position"
    }
    for joint in hold:
        servo = servos.get(joint, ServoExact())
        place = start[model.positions_of(joint)]
        yield driven(TrajectoryHeld(model.dofs_of(joint), place), servo)
