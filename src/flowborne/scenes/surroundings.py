"""What a scene has around the tables that check and build themselves."""

from __future__ import annotations

from functools import cache

from flowborne.control.objective_kinds import ObjectiveInputMotionTable
from flowborne.control.surroundings import Surroundings
from flowborne.motion.clip_motion import TrajectoryClip, TrajectoryPart
from flowborne.scenes.bodies import posed
from flowborne.scenes.capture import capture_of, clip_motion, followers
from flowborne.scenes.earlier import earlier_joints
from flowborne.scenes.schema import Scene
from flowborne.solids.model import SolidModel


def surroundings_of(
    scene: Scene, model: SolidModel, unread: frozenset[str] = frozenset()
) -> Surroundings:
    """What the scene has around its tables.

    unread  tables of which something was left out because it was wrong
    """
    capture, path = capture_of(scene), scene.model_path
    driven = {*scene.moved_joints(), *earlier_joints(scene)}
    driven |= set() if capture is None else set(followers(scene, capture, model))
    tables = {table.joint: table for table in scene.motion}

    @cache
    def clip() -> TrajectoryClip:
        wanted = [t for t in scene.objectives if isinstance(t, ObjectiveInputMotionTable)]
        joints = tuple(dict.fromkeys(table.joint for table in wanted if table.values is None))
        found = clip_motion(scene, model, posed(scene, model).q, joints)
        assert found is not None
        return found

    return Surroundings(
        model=model,
        source="the human" if path is None else f"model {path.name}",
        controlled=scene.controlled_joints(),
        driven=frozenset(driven),
        followed=tuple(tables),
        in_clip=frozenset(() if capture is None else capture.mapping),
        motion_of=lambda joint: tables[joint].build(model, scene.constants),
        clip_of=lambda joint: TrajectoryPart.of(clip(), model, model.dofs_of(joint)),
        has_wind=bool(scene.wind),
        has_fluid=scene.has_fluid,
        is_one_way=scene.fluid is not None and scene.fluid.coupling == "one-way",
        is_slab=scene.is_slab,
        unread=unread,
    )
