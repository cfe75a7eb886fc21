"""Contradictions about the human and the clip that it follows."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from flowborne.base.errors import SceneError
from flowborne.motion.clip import Clip
from flowborne.scenes.bodies import check_initial, posed
from flowborne.scenes.capture import capture_of, clip_motion
from flowborne.scenes.draft import Draft
from flowborne.scenes.earlier import earlier_joints
from flowborne.scenes.schema_bodies import ClipTable
from flowborne.solids.model import SolidModel

JUMP = np.radians(15.0)
"""Least turn of a joint from the first frame to the second that is looked at."""

JUMPS = 3.0
"""How much more all joints then turn than between any two later frames, if it is a T-pose."""

MANY = 10
"""Frames of a clip from which on that can be told."""


def check_clip(draft: Draft) -> Iterator[str]:
    """The tables human and clip, and the clip's file, before there is a model."""
    scene = draft.scene
    if scene.human is not None and scene.solids is not None:
        yield f"{draft.at('human')}: there is a [solids] as well. Keep one of the two."
    if scene.human is not None and scene.is_slab:
        yield f"{draft.at('human')}: a human needs 3 dimensions, and the scene has 2. Drop one."
    if scene.clip is None:
        return
    if scene.clip.file is None and scene.human is None:
        if draft.sound("human"):
            yield (
                f"{draft.at('clip')}: there is no file, and a walk without one needs a [human]. "
                "Add clip.file or [human]."
            )
        return
    try:
        capture = capture_of(scene)
    except SceneError as error:
        yield from (f"{draft.at('clip')}: {problem}" for problem in error.problems)
        return
    if capture is not None and scene.clip.file is not None:
        yield from _check_first_pose(draft, capture.clip, scene.clip)


def _check_first_pose(draft: Draft, clip: Clip, table: ClipTable) -> Iterator[str]:
    """A clip that begins with a T-pose, which a recording jumps out of, cannot be followed."""
    begun = table.start > 0.5 * clip.frame_time or table.smooth is not None
    if begun or clip.frames < MANY:
        return
    turns = clip.rotation_steps()
    first, later = turns[0], turns[1:]
    if first.max() > JUMP and first.sum() > JUMPS * later.sum(axis=1).max():
        joint = clip.names[int(first.argmax())]
        yield (
            f"{draft.at('clip')}: from the first frame that is used of {table.file} to the second "
            f"'{joint}' turns by {np.degrees(first.max()):.3g} degrees, and no joint by more than "
            f"{np.degrees(later.max()):.3g} between any two after that: the first is a T-pose or "
            f"the like. Drop it by skip = {table.skip + 1}."
        )


def check_followers(draft: Draft, model: SolidModel) -> Iterator[str]:
    """Joints that follow the clip against the model, and against what else moves them; the clip's
    motion where it can be entered from a pose without fault."""
    scene = draft.scene
    if scene.clip is None:
        return
    capture = capture_of(scene)
    assert capture is not None
    others = scene.moved_joints() | dict.fromkeys(scene.clip.free, "free")
    others |= dict.fromkeys(earlier_joints(scene), "moved by the [earlier] run")
    found = False
    for joint in (*scene.clip.mapping, *(scene.clip.joints or ()), *scene.clip.free):
        unknown = draft.unknown_joint(model, joint, "clip")
        yield from unknown
        found |= bool(unknown)
    for joint in scene.clip.joints or ():
        if joint in others:
            yield (
                f"{draft.at('clip', 'joints')}: joint '{joint}' is {others[joint]} as well. "
                "Take it out of one of the two."
            )
        if joint not in capture.mapping and joint in model.joint_names:
            yield (
                f"{draft.at('clip', 'joints')}: joint '{joint}' has no counterpart in the clip, "
                f"whose joints are {', '.join(capture.clip.names)}. Add it to clip.mapping."
            )
            found = True
    if not set(capture.mapping) & set(model.joint_names):
        yield (
            f"{draft.at('clip')}: the model has no joint with the name of one of the clip's, which "
            f"are {', '.join(capture.clip.names)}. Say in clip.mapping which of them each follows."
        )
        found = True
    if found or any(check_initial(draft, model)):
        return
    try:
        clip_motion(scene, model, posed(scene, model).q)
    except SceneError as error:
        yield from (f"{draft.at('clip')}: {problem}" for problem in error.problems)
