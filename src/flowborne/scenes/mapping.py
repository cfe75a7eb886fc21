"""Which joint of a clip drives which joint of the human, guessed from the names in use."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass

from flowborne.errors import SceneError
from flowborne.io.clip import Clip
from flowborne.scenes.wording import suggestion

CENTRAL = ("root", "lower_back", "upper_back", "thorax", "lower_neck", "upper_neck", "head")
SIDED = ("hip", "knee", "ankle", "toes", "clavicle", "shoulder", "elbow", "wrist")
JOINTS = (*CENTRAL, *(f"{side}_{joint}" for side in ("left", "right") for joint in SIDED))
"""Joints of the human."""

NEEDED = ("root", *(f"{side}_{j}" for side in ("left", "right") for j in ("hip", "knee", "ankle")))
"""Joints without which a clip is no walk."""


@dataclass(frozen=True)
class Convention:
    """How a family of tools calls joints; lower case, letters and digits only.

    sides  what "*" stands for on the left and on the right
    names  model joint without its side -> names, the first that the clip has counts
    """

    sides: tuple[str, str]
    names: Mapping[str, tuple[str, ...]]


def _named(sides: tuple[str, str], legs: str, spine: str, arms: str) -> Convention:
    """Names in the order of hip knee ankle toes, root lower_back ... head, clavicle ... wrist.

    "-" for a joint that there is not, "a|b" for a choice
    """
    order = (*SIDED[:4], *CENTRAL, *SIDED[4:])
    words = f"{legs} {spine} {arms}".split()
    pairs = zip(order, words, strict=True)
    return Convention(sides, {joint: tuple(word.split("|")) for joint, word in pairs})


WORDS, LETTERS = ("left", "right"), ("l", "r")
CONVENTIONS = (
    # ours
    _named(
        WORDS,
        "*hip *knee *ankle *toes",
        "root lowerback upperback thorax lowerneck upperneck head",
        "*clavicle *shoulder *elbow *wrist",
    ),
    # CMU's clips as converted for 3ds Max
    _named(
        WORDS,
        "*hip *knee *ankle *toe",
        "hips lowerback chest chest2 lowerneck neck head",
        "*collar *shoulder *elbow @hand|*wrist",
    ),
    # CMU's own skeletons (ASF); a wrist bone twists the forearm and the hand bends
    _named(
        LETTERS,
        "*femur *tibia *foot *toes",
        "root|hips lowerback upperback thorax lowerneck upperneck head",
        "*clavicle *humerus *radius *hand|*wrist",
    ),
    # CMU's clips as converted for MotionBuilder
    _named(
        WORDS,
        "*upleg *leg *foot *toebase",
        "hips lowerback spine spine1 neck neck1 head",
        "*shoulder *arm *forearm *hand",
    ),
    # Mixamo, MotionBuilder's HumanIK
    _named(
        WORDS,
        "*upleg *leg *foot *toebase",
        "hips spine spine1 spine3|spine2 neck neck1 head",
        "*shoulder *arm *forearm *hand",
    ),
    # Xsens
    _named(
        WORDS,
        "*hip *knee *ankle *toe",
        "hips chest chest2 chest4|chest3 neck - head",
        "*collar *shoulder *elbow *wrist",
    ),
    # Unreal
    _named(
        LETTERS,
        "thigh* calf* foot* ball*",
        "pelvis spine01 spine02 spine05|spine03 neck01 neck02 head",
        "clavicle* upperarm* lowerarm* hand*",
    ),
    # Blender's Rigify
    _named(
        LETTERS,
        "thigh* shin* foot* toe*",
        "spine|hips spine001 spine002 spine003 spine004 spine005 spine006|head",
        "shoulder* upperarm* forearm* hand*",
    ),
)


def mapping_of(clip: Clip, table: Mapping[str, str]) -> dict[str, str]:
    """Joint of the clip for each joint of the human that the clip has.

    table   model joint -> clip joint, which goes before what is guessed from the clip's names
    raises  SceneError when the table names what is not there, and when no joint is found for the
            root, a hip, a knee or an ankle
    """
    problems = []
    for joint, bone in table.items():
        if joint not in JOINTS:
            end = suggestion(joint, JOINTS, "The human's joints are")
            problems.append(f"mapping: unknown joint '{joint}'{end}")
        if bone not in clip.names:
            end = suggestion(bone, clip.names, "Its joints are")
            problems.append(f"mapping: the clip has no joint '{bone}' for '{joint}'{end}")
    if problems:
        raise SceneError(problems)
    mapping = {**guessed(clip), **table}
    missing = [joint for joint in NEEDED if joint not in mapping]
    if missing:
        raise SceneError(
            f"mapping: no joint of the clip is known for {', '.join(missing)}. Name them in the "
            f"table of the mapping. The clip's joints are: {', '.join(clip.names)}."
        )
    return {joint: mapping[joint] for joint in JOINTS if joint in mapping}


def guessed(clip: Clip) -> dict[str, str]:
    """Model joint -> clip joint by the convention that explains most of a clip's names."""
    bones = {_plain(name): name for name in reversed(clip.names)}
    found = [_found(convention, bones) for convention in CONVENTIONS]
    return max(found, key=len)


def _found(convention: Convention, bones: Mapping[str, str]) -> dict[str, str]:
    result = {}
    for joint, names in convention.names.items():
        sides = zip(WORDS, convention.sides, strict=True) if joint in SIDED else [("", "")]
        for side, word in sides:
            spelled = (name.replace("*", word).replace("@", word[:1]) for name in names)
            bone = next((bones[name] for name in spelled if name in bones), None)
            if bone is not None:
                result[f"{side}_{joint}" if side else joint] = bone
    return result


def _plain(name: str) -> str:
    """Name without the prefix of a tool, lower case, letters and digits only."""
    bare = re.sub(r"^(mixamorig\d*[_ ]?|DEF-|ORG-)", "", name.rsplit(":", 1)[-1])
    return re.sub(r"[^a-z0-9]", "", bare.lower())
