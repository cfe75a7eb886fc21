"""A BVH file: its joints and channels, its frames, and the angles in it.

The angles (a, b, c) with the axes (i, j, k) stand for the rotation R_i(a) R_j(b) R_k(c).
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from flowborne.base.errors import SceneError
from flowborne.base.given import read_file
from flowborne.kernels.arrays import Array, Mask
from flowborne.motion.quaternions import about, product

MAX_NUMBER = 1e9
"""Largest number of a clip, in its unit of length or degrees: beyond any creature in any unit."""

GIMBAL_LOCK_COSINE = 1e-7
"""Cosine of the middle angle below which only the sum or difference of the others is defined."""

CHANNEL = re.compile(r"([XYZ])(position|rotation)", re.IGNORECASE)


def quaternions_of(angles: Array, axes: Array) -> Array:
    """(frames, 4) rotations of angles (frames, k) in degrees about unit axes (k, 3)."""
    result = np.tile([1.0, 0.0, 0.0, 0.0], (len(angles), 1))
    for column, axis in zip(np.deg2rad(angles).T, axes, strict=True):
        result = product(result, about(axis, column))
    return result


def angles_of(rotations: Array, order: tuple[int, int, int], start: Array) -> Array:
    """(frames, 3) angles in degrees, in each frame closest to those of the frame before.

    rotations  (frames, 4) unit quaternions
    order      axes of the three angles, a permutation of 0, 1, 2
    start      (3,) reference angles for the first frame; in gimbal lock (middle angle 90 degrees)
               they also set how the first and the last angle share the rotation
    note       each rotation has two triples of angles: (a, b, c) and (a + 180, 180 - b, c + 180)
    """
    i, j, k = order
    parity = 1.0 if (j - i) % 3 == 1 else -1.0
    R = Rotation.from_quat(rotations, scalar_first=True).as_matrix()
    cosine = np.hypot(R[:, i, i], R[:, i, j])
    first = np.arctan2(-parity * R[:, j, k], R[:, k, k])
    middle = np.arctan2(parity * R[:, i, k], cosine)
    last = np.arctan2(-parity * R[:, i, j], R[:, i, i])
    combined = np.rad2deg(np.arctan2(parity * R[:, k, j], R[:, j, j]))
    angles = np.rad2deg(np.stack([first, middle, last], axis=-1))
    nearest = np.array(start)
    for frame, found in enumerate(angles):
        if cosine[frame] > GIMBAL_LOCK_COSINE:
            both = np.stack([found, [found[0] + 180.0, 180.0 - found[1], found[2] + 180.0]])
        else:
            sense = parity * np.sign(found[1])
            change = _wrapped(combined[frame] - nearest[0] - sense * nearest[2]) / 2.0
            both = nearest + np.array([[change, 0.0, sense * change]])
            both[:, 1] = found[1]
        steps = _wrapped(both - nearest)
        nearest = nearest + steps[np.argmin(np.sum(steps**2, axis=1))]
        angles[frame] = nearest
    return angles


def _wrapped(degrees: Array) -> Array:
    """Degrees wrapped to -180 to 180."""
    return (degrees + 180.0) % 360.0 - 180.0


@dataclass
class BvhJoint:
    """A joint of the file.

    parent    number of the parent, -1 for the root
    line      line of the file, from 1
    offset    (3,) in the file's unit and axes; NaN until its line is read
    channels  (axis, whether it is a rotation) in the file's order; axis 0, 1, 2 for X, Y, Z
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

    def columns(self, *, rotations: bool) -> tuple[list[int], list[int]]:
        """Columns and axes of its rotation channels, or of its position channels."""
        found = [
            (self.first + n, axis)
            for n, (axis, turns) in enumerate(self.channels)
            if turns == rotations
        ]
        return [column for column, _ in found], [axis for _, axis in found]


def read_hierarchy(lines: list[str], name: str) -> tuple[list[BvhJoint], int]:
    """Joints, and the number of lines up to and including MOTION.

    name    name of the file, for messages
    raises  SceneError with the line when the skeleton is cut or invalid
    """
    statements = _statements(lines)
    number, text = next(statements, (1, ""))
    if text.upper() != "HIERARCHY":
        raise SceneError(f"{name} does not begin with HIERARCHY. Give a BVH file.")
    joints: list[BvhJoint] = []
    blocks: list[int | None] = []  # open blocks: number of the joint, None for an End Site
    opening: list[int | None] = []  # the block whose brace comes next
    for number, text in statements:
        where = f"{name}, line {number}"
        word, *after = text.split(maxsplit=1)
        keyword, rest = word.upper(), after[0] if after else ""
        if keyword == "MOTION":
            return _checked(joints, bool(blocks or opening), where), number
        if opening and text != "{":
            raise SceneError(f"{where}: '{text}' is not the expected brace {{. Correct the file.")
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
            raise SceneError(f"{where}: '{text}' is not expected here. Correct the file.")
    raise SceneError(f"{name} ends in line {number}, before MOTION: it is cut. Export it again.")


def _statements(lines: list[str]) -> Iterator[tuple[int, str]]:
    """Line number and text of the statements, with braces as separate statements."""
    for number, line in enumerate(lines, start=1):
        for part in re.split(r"([{}])", line):
            if part.strip():
                yield number, part.strip()


def _usable(numbers: Array) -> Mask:
    """Which numbers are finite, and no larger than MAX_NUMBER."""
    return np.abs(numbers) <= MAX_NUMBER  # false for nan


def _three(text: str, where: str) -> Array:
    words = text.split()
    numbers = [number_in(word) for word in words]
    if len(numbers) != 3 or not _usable(np.array(numbers)).all():
        raise SceneError(
            f"{where}: OFFSET '{text}' is not three numbers of at most {MAX_NUMBER:g}. Correct it."
        )
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
            f"{where}: CHANNELS says {count or 'no number'} and names {len(words)}. Correct it."
        )
    return tuple(
        ("XYZ".index(match[1].upper()), match[2].lower() == "rotation") for match in found if match
    )


def _checked(joints: list[BvhJoint], unclosed: bool, where: str) -> list[BvhJoint]:
    """The joints with their columns, if the skeleton is complete."""
    if not joints:
        raise SceneError(f"{where}: there is no ROOT before MOTION. Give a file with a skeleton.")
    if unclosed:
        raise SceneError(f"{where}: MOTION before the last closing brace. Correct the file.")
    column, lines = 0, dict[str, int]()
    for joint in joints:
        file = where.rsplit(", line", 1)[0]
        if joint.name in lines:
            raise SceneError(
                f"{file}, line {joint.line}: joint '{joint.name}' is already in line "
                f"{lines[joint.name]}. Give every joint a different name."
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
    """The number in a text; NaN without one."""
    try:
        return float(text)
    except ValueError:
        return math.nan


@dataclass
class BvhFile:
    """A BVH file.

    name        of the file, for messages
    encoding    of its text
    hierarchy   its text before the line of the number of frames
    joints      in the file's order: parents before children
    time_text   the frame time as written
    frame_time  s
    rows        text of each frame
    lines       line of the file where each frame begins, from 1
    values      (frames, channels) in the file's unit and degrees
    note        mismatch between stated and actual number of frames; may be empty
    """

    name: str
    encoding: str
    hierarchy: str
    joints: list[BvhJoint]
    time_text: str
    frame_time: float
    rows: list[str] = field(default_factory=list)
    lines: list[int] = field(default_factory=list)
    values: Array = field(default_factory=lambda: np.empty((0, 0)))
    note: str = ""


def load_bvh(path: Path) -> BvhFile:
    """Read a BVH file. Raises SceneError with the line for a missing, truncated or invalid file."""
    try:
        raw = read_file(path)
    except FileNotFoundError:
        raise SceneError(f"there is no file {path}. Correct the name.") from None
    except OSError as error:
        raise SceneError(f"{path} cannot be read ({error}). Give a BVH file.") from None
    text, encoding = _decoded(raw)
    lines = text.splitlines()
    joints, after = read_hierarchy(lines, str(path))
    filled = [n for n in range(after, len(lines)) if lines[n].strip()][:2]
    if len(filled) < 2:
        raise SceneError(f"{path} ends after MOTION: it is cut. Export it again.")
    head, second = filled
    count = re.fullmatch(r"\s*Frames\s*:\s*(\d+)\s*", lines[head], re.IGNORECASE)
    if count is None:
        raise SceneError(f"{path}, line {head + 1}: not 'Frames: ' and a number. Correct the file.")
    given = re.fullmatch(r"\s*Frame\s*Time\s*:\s*(\S+)\s*", lines[second], re.IGNORECASE)
    time = number_in(given[1]) if given else math.nan
    if given is None or not (math.isfinite(time) and time > 0.0):
        raise SceneError(
            f"{path}, line {second + 1}: '{lines[second].strip()}' gives no frame time above 0 s. "
            "Give one, such as 'Frame Time: 0.008333'."
        )
    hierarchy = "".join(text.splitlines(keepends=True)[:head])
    bvh = BvhFile(str(path), encoding, hierarchy, joints, given[1], time)
    _read_rows(bvh, lines, second + 1, int(count[1]))
    return bvh


def _decoded(raw: bytes) -> tuple[str, str]:
    """Text and encoding: UTF-8, or else Latin-1, in which every byte is valid."""
    encoding = "utf-8-sig" if raw.startswith(b"\xef\xbb\xbf") else "utf-8"
    try:
        return raw.decode(encoding), encoding
    except UnicodeDecodeError:
        return raw.decode("latin-1"), "latin-1"


def _read_rows(bvh: BvhFile, lines: list[str], after: int, frames: int) -> None:
    width = sum(len(joint.channels) for joint in bvh.joints)
    held: list[str] = []
    values: list[Array] = []
    for number, line in enumerate(lines[after:], start=after + 1):
        words = line.split()
        if not words:
            continue
        if not held:
            bvh.lines.append(number)
        held += words
        if len(held) > width:
            begin, count = bvh.lines[-1], len(held) - (len(words) if number > bvh.lines[-1] else 0)
            raise SceneError(
                f"{bvh.name}, line {begin}: frame {len(values) + 1} has {count} values and the "
                f"skeleton {width} channels. Correct the line."
            )
        if len(held) == width:
            bvh.rows.append(line if len(words) == width else " ".join(held))
            values.append(_row(bvh, held, len(values)))
            held = []
    if not values:
        raise SceneError(f"{bvh.name} has no frames. Give a clip with a motion.")
    if len(values) != frames or held:
        rest = f" and {len(held)} of the {width} values of another, left out" if held else ""
        bvh.note = f"says {frames} frames and has {len(values)}{rest}"
    bvh.values = np.array(values)


def _row(bvh: BvhFile, words: list[str], frame: int) -> Array:
    try:
        row = np.array(words, dtype=np.float64)
    except ValueError:
        row = np.array([number_in(word) for word in words])
    usable = _usable(row)
    if usable.all():
        return row
    column = int(np.flatnonzero(~usable)[0])
    joint = next(j for j in reversed(bvh.joints) if j.channels and j.first <= column)
    raise SceneError(
        f"{bvh.name}, line {bvh.lines[frame]}: '{words[column]}' in frame {frame + 1}, joint "
        f"'{joint.name}', is not a number of at most {MAX_NUMBER:g}. "
        "Correct the frame or export the clip again."
    )
