"""Which joint of a clip drives which joint of the human.

Limbs are found by their names, and hips, spine and neck by their place in the tree.
"""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from importlib import resources

from flowborne.errors import SceneError
from flowborne.motion.clip import Clip
from flowborne.motion.human.skeleton import PARENTS, SIDES
from flowborne.phrases import suggestion

CENTRAL = ("root", "lower_back", "upper_back", "thorax", "lower_neck", "upper_neck", "head")
SIDED = ("hip", "knee", "ankle", "toes", "clavicle", "shoulder", "elbow", "wrist")
JOINTS = (*CENTRAL, *(f"{side}_{joint}" for side in SIDES for joint in SIDED))
"""Joints of the human."""

LIMBS = ("hip", "knee", "ankle", "shoulder", "elbow")
REQUIRED = ("root", *(f"{side}_{joint}" for side in SIDES for joint in LIMBS))
"""Joints without which a clip is no person's."""

HEAD, NECK = ("head", "skullbase"), ("neck", "neck1", "neck01", "necklower", "lowerneck")
"""Names of the head's joint, or else of one in the neck, in any family."""

SIDE_WORDS = {"left": "left", "right": "right", "l": "left", "r": "right"}
"""Part of a joint's name -> the side that it stands for."""

FILLERS = {"jnt", "bone"}
"""Last part of a joint's name in some tools, without a meaning."""

SPINE = ("lower_back", "upper_back", "thorax")
CERVICAL = ("lower_neck", "upper_neck", "head")


@dataclass(frozen=True)
class Family:
    """How a family of tools calls the joints of limbs.

    names  joint of the human without its side -> names, the first that the clip has counts
    """

    name: str
    source: str
    names: Mapping[str, tuple[str, ...]]


@dataclass(frozen=True)
class Spelled:
    """A joint's name taken apart.

    name    as the clip has it
    side    "left", "right" or ""
    stem    the rest, lower case, letters and digits only
    starts  where in the stem a word begins
    letter  the name itself, where the side is one letter
    """

    name: str
    side: str
    stem: str
    starts: frozenset[int]
    letter: str

    def matches(self, known: str) -> bool:
        """Whether the name is a known one, with or without words before it."""
        if known.startswith("@"):
            return self.letter == known[1:]
        start = len(self.stem) - len(known)
        return start in self.starts and self.stem.endswith(known)


@lru_cache(maxsize=1)
def families() -> tuple[Family, ...]:
    """The table of names, clip_names.toml."""
    text = (resources.files("flowborne.motion.human") / "clip_names.toml").read_text("utf-8")
    return tuple(
        Family(table["name"], table["source"], {joint: tuple(table[joint]) for joint in SIDED})
        for table in tomllib.loads(text)["family"]
    )


def mapping_of(clip: Clip, table: Mapping[str, str]) -> dict[str, str]:
    """Joint of the clip for each joint of the human that the clip has.

    table   model joint -> clip joint, which goes before what is guessed: of a spine, or of a neck,
            of which it names a joint no other is guessed
    raises  SceneError when the table names what is not there, when no joint is found for a hip,
            knee, ankle, shoulder or elbow, and when one that is found does not hang on the one
            above it
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
    spelled = [_spelled(name) for name in clip.names]
    mapping = {**_limbs(spelled), **table}
    missing = [joint for joint in REQUIRED[1:] if joint not in mapping]
    if missing:
        raise SceneError(
            f"mapping: no joint of the clip is known for {', '.join(missing)} (looked for: "
            f"{_looked_for(missing)}). Name {'it' if len(missing) == 1 else 'them'} in "
            f"[clip.mapping]. The clip's joints are: {', '.join(clip.names)}."
        )
    guess = _trunk(clip, mapping, spelled)
    for chain in (SPINE, CERVICAL[:-1]):
        if not set(chain).isdisjoint(table):
            guess = {joint: bone for joint, bone in guess.items() if joint not in chain}
    mapping = guess | mapping
    mapping = {joint: mapping[joint] for joint in JOINTS if joint in mapping}
    _check_order(clip, mapping)
    return mapping


def _looked_for(missing: Iterable[str]) -> str:
    joints = dict.fromkeys(joint.split("_", 1)[1] for joint in missing)
    names = (n.lstrip("@") for f in families() for joint in joints for n in f.names[joint])
    return ", ".join(dict.fromkeys(names)) + ", each with left, right, l or r"


def _spelled(name: str) -> Spelled:
    bare = name.rsplit(":", 1)[-1]
    words = [w.lower() for w in re.findall(r"[A-Z]+(?![a-z])|[A-Z]?[a-z]+|\d+", bare)]
    while words and words[-1] in FILLERS:
        words.pop()
    side = next((SIDE_WORDS[word] for word in words if word in SIDE_WORDS), "")
    short = any(word in ("l", "r") for word in words)
    if side:
        words.remove(next(word for word in words if word in SIDE_WORDS))
    else:
        side, short, words = _run_together(words)
    starts, at = set(), 0
    for word in words:
        starts.add(at)
        at += len(word)
    stem = "".join(words)
    return Spelled(name, side, stem, frozenset(starts), stem if short else "")


def _run_together(words: list[str]) -> tuple[str, bool, list[str]]:
    """Side, whether it is one letter, and the rest of a name such as "lfemur" or "hipleft"."""
    known = {name for family in families() for names in family.names.values() for name in names}
    whole = "".join(words)
    for word, side in SIDE_WORDS.items():
        if whole.startswith(word) and whole[len(word) :] in known:
            return side, len(word) == 1, [whole[len(word) :]]
        if len(word) > 1 and whole.endswith(word) and whole[: -len(word)] in known:
            return side, False, [whole[: -len(word)]]
    return "", False, words


def _limbs(spelled: Sequence[Spelled]) -> dict[str, str]:
    """Joints of the limbs by the family that explains most of the names, and the head's."""
    limbs = max((_by_family(family, spelled) for family in families()), key=len)
    central = [one for one in spelled if not one.side]
    head = _first(HEAD, central)
    return limbs | ({"head": head} if head is not None else {})


def _by_family(family: Family, spelled: Sequence[Spelled]) -> dict[str, str]:
    result = {}
    for side in SIDES:
        left = [one for one in spelled if one.side == side]
        longest = sorted(family.names.items(), key=lambda item: -max(map(len, item[1])))
        for joint, names in longest:  # "upleg" before "leg", which it ends with
            bone = _first(names, left)
            if bone is not None:
                result[f"{side}_{joint}"] = bone
                left = [one for one in left if not any(one.matches(name) for name in names)]
    return result


def _first(names: Iterable[str], among: Sequence[Spelled]) -> str | None:
    """The first joint of the first of some names; a joint without words before it is preferred."""
    for name in names:
        found = [one for one in among if one.matches(name)]
        if found:
            return min(found, key=lambda one: len(one.stem)).name
    return None


def _trunk(clip: Clip, mapping: Mapping[str, str], spelled: Sequence[Spelled]) -> dict[str, str]:
    """Hips, spine and neck: what the limbs hang on, and the joints between.

    Of a spine or neck of fewer joints than the human's the middle ones are missing, of one with
    more the ones below its end are left over.
    """
    lines = {joint: _line(clip, bone) for joint, bone in mapping.items()}
    arms = [lines[j] for j in lines if j.endswith(("_clavicle", "_shoulder"))]
    legs = [lines[f"{side}_hip"] for side in SIDES]
    root = mapping.get("root") or _common([*legs, *arms])[-1]
    top = mapping.get("head") or _first(NECK, [one for one in spelled if not one.side])
    neck = [] if top is None else _line(clip, top)
    chest = mapping.get("thorax") or _common([*arms, *([neck] if neck else [])])[-1]
    spine = [bone for bone in _line(clip, chest) if root in _line(clip, bone)[:-1]]
    above = [bone for bone in neck if chest in _line(clip, bone)[:-1]]
    found = {"root": root} | _shared(SPINE, spine)
    if "head" in mapping:
        found |= _shared(CERVICAL, above)
    else:
        found |= dict(zip(CERVICAL[:-1], above, strict=False))
    return found


def _shared(joints: tuple[str, str, str], bones: Sequence[str]) -> dict[str, str]:
    """The human's three joints for a chain of bones; the last one goes before the others."""
    low, middle, high = joints
    if len(bones) < 2:
        only = high if high == "head" else low
        return dict.fromkeys([only], bones[0]) if bones else {}
    ends = {low: bones[0], high: bones[-1]}
    return ends | ({middle: bones[1]} if len(bones) > 2 else {})


def _line(clip: Clip, name: str) -> list[str]:
    """A joint of the clip and all above it, from the top."""
    names, number = [], clip.names.index(name)
    while number >= 0:
        names.append(clip.names[number])
        number = int(clip.parents[number])
    return names[::-1]


def _common(lines: Sequence[Sequence[str]]) -> list[str]:
    """What lines from the top have in common."""
    common = []
    for bones in zip(*lines, strict=False):
        if len(set(bones)) > 1:
            break
        common.append(bones[0])
    return common


def _check_order(clip: Clip, mapping: Mapping[str, str]) -> None:
    """Raise SceneError where a joint does not hang on the one that carries it in the human."""
    for joint, bone in mapping.items():
        above = PARENTS.get(joint)
        while above is not None and above not in mapping:
            above = PARENTS.get(above)
        if above is not None and mapping[above] not in _line(clip, bone)[:-1]:
            raise SceneError(
                f"mapping: '{bone}' for {joint} does not hang on '{mapping[above]}' for {above} in "
                "the clip. Correct one of them in [clip.mapping]."
            )
