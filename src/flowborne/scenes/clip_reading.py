"""A clip's file as a scene reads it: the motion, which joint is which, and the human's bones."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from flowborne.errors import SceneError
from flowborne.io.bvh import check_rigid, clip_of
from flowborne.io.bvh_file import BvhFile, load_bvh
from flowborne.io.clip import Clip
from flowborne.scenes.clip_scale import check_scale, leg_length, likely_unit, standing_axis
from flowborne.scenes.human.clip_skeleton import between, skeleton_of
from flowborne.scenes.human.posture import counted_from, posture_of
from flowborne.scenes.human.segments import Sex
from flowborne.scenes.human.skeleton import PARENTS, Skeleton
from flowborne.scenes.human.soles import on_the_floor
from flowborne.scenes.mapping import JOINTS, mapping_of
from flowborne.scenes.schema import Scene
from flowborne.scenes.schema_human import HumanTable
from flowborne.scenes.wording import suggestion

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


def read_clip(scene: Scene) -> Capture:
    """The clip of the file of a scene, as it lies there, and not where the scene places it.

    raises  SceneError when the file cannot be used
    """
    assert scene.clip is not None
    assert scene.clip.file is not None
    path = scene.folder / scene.clip.file
    read = _person if scene.human is not None else _creature
    return read(path, _stamp(path), _Reading.of(scene))


@dataclass(frozen=True)
class _Reading:
    """How a file is read: of [clip] and [human], what the motion and the bones depend on."""

    unit: float | None
    up: str | None
    skip: int
    mapping: tuple[tuple[str, str], ...]
    floor: str
    mass: float
    sex: Sex

    @classmethod
    def of(cls, scene: Scene) -> _Reading:
        assert scene.clip is not None
        table, human = scene.clip, scene.human or HumanTable()
        return cls(
            None if table.unit == "auto" else table.unit,
            None if table.up == "auto" else table.up,
            table.skip,
            tuple(table.mapping.items()),
            table.floor,
            human.mass,
            human.sex,
        )


@lru_cache(maxsize=8)
def _creature(path: Path, stamp: tuple[int, int], how: _Reading) -> Capture:
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
def _person(path: Path, stamp: tuple[int, int], how: _Reading) -> Capture:
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
