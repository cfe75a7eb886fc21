"""The parts of a scene that its objectives, phases, rules and winds depend on."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from flowborne.base.errors import SceneError
from flowborne.base.phrases import suggestion
from flowborne.control.python_function import with_parameters
from flowborne.kernels.arrays import Integers
from flowborne.solids.model import SolidModel, joint_unit
from flowborne.solids.trajectories import Trajectory


@dataclass(frozen=True)
class Surroundings:
    """The parts of a scene that its objectives, phases, rules and winds depend on.

    model       the bodies
    source      of the model, for messages: "model swim.xml"
    controlled  joints that the controller moves
    driven      joints with a drive: controlled, or with a prescribed motion
    followed    joints whose [[motion]] phases may follow
    in_clip     joints that have a motion in the clip
    motion_of   joint in `followed` -> its motion
    clip_of     joint in `in_clip` -> its motion in the clip
    has_wind    whether there is a simple wind
    has_fluid   whether a fluid is simulated
    is_one_way  whether the bodies do not affect the fluid
    is_slab     whether the scene has 2 dimensions
    unread      tables with errors: their content is not reported as missing
    """

    model: SolidModel
    source: str
    controlled: tuple[str, ...]
    driven: frozenset[str]
    followed: tuple[str, ...]
    in_clip: frozenset[str]
    motion_of: Callable[[str], Trajectory]
    clip_of: Callable[[str], Trajectory]
    has_wind: bool
    has_fluid: bool
    is_one_way: bool
    is_slab: bool
    unread: frozenset[str] = frozenset()

    def read(self, *tables: str) -> bool:
        """Whether these tables could be read without errors."""
        return not self.unread & set(tables)

    def unknown_joints(self, joints: Iterable[str]) -> Iterator[str]:
        """A complaint for each joint that the model lacks."""
        return unknown_joints(self.model, self.source, joints)

    def unknown_bodies(self, bodies: Iterable[str]) -> Iterator[str]:
        """A complaint for each body that the model lacks."""
        return unknown_bodies(self.model, self.source, bodies)

    def unusable_function(self, name: str, parameters: Mapping[str, Any]) -> Iterator[str]:
        """A complaint where a function "module:function" is not found, or refuses a parameter."""
        if self.read("plugins"):
            try:
                with_parameters(name, parameters)
            except SceneError as error:
                yield str(error)

    def bodies(self, names: tuple[str, ...] | None) -> Integers:
        """(k,) numbers of the named bodies, or of all that can move."""
        if names is None:
            return np.flatnonzero(self.model.moving)
        return np.array([self.model.body(name) for name in names], dtype=np.int64)

    def dofs(self, joints: Iterable[str]) -> Integers:
        """(k,) dofs of joints that a slab does not lock."""
        model = self.model
        found = [dof for joint in joints for dof in model.dofs_of(joint) if not model.locked[dof]]
        return np.array(found, dtype=np.int64)

    def unit(self, joint: str) -> float:
        """SI value of one unit of the joint's position in a scene."""
        return joint_unit(self.model, joint)


def unknown_joints(model: SolidModel, source: str, joints: Iterable[str]) -> Iterator[str]:
    """A complaint for each joint that a model lacks; `source` names the model."""
    carried = zip(model.joint_names, model.mj.jnt_bodyid, strict=True)
    bones = [name for name, body in carried if body < model.nbody]  # the others are of flesh
    for joint in joints:
        if joint not in bones:
            yield f"joint '{joint}' is not in {source}{suggestion(joint, bones, 'Its joints are')}"


def unknown_bodies(model: SolidModel, source: str, bodies: Iterable[str]) -> Iterator[str]:
    """A complaint for each body that a model lacks; `source` names the model."""
    known = model.body_names
    for body in bodies:
        if body not in known:
            yield f"body '{body}' is not in {source}{suggestion(body, known, 'Its bodies are')}"
