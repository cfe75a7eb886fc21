"""Reading of a clip's file: its unit and up axis, the mapping of its joints, the human's
skeleton."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path

import numpy as np

from flowborne.base.errors import SceneError
from flowborne.base.phrases import suggestion
from flowborne.kernels.arrays import Array
from flowborne.motion.bvh import TO_WORLD, check_rigid, clip_of
from flowborne.motion.bvh_file import BvhFile, load_bvh
from flowborne.motion.clip import Clip
from flowborne.motion.human.clip_skeleton import between, skeleton_of
from flowborne.motion.human.posture import posture_of, relative_to_pose
from flowborne.motion.human.segments import Sex
from flowborne.motion.human.skeleton import JOINTS, Skeleton, nearest_parent
from flowborne.motion.human.soles import with_soles_on_floor
from flowborne.motion.mapping import mapping_of

MIN_LEG_LENGTH, MAX_LEG_LENGTH = 0.2, 2.0
"""m from hip to ankle, limits for any person."""

ADULT_LEG_LENGTHS = (0.65, 1.1)
"""m from hip to ankle, range for adults."""

STANDARD_LEG_LENGTH = 0.856
"""m from hip to ankle, of the standard skeleton."""

MIN_STANDING_COSINE = 0.5
"""Least cosine of the angle between a standing person and the vertical."""

UNITS = {0.001: "mm", 0.01: "cm", 0.0254: "inches", 0.056444: "CMU's own", 0.3048: "feet", 1.0: "m"}

MAX_PERSON_STRETCH = 0.02
"""Largest deviation of a person's joint from the end of its rigid bone, m."""


def leg_length(clip: Clip, mapping: Mapping[str, str]) -> float:
    """Length along the bones from hip to ankle, mean of both legs, in the clip's unit."""
    lengths = []
    for side in ("left", "right"):
        line = clip.lineage(mapping[f"{side}_ankle"])
        leg = line[: line.index(clip.names.index(mapping[f"{side}_hip"]))]
        lengths.append(sum(float(np.linalg.norm(clip.offsets[bone])) for bone in leg))
    return sum(lengths) / 2.0


def likely_unit(length: float) -> float:
    """m per length of a file with legs of this length: the first known unit that gives an adult's
    legs, or else the unit that gives the legs of the standard skeleton.

    raises  SceneError for legs of length 0
    """
    if length <= 0.0:
        raise SceneError(
            "its legs have no length from hip to ankle. Correct the mapping or the file."
        )
    low, high = ADULT_LEG_LENGTHS
    known = next((unit for unit in UNITS if low <= length * unit <= high), None)
    return float(f"{STANDARD_LEG_LENGTH / length:.3g}") if known is None else known


def unit_text(unit: float) -> str:
    """A unit with its name, if it has one: "0.01 (cm)"."""
    return f"{unit:g}" + (f" ({UNITS[unit]})" if unit in UNITS else "")


def check_scale(length: float, unit: float) -> None:
    """Raise SceneError for a length that no person's leg has.

    length  from hip to ankle, in the file's unit
    unit    m per length of the file
    """
    if not MIN_LEG_LENGTH <= length * unit <= MAX_LEG_LENGTH:
        raise SceneError(
            f"with unit = {unit:g} its legs are {length * unit:.3g} m long from hip to ankle. "
            f"Set unit = {unit_text(likely_unit(length))}, or leave it out."
        )


def standing_axis(up: Array, read_as: str) -> str | None:
    """The up axis of a file with which its person stands, preferably "y"; None if the person lies
    with any axis.

    up       (3,) of a posture: mean direction from ankles to shoulders
    read_as  up axis with which the clip was read
    """
    in_file = TO_WORLD[read_as].T @ up
    along = {axis: float((world @ in_file)[2]) for axis, world in TO_WORLD.items()}
    standing = [axis for axis, cosine in along.items() if cosine >= MIN_STANDING_COSINE]
    return max(standing, key=lambda axis: (axis == "y", along[axis]), default=None)


@dataclass(frozen=True)
class Capture:
    """A clip and its interpretation.

    clip      the motion; for a human, relative to a standing pose
    mapping   joint of the model -> joint of the clip
    skeleton  of the human with the clip's bones; None in a scene without [human]
    unit, up  m per length of the file, and its up axis
    rest      (n, 4) rotations of the joints in the reference pose, relative to the zeros of the
              file; None if the zeros are the reference
    posture   (3,) the person's mean direction from ankles to shoulders, z up; None without [human]
    lift      (frames,) height added to the root of the file, m, or None
    held      joints of the human that the file lacks
    note      mismatch in the number of frames of the file; may be empty
    """

    clip: Clip
    mapping: Mapping[str, str]
    skeleton: Skeleton | None
    unit: float = 1.0
    up: str = "y"
    rest: Array | None = None
    posture: Array | None = None
    lift: Array | None = None
    held: tuple[str, ...] = ()
    note: str = ""

    @property
    def links(self) -> set[str]:
        """Joints of the model for additional joints of the clip between two of the human."""
        return set(self.mapping) - set(JOINTS) if self.skeleton is not None else set()


@dataclass(frozen=True)
class Reading:
    """Settings for reading a file.

    unit     m per length of the file; None for the unit that gives the legs a plausible length
    up       up axis of the file; None for the axis with which the person stands
    skip     frames to drop at the start of the file
    mapping  joint of the model -> joint of the clip, in pairs
    floor    "soles" to put the soles of a person on the floor
    mass     of a person, kg
    sex      for the proportions of a person
    """

    unit: float | None
    up: str | None
    skip: int
    mapping: tuple[tuple[str, str], ...]
    floor: str
    mass: float
    sex: Sex


def read_clip(path: Path, how: Reading, *, person: bool) -> Capture:
    """The clip of a file, before a scene applies offset and heading.

    person  whether it moves a human, which gets the bones of the clip
    raises  SceneError when the file cannot be used
    """
    return (_person if person else _creature)(path, _stamp(path), how)


@lru_cache(maxsize=8)
def _creature(path: Path, stamp: tuple[int, int], how: Reading) -> Capture:
    """The clip of any creature, cached for model, motion and checks."""
    bvh = _load(path, stamp)
    unit, up = 1.0 if how.unit is None else how.unit, how.up or "y"
    clip = clip_of(bvh, unit, up, how.skip)
    check_rigid(bvh, clip, clip.names)
    return Capture(clip, _checked(clip, dict(how.mapping)), None, unit, up, note=bvh.note)


@lru_cache(maxsize=8)
def _person(path: Path, stamp: tuple[int, int], how: Reading) -> Capture:
    """The clip of a person, cached as well; by default its unit and up axis are determined."""
    bvh = _load(path, stamp)
    raw = clip_of(bvh, skip=how.skip)
    mapping = mapping_of(raw, dict(how.mapping))
    length = leg_length(raw, mapping)
    unit = likely_unit(length) if how.unit is None else how.unit
    check_scale(length, unit)
    up = how.up or standing_axis(posture_of(raw, mapping)[1], "y") or "y"
    clip = clip_of(bvh, unit, up, how.skip, mapping["root"])
    used = {number for joint in mapping.values() for number in clip.lineage(joint)} - {0}
    check_rigid(bvh, clip, sorted(clip.names[n] for n in used), MAX_PERSON_STRETCH)
    rest, posture = posture_of(clip, mapping)
    clip = relative_to_pose(clip, rest)
    skeleton = skeleton_of(clip, mapping, between(clip, mapping))
    links = {link.name: link.bone for links in skeleton.links.values() for link in links}
    height = clip.translation[:, 2]
    if how.floor == "soles":
        clip = with_soles_on_floor(clip, mapping, skeleton, how.mass, how.sex)
    return Capture(
        clip,
        mapping | links,
        skeleton,
        unit,
        up,
        rest=rest,
        posture=posture,
        lift=clip.translation[:, 2] - height,
        held=tuple(joint for joint in JOINTS if joint not in mapping),
        note=bvh.note,
    )


def with_held_joints(found: Capture, joints: tuple[str, ...]) -> Capture:
    """The capture with joints that its file lacks, held at rest."""
    clip, names = found.clip, dict(found.mapping)
    assert found.skeleton is not None
    for joint in joints:
        above = nearest_parent(joint, names)
        parent = clip.names.index(names[above])
        name = f"{joint} (held)"
        still = np.tile([1.0, 0.0, 0.0, 0.0], (clip.frames, 1, 1))
        clip = replace(
            clip,
            names=(*clip.names, name),
            parents=np.append(clip.parents, parent),
            offsets=np.vstack([clip.offsets, found.skeleton[joint] - found.skeleton[above]]),
            rotations=np.concatenate([clip.rotations, still], axis=1),
        )
        names[joint] = name
    return replace(found, clip=clip, mapping=names)


def _checked(clip: Clip, table: Mapping[str, str]) -> Mapping[str, str]:
    """The mapping for any creature: the table, or equal names for an empty table."""
    problems = [
        f"the clip has no joint '{bone}' for '{joint}'{suggestion(bone, clip.names, 'It has')}"
        for joint, bone in table.items()
        if bone not in clip.names
    ]
    if problems:
        raise SceneError(problems)
    return table or {name: name for name in clip.names}


def _stamp(path: Path) -> tuple[int, int]:
    """A cache key that changes with the file."""
    try:
        status = path.stat()
    except OSError:
        return 0, 0
    return status.st_mtime_ns, status.st_size


@lru_cache(maxsize=4)
def _load(path: Path, stamp: tuple[int, int]) -> BvhFile:
    """The parsed file, cached for all uses."""
    return load_bvh(path)
