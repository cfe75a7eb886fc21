"""Groups of joints with common objectives, and objectives that a player can switch on for them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from flowborne.control.objective_kinds import (
    AnyObjective,
    ObjectiveDragTable,
    ObjectiveEffortTable,
    ObjectiveInputMotionTable,
)
from flowborne.scenes.bodies import load_model
from flowborne.scenes.schema import Scene
from flowborne.solids.model import SolidModel


@dataclass(frozen=True)
class Group:
    """Controlled joints that have the same objectives, which no other joint has.

    joints  their names
    own     numbers of their objectives in the scene, except those in `close`
    close   numbers of the objectives that keep them close to a given motion
    effort  number of the added objective of their effort
    drag    number of the added objective of the drag of what they move; None without a stream
    """

    joints: tuple[str, ...]
    own: tuple[int, ...]
    close: tuple[int, ...]
    effort: int
    drag: int | None


def with_choices(scene: Scene) -> tuple[Scene, tuple[Group, ...]]:
    """The scene with the objectives that can be chosen for each group, with weight 0, and the
    groups.

    Weights of 0 change no number of a run. Joints that share an objective with joints of other
    objectives are in no group: it cannot be switched off for one of them.
    """
    tables = list(scene.objectives)
    wanted = {
        joint: tuple(
            n
            for n, table in enumerate(scene.objectives)
            if table.wanted_by is None or joint in table.wanted_by
        )
        for joint in scene.controlled_joints()
    }
    groups = []
    for numbers in dict.fromkeys(wanted.values()):
        joints = tuple(joint for joint in wanted if wanted[joint] == numbers)
        others = (n for joint in wanted if joint not in joints for n in wanted[joint])
        if not numbers or set(numbers) & set(others):
            continue
        close = tuple(
            n for n in numbers if isinstance(scene.objectives[n], ObjectiveInputMotionTable)
        )
        own = tuple(n for n in numbers if n not in close)
        added = _choices(scene, joints)
        drag = len(tables) + 1 if len(added) > 1 else None
        groups.append(Group(joints, own, close, len(tables), drag))
        tables += added
    return scene.model_copy(update={"objectives": tuple(tables)}), tuple(groups)


def _choices(scene: Scene, joints: tuple[str, ...]) -> list[AnyObjective]:
    """Effort of joints, and drag along the stream of what they move, with weight 0."""
    effort = ObjectiveEffortTable(kind="effort", joints=joints, weight=0.0, wanted_by=joints)
    stream = scene.stream()
    bodies = bodies_beyond(load_model(scene), joints)
    if stream is None or not bodies:
        return [effort]
    direction = tuple(float(x) for x in np.asarray(stream) / np.linalg.norm(stream))
    drag = ObjectiveDragTable.model_validate(
        {
            "kind": "drag",
            "direction": direction,
            "bodies": bodies,
            "weight": 0.0,
            "wanted_by": joints,
        }
    )
    return [effort, drag]


def bodies_beyond(model: SolidModel, joints: Sequence[str]) -> tuple[str, ...]:
    """Names of the bodies with volume that joints move, in the model's order."""
    mj, found = model.mj, np.zeros(model.nbody, bool)
    found[[mj.jnt_bodyid[model.joint(joint)] for joint in joints]] = True
    for body in range(1, model.nbody):
        found[body] |= found[mj.body_parentid[body]]
    return tuple(
        name
        for body, name in enumerate(model.body_names)
        if found[body] and model.volume[body] > 0.0
    )
