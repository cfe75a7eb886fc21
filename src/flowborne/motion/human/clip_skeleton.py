"""The skeleton of a clip, completed by standard proportions where the clip lacks joints."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from scipy.spatial.transform import Rotation

from flowborne.base.errors import SceneError
from flowborne.kernels.arrays import Array
from flowborne.motion.clip import Clip
from flowborne.motion.human.skeleton import (
    FOREARM,
    HAND,
    JOINTS,
    PARENTS,
    SIDES,
    TIPS,
    Link,
    Skeleton,
    ancestors,
    nearest_parent,
    standard_skeleton,
)
from flowborne.motion.quaternions import angle, inverse, rotated

MIN_BONE_RATIO = 1e-6
"""Length of a bone, relative to its standard length, below which it counts as missing."""

MAX_JOINT_OFFSET = 1e-3
"""Largest deviation of a joint from its position in the clip, m."""

MIN_LINK_ROTATION = 1e-6
"""Largest rotation, rad, of a joint that is not a link."""

BONE_ENDS = {
    "lower_neck": "head_top",
    "left_clavicle": "left_shoulder",
    "right_clavicle": "right_shoulder",
}
"""Joint on the thorax -> the point that gets its standard height above the thorax if the bone from
the thorax is missing. In BVH files of the CMU database, neck and collar bones start at the thorax
joint; their neck is longer than a neck, and their shoulders are higher than their start. With the
bone length that the ASF file of subject 02 has for all three (117 mm), shoulders would be 96 mm too
close to the head."""

MIN_THORACIC_RATIO = 0.1
"""Smallest length of such a bone, relative to the standard thorax."""


def skeleton_of(
    clip: Clip, mapping: Mapping[str, str], between: Mapping[str, Sequence[str]] | None = None
) -> Skeleton:
    """Skeleton of a human with a clip's own bones, with all rotations of the clip zero.

    Mapped joints have their position in the clip. If one coincides with its mapped parent other
    than the root, the file lacks the bone between them. That bone is inserted, and all joints below
    move with it; bones of neck and collar get the length that puts head and shoulders at their
    standard height above the thorax. The standard skeleton places joints that are not mapped:
    between their neighbours, or beyond the last one in the direction of its bone. Head and toes end
    at the clip's end sites. A hand points to its farthest end site, with a length in proportion to
    the forearm, because clips end hands anywhere between wrist and fingertip.

    mapping  joint of the model -> joint of the clip, as `mapping_of` returns it
    between  joint of the model -> joints of the clip above it that are links, from the top
    raises   SceneError when joints that need a bone between them coincide
    """
    standard = standard_skeleton()
    rest = dict(zip(clip.names, clip.rest, strict=True))
    found = _found(clip, mapping)
    scale = _scale(found, standard)
    _insert_lost_bones(found, standard, scale, _lost(found, standard, scale))
    for name in (*JOINTS, *TIPS):
        if name not in found:
            found[name] = _filled(name, found, standard, scale)
    for side in SIDES:
        wrist, tip = found[f"{side}_wrist"], found[f"{side}_fingertip"]
        length = HAND / FOREARM * float(np.linalg.norm(wrist - found[f"{side}_elbow"]))
        found[f"{side}_fingertip"] = wrist + length * (tip - wrist) / np.linalg.norm(tip - wrist)
    links = {
        joint: tuple(
            Link(
                f"{joint}_base{number or ''}",
                bone,
                found[joint] + rest[bone] - rest[mapping[joint]],
            )
            for number, bone in enumerate(bones)
        )
        for joint, bones in (between or {}).items()
    }
    joints, tips = ({name: found[name] for name in names} for names in (JOINTS, TIPS))
    return Skeleton(joints, tips, links)


def between(clip: Clip, mapping: Mapping[str, str]) -> dict[str, tuple[str, ...]]:
    """Joint of the model -> rotating joints of the clip between its own and that of its nearest
    mapped ancestor, from the top, if they move it by more than MAX_JOINT_OFFSET."""
    positions, rotations = clip.poses()
    found = {}
    for joint in JOINTS[1:]:
        if joint not in mapping:
            continue
        own = clip.names.index(mapping[joint])
        above = clip.names.index(mapping[nearest_parent(joint, mapping)])
        offset = rotated(inverse(rotations[:, above]), positions[:, own] - positions[:, above])
        bones = clip.lineage(mapping[joint])
        bones = bones[: bones.index(above)]
        rest = sum((clip.offsets[bone] for bone in bones), np.zeros(3))
        if np.linalg.norm(offset - rest, axis=1).max() > MAX_JOINT_OFFSET:
            turning = [
                n for n in bones[:0:-1] if angle(clip.rotations[:, n]).max() > MIN_LINK_ROTATION
            ]
            found[joint] = tuple(clip.names[n] for n in turning)
    return found


def _found(clip: Clip, mapping: Mapping[str, str]) -> dict[str, Array]:
    """(3,) m, positions of the mapped joints and of the tips below them."""
    rest = dict(zip(clip.names, clip.rest, strict=True))
    found = {joint: rest[mapping[joint]] for joint in JOINTS if joint in mapping}
    for tip, joint in TIPS.items():
        if joint not in mapping:
            continue
        start, number = found[joint], clip.names.index(mapping[joint])
        ends = [rest[n] + end for n, end in clip.ends.items() if number in clip.lineage(n)]
        far = max(ends, key=lambda end: float(np.linalg.norm(end - start)), default=start)
        if np.linalg.norm(far - start) > 0.0:
            found[tip] = far
    return found


def _scale(found: Mapping[str, Array], standard: Skeleton) -> float:
    """Size of the clip relative to the standard skeleton: ratio of the summed lengths of the bones
    between mapped joints."""
    ours = theirs = 0.0
    for joint in found:
        if joint == "root" or joint in TIPS:
            continue
        above = nearest_parent(joint, found)
        length = float(np.linalg.norm(found[joint] - found[above]))
        usual = float(np.linalg.norm(standard[joint] - standard[above]))
        if length > MIN_BONE_RATIO * usual:
            ours, theirs = ours + length, theirs + usual
    if theirs == 0.0:
        raise SceneError(
            "all mapped joints are at one point. Map joints that have bones between them."
        )
    return ours / theirs


def _insert_lost_bones(
    found: dict[str, Array], standard: Skeleton, scale: float, lost: Sequence[str]
) -> None:
    for joint in lost:
        above = PARENTS[joint]
        bone = scale * (standard[joint] - standard[above])
        if above == "thorax":
            bone = _thoracic_bone(found, standard, scale, joint)
        for name in found:
            if name == joint or joint in ancestors(name):
                found[name] = found[name] + bone


def _thoracic_bone(
    found: Mapping[str, Array], standard: Skeleton, scale: float, joint: str
) -> Array:
    """(3,) m, from the thorax to a joint on it, along the standard thorax. Its length, at least
    MIN_THORACIC_RATIO of the standard thorax, gives the end in BONE_ENDS its standard height."""
    whole = scale * (standard["lower_neck"] - standard["thorax"])
    end = BONE_ENDS[joint]
    if end not in found:
        return whole
    beyond = found[end] - found[joint]
    rise = (scale * (standard[end] - standard["thorax"]) - beyond) @ whole / (whole @ whole)
    return np.asarray(np.clip(rise, MIN_THORACIC_RATIO, 1.0) * whole)


def lost_bones(clip: Clip, mapping: Mapping[str, str]) -> list[str]:
    """Joints of the human that coincide with their parent other than the root in a clip: its file
    lacks the bones between them."""
    found, standard = _found(clip, mapping), standard_skeleton()
    return _lost(found, standard, _scale(found, standard))


def _lost(found: Mapping[str, Array], standard: Skeleton, scale: float) -> list[str]:
    joints = []
    for joint in JOINTS[1:]:
        above = PARENTS[joint]
        if joint not in found or above not in found or above == "root":
            continue
        length = scale * float(np.linalg.norm(standard[joint] - standard[above]))
        if np.linalg.norm(found[joint] - found[above]) <= MIN_BONE_RATIO * length:
            joints.append(joint)
    return joints


def _filled(name: str, found: Mapping[str, Array], standard: Skeleton, scale: float) -> Array:
    """(3,) m, position of a joint or tip with a known parent: the standard bone, rotated and scaled
    to fit its neighbours."""
    above = PARENTS[name]
    below = next((n for n in (*JOINTS, *TIPS) if n in found and name in ancestors(n)), None)
    offset = standard[name] - standard[above]
    if below is not None:
        ours, theirs = found[below] - found[above], standard[below] - standard[above]
        scale = float(np.linalg.norm(ours) / np.linalg.norm(theirs))
    elif above == "root":
        return found[above] + scale * offset
    else:
        ours = found[above] - found[PARENTS[above]]
        theirs = standard[above] - standard[PARENTS[above]]
    if not np.any(ours):
        raise SceneError(f"the joints around '{name}' coincide. Leave one out of the mapping.")
    turn, _ = Rotation.align_vectors(ours[None], theirs[None])
    return np.asarray(found[above] + scale * turn.apply(offset))
