"""A clip on the skeleton of a character, and what of it rigid bodies can follow."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.spatial.transform import Rotation

from flowborne.characters.division import Division
from flowborne.characters.rig import Action, Array, Rig
from flowborne.motion.clip import Clip
from flowborne.motion.clip_curves import CLOSED
from flowborne.quaternions import angle, inverse, product


def posed(rig: Rig, source: Rig, action: Action) -> Action:
    """A rig in the frames of a clip, which may be of another file: joints are found by their names.

    They turn as the file's own do, and joints that it lacks keep their angles. What the file's
    joints move by in the frames of their parents is taken over in proportion to the bones' lengths.

    source  the skeleton of the clip's file
    """
    number = [source.names.index(name) if name in source.names else -1 for name in rig.names]
    own = rig.offsets(rig.position, rig.rotation)
    theirs = source.offsets(source.position, source.rotation)
    moved = source.offsets(action.position, action.rotation) - theirs
    moved *= _scale(own, theirs, number)
    position = np.empty((len(action.position), len(rig.names), 3))
    rotation = np.empty((*position.shape, 3))
    for joint, (parent, k) in enumerate(zip(rig.parents, number, strict=True)):
        offset = own[joint] + (moved[:, k] if k >= 0 else np.zeros((len(position), 3)))
        position[:, joint], still = offset, rig.rotation[joint]
        if parent >= 0:
            above = rotation[:, parent]
            position[:, joint] = position[:, parent] + np.einsum("fij,fj->fi", above, offset)
            still = above @ rig.rotation[parent].T @ still
        rotation[:, joint] = still if k < 0 else action.rotation[:, k]
    return Action(action.frame_time, position, rotation)


def clip_of(rig: Rig, division: Division, pose: Action) -> tuple[Clip, float]:
    """The motion of a character's bodies.

    returns  a clip that has the joints that move, and m, how far at most one of them is from where
             the file has it: bodies are rigid, and the bones of a file may stretch
    """
    joints = list(division.bodies)
    leaders = [division.leader, *joints[1:]]
    turn = pose.rotation[:, leaders] @ np.swapaxes(rig.rotation[leaders], 1, 2)
    world = Rotation.from_matrix(turn.reshape(-1, 3, 3)).as_quat(scalar_first=True)
    world = world.reshape(*turn.shape[:2], 4)
    above = [division.owners[rig.parents[joint]] if n else -1 for n, joint in enumerate(joints)]
    parents = np.array([joints.index(joint) if joint >= 0 else -1 for joint in above])
    local = world.copy()
    local[:, 1:] = product(inverse(world[:, parents[1:]]), world[:, 1:])
    places = rig.position[joints]
    handle = rig.position[0] - rig.position[division.leader]
    clip = Clip(
        names=tuple(rig.names[joint] for joint in joints),
        parents=parents,
        offsets=places - np.where(parents[:, None] < 0, places, places[parents]),
        ends={},
        frame_time=pose.frame_time,
        rotations=local,
        translation=pose.position[:, division.leader] + turn[:, 0] @ handle,
    )
    away = np.linalg.norm(clip.places()[0][:, 1:] - pose.position[:, joints[1:]], axis=2)
    return clip, float(away.max(initial=0.0))


def as_cycle(clip: Clip) -> Clip | None:
    """The clip so that it ends exactly as it begins; None where it is no cycle.

    One that ends within a frame's motion of where it begins has its first pose once more at the
    end; a root that travels goes on for that frame.
    """
    steps = angle(product(inverse(clip.rotations[:-1]), clip.rotations[1:])).max()
    apart = angle(product(inverse(clip.rotations[0]), clip.rotations[-1])).max()
    if clip.frames < 3 or apart > steps:
        return None
    if apart < CLOSED:
        return clip
    place, step = clip.translation, clip.translation[-1] - clip.translation[-2]
    gap = np.linalg.norm(place[0] - place[-1])
    travels = gap > np.linalg.norm(np.diff(place, axis=0), axis=1).max()
    last = place[-1] + step if travels else place[0]
    return replace(
        clip,
        rotations=np.concatenate([clip.rotations, clip.rotations[:1]]),
        translation=np.concatenate([place, [[last[0], last[1], place[0, 2]]]]),
    )


def _scale(own: Array, theirs: Array, number: list[int]) -> float:
    """Length of the joints' bones over that of a file's, where both have them."""
    shared = [joint for joint, k in enumerate(number) if joint > 0 and k > 0]
    lengths = np.linalg.norm(own[shared], axis=1).sum()
    others = np.linalg.norm(theirs[[number[joint] for joint in shared]], axis=1).sum()
    return float(lengths / others) if others > 0.0 else 1.0
