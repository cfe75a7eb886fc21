"""The skeleton that a clip was made with, completed where the clip says nothing."""

from __future__ import annotations

from collections.abc import Container, Mapping, Sequence

import numpy as np
from scipy.spatial.transform import Rotation

from flowborne.errors import SceneError
from flowborne.motion.clip import Clip
from flowborne.motion.human.skeleton import (
    BODIES,
    FOREARM,
    HAND,
    PARENTS,
    SIDES,
    TIPS,
    Array,
    Link,
    Skeleton,
    standard_skeleton,
)
from flowborne.motion.quaternions import angle, inverse, turned
from flowborne.phrases import suggestion

NAMES = tuple(joint for _, joint, _ in BODIES)
"""Joints, parents first."""

TINY = 1e-6
"""Of a bone's standard length: what is shorter is no bone."""

NEAR = 1e-3
"""m by which a joint may be off where the clip has it."""

SAME = 1e-6
"""rad; a joint that turns less is none."""

ENDS = {
    "lower_neck": "head_top",
    "left_clavicle": "left_shoulder",
    "right_clavicle": "right_shoulder",
}
"""Joint on the thorax -> what has its standard height above that where the bone between is lost:
BVH files of the CMU database start neck and collar bones on the thorax itself, with a neck that is
longer than a neck and shoulders that are higher than their start. At the length that the ASF file
of subject 02 has for all three (117 mm) shoulders would be 96 mm too near to the head."""

SHORTEST = 0.1
"""Of the standard thorax, the least length of such a bone."""


def skeleton_of(
    clip: Clip, mapping: Mapping[str, str], between: Mapping[str, Sequence[str]] | None = None
) -> Skeleton:
    """Skeleton with a clip's own bones, no joint of the clip turned.

    mapping  joint of the model -> joint of the clip; the root must be among them
    between  joint of the model -> joints of the clip above it that are links, from the top
    returns  joints that are mapped are where the clip has them. Where one lies on its mapped
             parent, other than the root, the file lacks the bone between: it is put in (neck and
             collar bones: such that head and shoulders are as high as the standard skeleton's
             above the thorax), and all beyond moves with it. A joint that is not mapped is placed
             by the standard skeleton: between its neighbours, or beyond the last of them in the
             direction of its bone.
             Head and toes end at the clip's end sites; a hand points to the farthest of them and
             has the forearm's proportion, as clips end hands anywhere between wrist and fingertip
    raises   SceneError for unknown joints, when the root or every other joint is missing, and when
             two joints lie on each other that a bone of any length must part
    """
    _check_names(clip, mapping)
    standard = standard_skeleton()
    place = _places(clip)
    found = _found(clip, mapping)
    scale = _scale(found, standard)
    _insert_lost_bones(found, standard, scale, _lost(found, standard, scale))
    for name in (*NAMES, *TIPS):
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
                found[joint] + place[bone] - place[mapping[joint]],
            )
            for number, bone in enumerate(bones)
        )
        for joint, bones in (between or {}).items()
    }
    joints, tips = ({name: found[name] for name in names} for names in (NAMES, TIPS))
    return Skeleton(joints, tips, links)


def between(clip: Clip, mapping: Mapping[str, str]) -> dict[str, tuple[str, ...]]:
    """Joint of the model -> joints of the clip between its own and that of the nearest mapped joint
    above, from the top, where these move it by more than NEAR."""
    places, rotations = clip.places()
    found = {}
    for joint in NAMES[1:]:
        if joint not in mapping:
            continue
        own = clip.names.index(mapping[joint])
        above = clip.names.index(mapping[_above(joint, mapping)])
        way = turned(inverse(rotations[:, above]), places[:, own] - places[:, above])
        bones, at = [], own
        rest = np.zeros(3)
        while at != above:
            rest = rest + clip.offsets[at]
            at = int(clip.parents[at])
            bones.append(at)
        if np.linalg.norm(way - rest, axis=1).max() > NEAR:
            turning = [n for n in bones[-2::-1] if angle(clip.rotations[:, n]).max() > SAME]
            found[joint] = tuple(clip.names[n] for n in turning)
    return found


def _check_names(clip: Clip, mapping: Mapping[str, str]) -> None:
    problems = []
    for joint, name in mapping.items():
        if joint not in NAMES:
            end = suggestion(joint, NAMES, "The human's joints are")
            problems.append(f"clip, mapping: the human has no joint '{joint}'{end}")
        if name not in clip.names:
            end = suggestion(name, clip.names, "The clip's joints are")
            problems.append(f"clip, mapping {joint}: the clip has no joint '{name}'{end}")
    if "root" not in mapping:
        problems.append("clip, mapping: the joint 'root' is missing. Map it to the clip's root.")
    if len(mapping) < 2:
        problems.append("clip, mapping: no joint but the root. Map the joints of a leg at least.")
    if problems:
        raise SceneError(problems)


def _found(clip: Clip, mapping: Mapping[str, str]) -> dict[str, Array]:
    """Places of the mapped joints, and of the tips below them, m."""
    place = _places(clip)
    found = {joint: place[mapping[joint]] for joint in NAMES if joint in mapping}
    for tip, joint in TIPS.items():
        if joint not in mapping:
            continue
        start = found[joint]
        ends = [
            place[name] + offset
            for name, offset in clip.ends.items()
            if mapping[joint] in _lineage(clip, name)
        ]
        far = max(ends, key=lambda end: float(np.linalg.norm(end - start)), default=start)
        if np.linalg.norm(far - start) > 0.0:
            found[tip] = far
    return found


def _places(clip: Clip) -> dict[str, Array]:
    """(3,) m, place of each joint of the clip with none turned, from the root."""
    place: dict[str, Array] = {}
    for number, name in enumerate(clip.names):
        parent = int(clip.parents[number])
        above = place[clip.names[parent]] if parent >= 0 else np.zeros(3)
        place[name] = above + clip.offsets[number]
    return place


def _lineage(clip: Clip, name: str) -> list[str]:
    """A joint of the clip and all above it."""
    names = []
    number = clip.names.index(name)
    while number >= 0:
        names.append(clip.names[number])
        number = int(clip.parents[number])
    return names


def _scale(found: Mapping[str, Array], standard: Skeleton) -> float:
    """Clip's size over the standard's, by the joints that both have and their nearest above."""
    ours = theirs = 0.0
    for joint in found:
        if joint == "root" or joint in TIPS:
            continue
        above = _above(joint, found)
        length = float(np.linalg.norm(found[joint] - found[above]))
        usual = float(np.linalg.norm(standard[joint] - standard[above]))
        if length > TINY * usual:
            ours, theirs = ours + length, theirs + usual
    if theirs == 0.0:
        raise SceneError(
            "all mapped joints are at one place. Map joints that have bones between them."
        )
    return ours / theirs


def _above(name: str, found: Container[str]) -> str:
    """Nearest joint above that the clip has."""
    above = PARENTS[name]
    while above not in found:
        above = PARENTS[above]
    return above


def _insert_lost_bones(
    found: dict[str, Array], standard: Skeleton, scale: float, lost: Sequence[str]
) -> None:
    for joint in lost:
        above = PARENTS[joint]
        bone = scale * (standard[joint] - standard[above])
        if above == "thorax":
            bone = _thoracic_bone(found, standard, scale, joint)
        for name in found:
            if name == joint or joint in _ancestors(name):
                found[name] = found[name] + bone


def _thoracic_bone(
    found: Mapping[str, Array], standard: Skeleton, scale: float, joint: str
) -> Array:
    """From the thorax to a joint on it, along the standard thorax: with what the clip has beyond,
    the end is as high as that of the standard skeleton; at least SHORTEST of the whole."""
    whole = scale * (standard["lower_neck"] - standard["thorax"])
    end = ENDS[joint]
    if end not in found:
        return whole
    beyond = found[end] - found[joint]
    rise = (scale * (standard[end] - standard["thorax"]) - beyond) @ whole / (whole @ whole)
    return np.asarray(np.clip(rise, SHORTEST, 1.0) * whole)


def lost_bones(clip: Clip, mapping: Mapping[str, str]) -> list[str]:
    """Joints of the human that lie on their parent, other than the root, in a clip: its file lacks
    the bones between."""
    found, standard = _found(clip, mapping), standard_skeleton()
    return _lost(found, standard, _scale(found, standard))


def _lost(found: Mapping[str, Array], standard: Skeleton, scale: float) -> list[str]:
    joints = []
    for joint in NAMES[1:]:
        above = PARENTS[joint]
        if joint not in found or above not in found or above == "root":
            continue
        length = scale * float(np.linalg.norm(standard[joint] - standard[above]))
        if np.linalg.norm(found[joint] - found[above]) <= TINY * length:
            joints.append(joint)
    return joints


def _ancestors(name: str) -> list[str]:
    names = []
    while name in PARENTS:
        name = PARENTS[name]
        names.append(name)
    return names


def _filled(name: str, found: Mapping[str, Array], standard: Skeleton, scale: float) -> Array:
    """Place of a joint or tip whose parent is known: the standard one, turned and scaled to fit."""
    above = PARENTS[name]
    below = next((n for n in (*NAMES, *TIPS) if n in found and name in _ancestors(n)), None)
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
        raise SceneError(
            f"the joints around '{name}' lie on each other. Leave one out of the mapping."
        )
    turn, _ = Rotation.align_vectors(ours[None], theirs[None])
    return np.asarray(found[above] + scale * turn.apply(offset))
