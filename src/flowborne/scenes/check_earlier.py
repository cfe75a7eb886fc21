"""Contradictions about the run that went before."""

from __future__ import annotations

from collections.abc import Iterator

from flowborne.errors import SceneError
from flowborne.phrases import suggestion
from flowborne.scenes.check_bodies import unknown_joint
from flowborne.scenes.draft import Draft
from flowborne.scenes.earlier import Earlier, earlier_joints, earlier_of
from flowborne.solids.model import SolidModel


def check_earlier(draft: Draft) -> Iterator[str]:
    """The earlier run itself, before there is a model."""
    try:
        earlier_of(draft.scene)
    except SceneError as error:
        yield from (f"{draft.at('earlier')}: {problem}" for problem in error.problems)


def check_earlier_joints(draft: Draft, model: SolidModel) -> Iterator[str]:
    """Joints of the earlier run against the model, and against what else moves them."""
    scene, earlier = draft.scene, earlier_of(draft.scene)
    if earlier is None:
        return
    others, joints = scene.told_joints(), earlier_joints(scene)
    if not joints:
        yield (
            f"{draft.at('earlier')}: what was controlled there is so here, or has a [[motion]]: "
            f"{', '.join(earlier.poses)}. Take a joint out of [[control]], or the table away."
        )
    for joint in joints:
        where = draft.at("earlier", "joints")
        unknown = unknown_joint(draft, model, joint, "earlier")
        yield from unknown
        if joint in others:
            yield (
                f"{where}: joint '{joint}' is {others[joint]} as well. Take it out of one of the "
                "two."
            )
        if unknown:
            continue
        if joint not in earlier.poses:
            end = suggestion(joint, earlier.poses, "They are")
            yield f"{where}: joint '{joint}' was not controlled in the earlier run{end}"
        else:
            yield from _check_width(where, earlier, model, joint)


def _check_width(where: str, earlier: Earlier, model: SolidModel, joint: str) -> Iterator[str]:
    there, here = earlier.poses[joint].shape[1], len(model.positions_of(joint))
    if there != here:
        yield (
            f"{where}: joint '{joint}' has {there} numbers in the earlier run and {here} in this "
            "model. Take the same model, or leave the joint out."
        )
