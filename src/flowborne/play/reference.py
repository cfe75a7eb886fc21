"""The poses of the input motion: where all joints would be if none were controlled."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flowborne.coupling.world import Setup
from flowborne.kernels.arrays import Array
from flowborne.scenes.bodies import initial_state
from flowborne.scenes.capture import capture_of, clip_motion
from flowborne.scenes.schema import Scene
from flowborne.solids.dynamics import kinematics
from flowborne.solids.model import SolidModel
from flowborne.solids.trajectories import Trajectory


@dataclass(frozen=True, eq=False)
class InputMotion:
    """The motion that a scene is given: of the joints that follow one, and of the controlled ones
    in its clip. Others stay where they start.

    model    the bodies
    start    (nq,) pose at the start
    motions  of the joints that move
    """

    model: SolidModel
    start: Array
    motions: Sequence[Trajectory]

    @staticmethod
    def of(scene: Scene, setup: Setup) -> InputMotion | None:
        """The input motion of a scene; None if it has none."""
        model = setup.solid
        if not setup.motions or not scene.controlled_joints():
            return None
        start, motions = initial_state(scene, model).q, list(setup.motions)
        capture = capture_of(scene)
        if capture is not None:
            own = set(scene.controlled_joints()) & set(capture.mapping)
            joints = tuple(joint for joint in model.joint_names if joint in own)
            whole = clip_motion(scene, model, start, joints)
            motions += [] if whole is None else [whole]
        return InputMotion(model, start, motions)

    def poses(self, time: float) -> dict[str, NDArray[np.float32]]:
        """geom_position (ng, 3) m and geom_rotation (ng, 3, 3) at a time, s."""
        q = self.start.copy()
        for motion in self.motions:
            q[self.model.indices_of(motion.dofs)] = motion.position(time)
        found = kinematics(self.model, q)
        return {
            "geom_position": found.geom_position.astype(np.float32),
            "geom_rotation": found.geom_rotation.astype(np.float32),
        }
