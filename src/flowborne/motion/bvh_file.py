"""The text of a BVH file, taken apart: skeleton, channels and a row of numbers per frame.

No library is used: pybvh 0.9, the one that is maintained, refuses joints that have 1, 2 or 6
channels and frames that go over several lines, cuts names at their first space, rounds the frame
time and lets NaN pass.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from flowborne.errors import SceneError
from flowborne.files.given import read_file
from flowborne.motion.bvh_hierarchy import BvhJoint, number_in, read_hierarchy

Array = NDArray[np.float64]


@dataclass
class BvhFile:
    """A BVH file.

    name        of the file, for messages
    encoding    of its text
    hierarchy   its text before the line of the number of frames
    joints      in the file's order: parents before children
    time_text   the frame time as it is written
    frame_time  s
    rows        text of each frame
    lines       line of the file where each frame begins, from 1
    values      (frames, channels) in the file's unit and degrees
    note        what is wrong with the number of frames; may be empty
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
    """Read a BVH file. Raises SceneError with the line when it is none, is cut or is no number."""
    try:
        raw = read_file(path)
    except FileNotFoundError:
        raise SceneError(f"there is no file {path}. Correct the name.") from None
    except OSError as error:
        raise SceneError(f"{path} cannot be read ({error}). Give a BVH file.") from None
    text, encoding = _decoded(raw)
    lines = text.splitlines()
    joints, after = read_hierarchy(lines, str(path))
    frames, time_text, frame_time, after_header, at = _motion_header(lines, after, str(path))
    hierarchy = "".join(text.splitlines(keepends=True)[:at])
    bvh = BvhFile(str(path), encoding, hierarchy, joints, time_text, frame_time)
    _read_rows(bvh, lines, after_header, frames)
    return bvh


def _decoded(raw: bytes) -> tuple[str, str]:
    """Old tools write names in the code page of their country: then every byte is a letter."""
    encoding = "utf-8-sig" if raw.startswith(b"\xef\xbb\xbf") else "utf-8"
    try:
        return raw.decode(encoding), encoding
    except UnicodeDecodeError:
        return raw.decode("latin-1"), "latin-1"


def _motion_header(lines: list[str], after: int, name: str) -> tuple[int, str, float, int, int]:
    """Frames, frame time as text and in s, lines before the first frame, lines before 'Frames'."""
    filled = [n for n in range(after, len(lines)) if lines[n].strip()][:2]
    if len(filled) < 2:
        raise SceneError(f"{name} ends after MOTION: it is cut. Export it anew.")
    head, second = filled
    count = re.fullmatch(r"\s*Frames\s*:\s*(\d+)\s*", lines[head], re.IGNORECASE)
    if count is None:
        raise SceneError(f"{name}, line {head + 1}: not 'Frames: ' and a number. Mend the file.")
    given = re.fullmatch(r"\s*Frame\s*Time\s*:\s*(\S+)\s*", lines[second], re.IGNORECASE)
    time = number_in(given[1]) if given else math.nan
    if given is None or not (math.isfinite(time) and time > 0.0):
        raise SceneError(
            f"{name}, line {second + 1}: '{lines[second].strip()}' gives no frame time above 0 s. "
            "Give one, such as 'Frame Time: 0.008333'."
        )
    return int(count[1]), given[1], time, second + 1, head


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
                f"skeleton {width} channels. Mend the line."
            )
        if len(held) == width:
            bvh.rows.append(line if len(words) == width else " ".join(held))
            values.append(_row(bvh, held, len(values)))
            held = []
    if not values:
        raise SceneError(f"{bvh.name} has no frame. Give a clip that has a motion.")
    if len(values) != frames or held:
        rest = f" and {len(held)} of the {width} values of another, left out" if held else ""
        bvh.note = f"says {frames} frames and has {len(values)}{rest}"
    bvh.values = np.array(values)


def _row(bvh: BvhFile, words: list[str], frame: int) -> Array:
    try:
        row = np.array(words, dtype=np.float64)
    except ValueError:
        row = np.array([number_in(word) for word in words])
    if np.isfinite(row).all():
        return row
    column = int(np.flatnonzero(~np.isfinite(row))[0])
    joint = next(j for j in reversed(bvh.joints) if j.channels and j.first <= column)
    raise SceneError(
        f"{bvh.name}, line {bvh.lines[frame]}: '{words[column]}' in frame {frame + 1}, joint "
        f"'{joint.name}', is not a finite number. Mend the frame or export the clip anew."
    )
