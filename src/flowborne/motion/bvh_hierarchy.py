"""The first half of a BVH file: joints, how they hang together, and their channels."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from flowborne.errors import SceneError

Array = NDArray[np.float64]

CHANNEL = re.compile(r"([XYZ])(position|rotation)", re.IGNORECASE)


@dataclass
class BvhJoint:
    """A joint as the file has it.

    parent    number of the parent, -1 for the root
    line      of the file, from 1
    offset    (3,) in the file's unit and axes; NaN until its line is read
    channels  (axis, whether it turns) in the file's order; axis 0, 1, 2 for X, Y, Z
    first     column of its first channel
    end       (3,) offset of its End Site, the first if there are several
    """

    name: str
    parent: int
    line: int
    offset: Array = field(default_factory=lambda: np.full(3, np.nan))
    channels: tuple[tuple[int, bool], ...] = ()
    first: int = 0
    end: Array | None = None


def read_hierarchy(lines: list[str], name: str) -> tuple[list[BvhJoint], int]:
    """Joints, and the number of lines up to and with MOTION.

    name    of the file, for messages
    raises  SceneError with the line when the skeleton is cut or makes no sense
    """
    statements = _statements(lines)
    number, text = next(statements, (1, ""))
    if text.upper() != "HIERARCHY":
        raise SceneError(f"{name} does not begin with HIERARCHY. Give a BVH file.")
    joints: list[BvhJoint] = []
    blocks: list[int | None] = []  # open blocks: number of the joint, None for an End Site
    opening: list[int | None] = []
    for number, text in statements:
        where = f"{name}, line {number}"
        word, *after = text.split(maxsplit=1)
        keyword, rest = word.upper(), after[0] if after else ""
        if keyword == "MOTION":
            return _checked(joints, bool(blocks or opening), where), number
        if opening and text != "{":
            raise SceneError(f"{where}: '{text}' stands where a brace {{ has to. Mend the file.")
        if text == "{" and opening:
            blocks.append(opening.pop())
        elif text == "}" and blocks:
            blocks.pop()
        elif keyword == "ROOT" and not joints:
            joints.append(BvhJoint(rest, -1, number))
            opening.append(0)
        elif keyword == "JOINT" and blocks and blocks[-1] is not None:
            joints.append(BvhJoint(rest, blocks[-1], number))
            opening.append(len(joints) - 1)
        elif keyword == "END" and blocks and blocks[-1] is not None:
            opening.append(None)
        elif keyword == "OFFSET" and blocks:
            _set_offset(joints, blocks, _three(rest, where))
        elif keyword == "CHANNELS" and blocks and blocks[-1] is not None:
            joints[blocks[-1]].channels = _channels(rest, where)
        elif keyword == "ROOT":
            raise SceneError(f"{where}: a second ROOT. Keep one skeleton in the file.")
        else:
            raise SceneError(f"{where}: '{text}' is not expected here. Mend the file.")
    raise SceneError(f"{name} ends in line {number}, before MOTION: it is cut. Export it anew.")


def _statements(lines: list[str]) -> Iterator[tuple[int, str]]:
    """Line number and text of what the lines say, braces on their own."""
    for number, line in enumerate(lines, start=1):
        for part in re.split(r"([{}])", line):
            if part.strip():
                yield number, part.strip()


def _three(text: str, where: str) -> Array:
    words = text.split()
    numbers = [number_in(word) for word in words]
    if len(numbers) != 3 or not np.isfinite(numbers).all():
        raise SceneError(f"{where}: OFFSET '{text}' is not three numbers. Mend it.")
    return np.array(numbers)


def _set_offset(joints: list[BvhJoint], blocks: list[int | None], offset: Array) -> None:
    last = blocks[-1]
    if last is not None:
        joints[last].offset = offset
        return
    holder = blocks[-2]
    if holder is not None and joints[holder].end is None:
        joints[holder].end = offset


def _channels(text: str, where: str) -> tuple[tuple[int, bool], ...]:
    count, *words = text.split() or [""]
    found = [CHANNEL.fullmatch(word) for word in words]
    wrong = [word for word, match in zip(words, found, strict=True) if match is None]
    if wrong:
        raise SceneError(
            f"{where}: channel '{wrong[0]}' is not known. Give Xposition, Yposition, Zposition, "
            "Xrotation, Yrotation or Zrotation."
        )
    if count != str(len(words)):
        raise SceneError(
            f"{where}: CHANNELS says {count or 'no number'} and names {len(words)}. Mend it."
        )
    return tuple(
        ("XYZ".index(match[1].upper()), match[2].lower() == "rotation") for match in found if match
    )


def _checked(joints: list[BvhJoint], unclosed: bool, where: str) -> list[BvhJoint]:
    """The joints with their columns, if the skeleton is whole."""
    if not joints:
        raise SceneError(f"{where}: there is no ROOT before MOTION. Give a file with a skeleton.")
    if unclosed:
        raise SceneError(f"{where}: MOTION before the last closing brace. Mend the file.")
    column, lines = 0, dict[str, int]()
    for joint in joints:
        file = where.rsplit(", line", 1)[0]
        if joint.name in lines:
            raise SceneError(
                f"{file}, line {joint.line}: joint '{joint.name}' is in line {lines[joint.name]} "
                "already. Give every joint its own name."
            )
        if np.isnan(joint.offset).any():
            raise SceneError(f"{file}, line {joint.line}: '{joint.name}' has no OFFSET. Add it.")
        lines[joint.name] = joint.line
        joint.first = column
        column += len(joint.channels)
    if column == 0:
        raise SceneError(f"{where}: no joint has channels. Give a file with a motion.")
    return joints


def number_in(text: str) -> float:
    """The number that a text is; NaN when it is none."""
    try:
        return float(text)
    except ValueError:
        return math.nan
