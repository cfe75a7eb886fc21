"""The clip of a scene, the human that it moves, and which joints follow it."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache, partial

import numpy as np

from flowborne.base.errors import SceneError
from flowborne.kernels.arrays import Array
from flowborne.motion.clip_following import Passage, trajectory_of_clip
from flowborne.motion.clip_motion import TrajectoryClip
from flowborne.motion.clip_reading import Capture, Reading, read_clip, with_held_joints
from flowborne.motion.human.body import ELBOWS, human_mjcf
from flowborne.motion.human.gait import gait_clip
from flowborne.motion.human.skeleton import SIDES, standard_skeleton
from flowborne.scenes.earlier import earlier_joints
from flowborne.scenes.schema import Scene
from flowborne.scenes.schema_bodies import HumanTable, named_holds
from flowborne.solids.model import SolidModel


def capture_of(scene: Scene) -> Capture | None:
    """The clip that the scene's joints follow; None when there is none.

    raises  SceneError when the file cannot be used
    """
    table = scene.clip
    if table is None:
        return None
    offset, heading = table.offset, float(np.radians(table.heading))
    if table.file is None:
        assert scene.human is not None
        found = _walk(scene.human.height)
    else:
        human = scene.human or HumanTable()
        reading = Reading(
            None if table.unit == "auto" else table.unit,
            None if table.up == "auto" else table.up,
            table.skip,
            tuple(table.mapping.items()),
            table.floor,
            human.mass,
            human.sex,
        )
        found = read_clip(scene.folder / table.file, reading, person=scene.human is not None)
        named = _words(scene) if found.held else set()
        if still := tuple(joint for joint in found.held if joint in named):
            found = with_held_joints(found, still)
    return replace(found, clip=found.clip.placed(offset, heading))


def _words(scene: Scene) -> set[object]:
    """All keys and values of a scene except clip.mapping, and the joints of an earlier run."""
    found = set[object](earlier_joints(scene))
    left: list[object] = [scene.model_dump(exclude={"clip": {"mapping"}}, exclude_none=True)]
    while left:
        value = left.pop()
        if isinstance(value, dict):
            left += [*value, *value.values()]
        elif isinstance(value, list | tuple):
            left += value
        else:
            found.add(value)
    return found


@lru_cache(maxsize=4)
def _walk(height: float) -> Capture:
    """The generated walk of a standard skeleton; cached."""
    skeleton = standard_skeleton(height)
    clip = gait_clip(skeleton)
    return Capture(clip, {joint: joint for joint in clip.names}, skeleton)


def human_of(scene: Scene) -> str:
    """MJCF of the scene's human: with the bones of the clip's file, or else the standard ones.

    Elbows that are controlled are hinges, and all with human.elbows. Arms that are controlled
    collide with the rest.
    raises  SceneError when the clip cannot be used, or an elbow of it is no hinge
    """
    assert scene.human is not None
    capture = capture_of(scene)
    skeleton = None if capture is None else capture.skeleton
    if skeleton is None:
        skeleton = standard_skeleton(scene.human.height)
    controlled = set(scene.controlled_joints())
    held = () if capture is None else set(capture.held) - set(capture.mapping)
    touching = [side for side in SIDES if {f"{side}_shoulder", f"{side}_elbow"} & controlled]
    hinged = set(ELBOWS) if scene.human.elbows else controlled & set(ELBOWS)
    try:
        return human_mjcf(skeleton, scene.human.mass, scene.human.sex, hinged, touching, held)
    except ValueError as error:
        raise SceneError(str(error)) from error


def followers(scene: Scene, capture: Capture, model: SolidModel) -> tuple[str, ...]:
    """Joints of the model that follow the clip, in the model's order."""
    assert scene.clip is not None
    taken = {*scene.moved_joints(), *scene.clip.free, *earlier_joints(scene)}
    taken |= {*named_holds(scene.solids, model)}
    chosen = capture.mapping if scene.clip.joints is None else scene.clip.joints
    return tuple(
        joint
        for joint in model.joint_names
        if (joint in chosen and (scene.clip.joints is not None or joint not in taken))
        or joint in capture.links
    )


def clip_motion(
    scene: Scene, model: SolidModel, start: Array, joints: tuple[str, ...] | None = None
) -> TrajectoryClip | None:
    """The motion that the scene's clip gives to joints; None without one, or without joints.

    start   (nq,) pose from which a blend leads into the clip
    joints  names; those that follow the clip when None
    raises  SceneError when trim, loop, blend or smooth do not fit the clip
    """
    capture, table = capture_of(scene), scene.clip
    if capture is None or table is None:
        return None
    chosen = followers(scene, capture, model) if joints is None else joints
    if not chosen:
        return None
    passage = Passage(
        start=table.start,
        stop=table.stop,
        loop=table.file is None if table.loop is None else table.loop,
        blend=table.blend,
        smooth=table.smooth,
    )
    motion = partial(trajectory_of_clip, model, capture.clip, capture.mapping, joints=chosen)
    if passage.blend > 0.0:  # from the clip's first pose, except what [initial] poses
        first, own = motion(replace(passage, loop=False, blend=0.0)), start
        start = own.copy()
        start[model.indices_of(first.dofs)] = first.position(0.0)
        for joint in scene.initial.positions:
            places = model.positions_of(joint)
            start[places] = own[places]
    return motion(passage, initial=start)


def pose_controlled(scene: Scene, model: SolidModel, q: Array) -> None:
    """Set controlled and free joints to the clip's first pose, except those that [initial] names.

    q       (nq,) pose from which a blend leads into the clip; changed in place
    raises  SceneError as `clip_motion` does
    """
    capture = capture_of(scene)
    if capture is None or scene.clip is None:
        return
    own = {*scene.controlled_joints(), *scene.clip.free} - set(scene.initial.positions)
    joints = tuple(joint for joint in model.joint_names if joint in own & set(capture.mapping))
    motion = clip_motion(scene, model, q, joints)
    if motion is not None:
        q[model.indices_of(motion.dofs)] = motion.position(0.0)
