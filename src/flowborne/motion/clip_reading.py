"""A clip's file as it is read: the motion, which joint is which, and the human's bones."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from flowborne.errors import SceneError
from flowborne.motion.bvh import check_rigid, clip_of
from flowborne.motion.bvh_file import BvhFile, load_bvh
from flowborne.motion.clip import Clip
from flowborne.motion.clip_scale import check_scale, leg_length, likely_unit, standing_axis
from flowborne.motion.human.clip_skeleton import between, skeleton_of
from flowborne.motion.human.posture import counted_from, posture_of
from flowborne.motion.human.segments import Sex
from flowborne.motion.human.skeleton import PARENTS, Skeleton
from flowborne.motion.human.soles import on_the_floor
from flowborne.motion.mapping import JOINTS, mapping_of
from flowborne.phrases import suggestion

Array = NDArray[np.float64]

STRETCH = 0.02
"""m by which the bones of a person may stretch in a file, whose joints then have their middle."""


@dataclass(frozen=True)
class Capture:
    """A clip and what it means.

    clip      the motion, of a human counted from a pose in which the person stands
    mapping   joint of the model -> joint of the clip
    skeleton  of the human with the clip's bones; None in a scene without [human]
    unit, up  m per length of the file, and its axis that is up
    rest      (n, 4) what the clip's joints are counted from, as counted by the file; None where it
              is the file's own zeros
    posture   the person's mean direction from ankles to shoulders, z up; None without [human]
    lift      (frames,) m by which the root is raised above where the file has it, or None
    held      joints of the human that the clip's file does not have
    note      what is wrong with the file's number of frames; may be empty
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
        """Joints that the human has for those of the clip between its own."""
        return set(self.mapping) - set(JOINTS) if self.skeleton is not None else set()


@dataclass(frozen=True)
class Reading:
    """How a file is read: what the motion and the bones of a person depend on.

    unit     m per length of the file; None for that which makes a person's legs as long as legs are
    up       axis of the file that is up; None for that along which a person stands
    skip     frames at the start of the file that are left out
    mapping  joint of the model -> joint of the clip, in pairs
    floor    "soles" for a person whose soles are to be on the floor
    mass     kg of a person;  sex  of whose proportions they are
    """

    unit: float | None
    up: str | None
    skip: int
    mapping: tuple[tuple[str, str], ...]
    floor: str
    mass: float
    sex: Sex


def read_clip(path: Path, how: Reading, *, person: bool) -> Capture:
    """The clip of a file, as it lies there, and not where a scene places it.

    person  whether it moves a human, whose bones are then the clip's
    raises  SceneError when the file cannot be used
    """
    return (_person if person else _creature)(path, _stamp(path), how)


@lru_cache(maxsize=8)
def _creature(path: Path, stamp: tuple[int, int], how: Reading) -> Capture:
    """The clip of a creature of any kind. Read once, though model, motion and checks ask for it."""
    bvh = _load(path, stamp)
    unit, up = 1.0 if how.unit is None else how.unit, how.up or "y"
    clip = clip_of(bvh, unit, up, how.skip)
    check_rigid(bvh, clip, clip.names)
    return Capture(
        clip,
        _named(clip, dict(how.mapping)),
        None,
        unit,
        up,
        note=bvh.note,
    )


@lru_cache(maxsize=8)
def _person(path: Path, stamp: tuple[int, int], how: Reading) -> Capture:
    """The clip of a person, in the unit and with the axis up that make one who stands, unless they
    are given."""
    bvh = _load(path, stamp)
    raw = clip_of(bvh, skip=how.skip)
    mapping = mapping_of(raw, dict(how.mapping))
    length = leg_length(raw, mapping)
    unit = likely_unit(length) if how.unit is None else how.unit
    check_scale(length, unit)
    up = how.up or standing_axis(posture_of(raw, mapping).up, "y") or "y"
    clip = clip_of(bvh, unit, up, how.skip, mapping["root"])
    lines = {bone for joint in mapping.values() for bone in _above(clip, joint)}
    check_rigid(bvh, clip, sorted(lines), STRETCH)
    posture = posture_of(clip, mapping)
    clip = counted_from(clip, posture.rest)
    skeleton = skeleton_of(clip, mapping, between(clip, mapping))
    links = {link.name: link.bone for links in skeleton.links.values() for link in links}
    height = clip.translation[:, 2]
    if how.floor == "soles":
        clip = on_the_floor(clip, mapping, skeleton, how.mass, how.sex)
    return Capture(
        clip,
        mapping | links,
        skeleton,
        unit,
        up,
        rest=posture.rest,
        posture=posture.up,
        lift=clip.translation[:, 2] - height,
        held=tuple(joint for joint in JOINTS if joint not in mapping),
        note=bvh.note,
    )


def _above(clip: Clip, joint: str) -> Iterator[str]:
    """A joint of the clip and those above it, without the root."""
    number = clip.names.index(joint)
    while number > 0:
        yield clip.names[number]
        number = int(clip.parents[number])


def with_still(found: Capture, joints: tuple[str, ...]) -> Capture:
    """The capture with joints that its file lacks, none of which turns."""
    clip, names = found.clip, dict(found.mapping)
    assert found.skeleton is not None
    for joint in joints:
        above = PARENTS[joint]
        while above not in names:
            above = PARENTS[above]
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


def _named(clip: Clip, table: Mapping[str, str]) -> Mapping[str, str]:
    """The mapping for any creature: the table itself, or joints of the same names without one."""
    problems = [
        f"the clip has no joint '{bone}' for '{joint}'{suggestion(bone, clip.names, 'It has')}"
        for joint, bone in table.items()
        if bone not in clip.names
    ]
    if problems:
        raise SceneError(problems)
    return table or {name: name for name in clip.names}


def _stamp(path: Path) -> tuple[int, int]:
    """What changes when a file does."""
    try:
        status = path.stat()
    except OSError:
        return 0, 0
    return status.st_mtime_ns, status.st_size


@lru_cache(maxsize=4)
def _load(path: Path, stamp: tuple[int, int]) -> BvhFile:
    """A file is parsed once, whatever it is read as."""
    return load_bvh(path)
