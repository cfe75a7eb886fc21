"""BVH texts in every manner in which tools write them, beside what they mean."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from flowborne.kernels.arrays import Array

CHAIN = """HIERARCHY
ROOT Hips
{
  OFFSET 0 0 0
  CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation
  JOINT Left Knee
  {
    OFFSET 0 -4 0.5
    CHANNELS 3 Zrotation Yrotation Xrotation
    End Site
    {
      OFFSET 0 -3 0
    }
  }
}
MOTION
Frames: 3
Frame Time: 0.0083333
0 9 1  0 0 0  10 20 30
0.1 9 1  0 0 45  11 21 31
0.2 9 1  0 0 90  12 22 32
"""
"""A small clip that is right; tests of errors break it."""


@dataclass
class Written:
    """A BVH text and what it says, in its own axes and unit.

    raw        its bytes
    names      of the joints
    parents    number of the parent, -1 for the root
    offsets    (n, 3) from the parent; of the root: where it is if no channel says it
    rotations  per joint one Rotation of all frames, relative to the parent
    places     (frames, 3) of the root
    values     (frames, channels)
    """

    raw: bytes
    names: list[str]
    parents: list[int]
    offsets: Array
    rotations: list[Rotation]
    places: Array
    values: Array


@st.composite
def written(draw: st.DrawFn, full: bool = False) -> Written:
    """Clips of a few joints and frames. full: every joint has three rotation channels."""
    rng = np.random.default_rng(draw(st.integers(0, 2**32)))
    count, frames = draw(st.integers(1, 6)), draw(st.integers(1, 4))
    parents = [-1] + [int(rng.integers(max(0, n - 2), n)) for n in range(1, count)]
    parents = _depth_first(parents)
    forms = [
        str(rng.choice(["Hips", "left knee", "mixamorig:Arm", "Bein.L", "頭"])) for _ in parents
    ]
    names = [f"{form} {n}" if " " in form else f"{form}{n}" for n, form in enumerate(forms)]
    offsets = np.round(rng.normal(size=(count, 3)), 4)
    places = np.tile(offsets[0], (frames, 1))
    channels, columns, rotations = [], [], []
    for joint in range(count):
        names_of, numbers, rotation = _rotation_channels(rng, frames, full)
        rotations.append(rotation)
        if joint == 0:
            for axis in range(3):
                at = int(rng.integers(len(names_of) + 1))
                places[:, axis] = np.round(rng.normal(size=frames), 4)
                names_of.insert(at, "XYZ"[axis] + "position")
                numbers.insert(at, places[:, axis].copy())
        elif rng.random() < 0.3:
            whole = rng.random() < 0.5
            for axis in range(3):
                names_of.insert(axis, "XYZ"[axis] + "position")
                numbers.insert(axis, np.full(frames, offsets[joint, axis] if whole else 0.0))
        channels.append(names_of)
        columns += numbers
    values = np.array(columns).T.reshape(frames, -1)
    raw = _written(rng, names, parents, offsets, channels, values)
    return Written(raw, names, parents, offsets, rotations, places, values)


def _depth_first(parents: list[int]) -> list[int]:
    """The same tree numbered in the order in which a file lists it."""
    order: list[int] = []

    def visit(joint: int) -> None:
        order.append(joint)
        for child, parent in enumerate(parents):
            if parent == joint:
                visit(child)

    visit(0)
    return [-1 if parents[j] < 0 else order.index(parents[j]) for j in order]


def _rotation_channels(
    rng: np.random.Generator, frames: int, full: bool
) -> tuple[list[str], list[Array], Rotation]:
    count = 3 if full else int(rng.choice([1, 2, 3, 3, 3]))
    axes = rng.permutation(3)[:count]
    angles = np.round(rng.uniform(-200.0, 200.0, (frames, count)), 4)
    order = "".join("XYZ"[axis] for axis in axes)
    rotation = Rotation.from_euler(order, angles, degrees=True)
    return [axis + "rotation" for axis in order], list(angles.T), rotation


def _written(
    rng: np.random.Generator,
    names: list[str],
    parents: list[int],
    offsets: Array,
    channels: list[list[str]],
    values: Array,
) -> bytes:
    tab = str(rng.choice(["\t", "  ", ""]))
    gap = str(rng.choice([" ", "\t", "  "]))

    def block(joint: int, depth: int) -> list[str]:
        kind = "ROOT" if joint == 0 else "JOINT"
        brace = [f"{kind} {names[joint]} {{"] if tab == "" else [f"{kind} {names[joint]}", "{"]
        inside = [
            "OFFSET" + gap + gap.join(f"{x:.6e}" for x in offsets[joint]),
            "CHANNELS" + gap + gap.join([str(len(channels[joint])), *channels[joint]]),
        ]
        children = [child for child, parent in enumerate(parents) if parent == joint]
        below = [line for child in children for line in block(child, depth + 1)]
        if not children or rng.random() < 0.2:
            for _ in range(int(rng.integers(1, 3))):
                below += ["End Site", "{", tab + "OFFSET 0 1.5 0", "}"]
        return [tab * depth + line for line in [*brace, *inside, *below, "}"]]

    lines = ["HIERARCHY", *block(0, 0), "MOTION", f"Frames:{gap}{len(values)}"]
    lines.append(f"Frame Time:{gap}.0083333")
    split = rng.random() < 0.3 and values.shape[1] > 3
    for row in values:
        words = [f"{x:.8g}" if rng.random() < 0.7 else f"{x:.10e}" for x in row]
        parts = [words[:3], words[3:]] if split else [words]
        lines += [gap.join(part) for part in parts]
    if rng.random() < 0.5:
        for _ in range(3):
            lines.insert(int(rng.integers(1, len(lines))), tab)
    end = str(rng.choice(["\n", "\r\n"]))
    text = end.join(lines) + (end if rng.random() < 0.5 else "")
    bom = b"\xef\xbb\xbf" if rng.random() < 0.3 else b""
    return bom + text.encode()
