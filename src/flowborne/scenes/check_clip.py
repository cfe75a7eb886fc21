"""Contradictions about the human and the clip that it follows."""

from __future__ import annotations

from collections.abc import Iterator

from flowborne.errors import SceneError
from flowborne.scenes.bodies import posed
from flowborne.scenes.capture import capture_of, clip_motion
from flowborne.scenes.check_bodies import check_initial, unknown_joint
from flowborne.scenes.draft import Draft
from flowborne.solids.model import SolidModel


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
        capture_of(scene)
    except SceneError as error:
        yield from (f"{draft.at('clip')}: {problem}" for problem in error.problems)


def check_followers(draft: Draft, model: SolidModel) -> Iterator[str]:
    """Joints that follow the clip against the model, and against what else moves them; the clip's
    motion where it can be entered from a pose without fault."""
    scene = draft.scene
    if scene.clip is None:
        return
    capture = capture_of(scene)
    assert capture is not None
    others = {joint: "controlled" for joint in scene.controlled_joints()}
    others |= {table.joint: "moved by a [[motion]]" for table in scene.motion}
    others |= dict.fromkeys(scene.clip.free, "free")
    found = False
    for joint in (*scene.clip.mapping, *(scene.clip.joints or ()), *scene.clip.free):
        unknown = unknown_joint(draft, model, joint, "clip")
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
