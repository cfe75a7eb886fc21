"""The mapping from joints of the human to joints of a clip.

Joints of limbs are found by name, and hips, spine and neck by their position in the tree.
"""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from importlib import resources

from flowborne.base.errors import SceneError
from flowborne.base.phrases import suggestion
from flowborne.motion.clip import Clip
from flowborne.motion.human.skeleton import JOINTS, SIDES, nearest_parent

SIDED = ("hip", "knee", "ankle", "toes", "clavicle", "shoulder", "elbow", "wrist")
"""Joints of the limbs, without their side."""

LIMBS = ("hip", "knee", "ankle", "shoulder", "elbow")
REQUIRED = ("root", *(f"{side}_{joint}" for side in SIDES for joint in LIMBS))
"""Joints that the clip of a person must have."""

HEAD, NECK = ("head", "skullbase"), ("neck", "neck1", "neck01", "necklower", "lowerneck")
"""Names of the head's joint, and of a joint in the neck, in any family."""

SIDE_WORDS = {"left": "left", "right": "right", "l": "left", "r": "right"}
"""Word in a joint's name -> side."""

FILLERS = {"jnt", "bone"}
"""Meaningless last words of joint names in some tools."""

SPINE = ("lower_back", "upper_back", "thorax")
CERVICAL = ("lower_neck", "upper_neck", "head")


@dataclass(frozen=True)
class Family:
    """Names of limb joints in a family of tools.

    names  joint of the human without its side -> possible names, by priority
    """

    name: str
    source: str
    names: Mapping[str, tuple[str, ...]]


@dataclass(frozen=True)
class ParsedName:
    """The parts of a joint's name.

    name    in the clip
    side    "left", "right" or ""
    stem    the rest in lower case, letters and digits only
    starts  positions in the stem at which a word begins
    letter  the stem if the side is one letter, else ""
    """

    name: str
    side: str
    stem: str
    starts: frozenset[int]
    letter: str

    def matches(self, known: str) -> bool:
        """Whether the stem is a known name, or ends with it at a word boundary. With "@" it must be
        the whole stem, and the side one letter."""
        if known.startswith("@"):
            return self.letter == known[1:]
        start = len(self.stem) - len(known)
        return start in self.starts and self.stem.endswith(known)


@lru_cache(maxsize=1)
def families() -> tuple[Family, ...]:
    """The names in clip_names.toml."""
    text = (resources.files("flowborne.motion.human") / "clip_names.toml").read_text("utf-8")
    return tuple(
        Family(table["name"], table["source"], {joint: tuple(table[joint]) for joint in SIDED})
        for table in tomllib.loads(text)["family"]
    )


def mapping_of(clip: Clip, table: Mapping[str, str]) -> dict[str, str]:
    """Joint of the human -> joint of the clip, for all that are found.

    table   model joint -> clip joint, which has priority. If it contains a joint of the spine, no
            other joint of the spine is guessed; the same for the neck
    raises  SceneError when the table has unknown names, when no joint is found for a hip, knee,
            ankle, shoulder or elbow, and when the joint for a child is not a descendant of the
            joint for its parent
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
    parsed = [_parsed(name) for name in clip.names]
    mapping = {**_limbs(parsed), **table}
    missing = [joint for joint in REQUIRED[1:] if joint not in mapping]
    if missing:
        raise SceneError(
            f"mapping: no joint of the clip is known for {', '.join(missing)} (looked for: "
            f"{_known_names(missing)}). Name {'it' if len(missing) == 1 else 'them'} in "
            f"[clip.mapping]. The clip's joints are: {', '.join(clip.names)}."
        )
    guess = _trunk(clip, mapping, parsed)
    for chain in (SPINE, CERVICAL[:-1]):
        if not set(chain).isdisjoint(table):
            guess = {joint: bone for joint, bone in guess.items() if joint not in chain}
    mapping = guess | mapping
    mapping = {joint: mapping[joint] for joint in JOINTS if joint in mapping}
    _check_order(clip, mapping)
    return mapping


def _known_names(missing: Iterable[str]) -> str:
    """The names by which joints are searched, for a message."""
    joints = dict.fromkeys(joint.split("_", 1)[1] for joint in missing)
    names = (n.lstrip("@") for f in families() for joint in joints for n in f.names[joint])
    return ", ".join(dict.fromkeys(names)) + ", each with left, right, l or r"


def _parsed(name: str) -> ParsedName:
    bare = name.rsplit(":", 1)[-1]
    words = [w.lower() for w in re.findall(r"[A-Z]+(?![a-z])|[A-Z]?[a-z]+|\d+", bare)]
    while words and words[-1] in FILLERS:
        words.pop()
    side = next((SIDE_WORDS[word] for word in words if word in SIDE_WORDS), "")
    short = any(word in ("l", "r") for word in words)
    if side:
        words.remove(next(word for word in words if word in SIDE_WORDS))
    else:
        side, short, words = _split_side(words)
    starts, at = set(), 0
    for word in words:
        starts.add(at)
        at += len(word)
    stem = "".join(words)
    return ParsedName(name, side, stem, frozenset(starts), stem if short else "")


def _split_side(words: list[str]) -> tuple[str, bool, list[str]]:
    """Side, whether it is one letter, and the rest of a name without separator, such as "lfemur" or
    "hipleft"."""
    known = {name for family in families() for names in family.names.values() for name in names}
    whole = "".join(words)
    for word, side in SIDE_WORDS.items():
        if whole.startswith(word) and whole[len(word) :] in known:
            return side, len(word) == 1, [whole[len(word) :]]
        if len(word) > 1 and whole.endswith(word) and whole[: -len(word)] in known:
            return side, False, [whole[: -len(word)]]
    return "", False, words


def _limbs(parsed: Sequence[ParsedName]) -> dict[str, str]:
    """Joints of the limbs by the family that matches most of the names, and the head's joint."""
    limbs = max((_by_family(family, parsed) for family in families()), key=len)
    central = [one for one in parsed if not one.side]
    head = _first(HEAD, central)
    return limbs | ({"head": head} if head is not None else {})


def _by_family(family: Family, parsed: Sequence[ParsedName]) -> dict[str, str]:
    result = {}
    for side in SIDES:
        remaining = [one for one in parsed if one.side == side]
        longest = sorted(family.names.items(), key=lambda item: -max(map(len, item[1])))
        for joint, names in longest:  # "upleg" before "leg", which it ends with
            bone = _first(names, remaining)
            if bone is not None:
                result[f"{side}_{joint}"] = bone
                remaining = [
                    one for one in remaining if not any(one.matches(name) for name in names)
                ]
    return result


def _first(names: Iterable[str], among: Sequence[ParsedName]) -> str | None:
    """The joint that matches the first possible name; the shortest stem is preferred."""
    for name in names:
        found = [one for one in among if one.matches(name)]
        if found:
            return min(found, key=lambda one: len(one.stem)).name
    return None


def _trunk(clip: Clip, mapping: Mapping[str, str], parsed: Sequence[ParsedName]) -> dict[str, str]:
    """Root, spine and neck: the common ancestors of the limbs, and the joints between them.

    If a spine or neck has fewer joints than the human's, the middle ones stay unmapped; if it has
    more, the joints below its last one are not used.
    """
    lines = {joint: _line(clip, bone) for joint, bone in mapping.items()}
    arms = [lines[j] for j in lines if j.endswith(("_clavicle", "_shoulder"))]
    legs = [lines[f"{side}_hip"] for side in SIDES]
    root = mapping.get("root") or _common([*legs, *arms])[-1]
    top = mapping.get("head") or _first(NECK, [one for one in parsed if not one.side])
    neck = [] if top is None else _line(clip, top)
    chest = mapping.get("thorax") or _common([*arms, *([neck] if neck else [])])[-1]
    spine = [bone for bone in _line(clip, chest) if root in _line(clip, bone)[:-1]]
    above = [bone for bone in neck if chest in _line(clip, bone)[:-1]]
    found = {"root": root} | _spread(SPINE, spine)
    if "head" in mapping:
        found |= _spread(CERVICAL, above)
    else:
        found |= dict(zip(CERVICAL[:-1], above, strict=False))
    return found


def _spread(joints: tuple[str, str, str], bones: Sequence[str]) -> dict[str, str]:
    """The human's three joints for a chain of clip joints: the ends first, then the middle."""
    low, middle, high = joints
    if len(bones) < 2:
        only = high if high == "head" else low
        return dict.fromkeys([only], bones[0]) if bones else {}
    ends = {low: bones[0], high: bones[-1]}
    return ends | ({middle: bones[1]} if len(bones) > 2 else {})


def _line(clip: Clip, name: str) -> list[str]:
    """A joint of the clip and its ancestors, from the root."""
    return [clip.names[number] for number in reversed(clip.lineage(name))]


def _common(lines: Sequence[Sequence[str]]) -> list[str]:
    """The common beginning of lines from the root."""
    common = []
    for bones in zip(*lines, strict=False):
        if len(set(bones)) > 1:
            break
        common.append(bones[0])
    return common


def _check_order(clip: Clip, mapping: Mapping[str, str]) -> None:
    """Raise SceneError unless each mapped joint is a descendant of the joint for its parent."""
    for joint, bone in mapping.items():
        if joint == "root":
            continue
        above = nearest_parent(joint, mapping)
        if mapping[above] not in _line(clip, bone)[:-1]:
            raise SceneError(
                f"mapping: '{bone}' for {joint} is not below '{mapping[above]}' for {above} in "
                "the clip. Correct one of them in [clip.mapping]."
            )
