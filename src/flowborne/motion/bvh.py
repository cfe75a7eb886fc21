"""BVH in and out.

In most BVH files y is up, and the character faces +z with its left at +x. In files with z up, its
left is at +x too, so it faces -y (as in Blender). Lengths have no unit, angles are in degrees, and
the rotation of a joint is the product of its rotation channels in the order of the file.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path

import numpy as np

from flowborne.base.atomic import write_atomically, write_text
from flowborne.base.errors import SceneError
from flowborne.kernels.arrays import Array, Mask
from flowborne.motion.bvh_file import BvhFile, BvhJoint, angles_of, load_bvh, quaternions_of
from flowborne.motion.clip import Clip
from flowborne.motion.quaternions import angle, inverse, product, rotated

_Y_UP = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
_Z_UP = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
_HALF_TURN_ABOUT_X = np.diag([1.0, -1.0, -1.0])

TO_WORLD: dict[str, Array] = {
    "y": _Y_UP,
    "z": _Z_UP,
    "-y": _Y_UP @ _HALF_TURN_ABOUT_X,
    "-z": _Z_UP @ _HALF_TURN_ABOUT_X,
}
"""Up axis of the file -> (3, 3) rotation of its axes to x forward, y left, z up."""

ROOT_MOTION_RATIO = 0.2
"""Motion of an only child relative to its parent, over its distance from the parent, above which it
replaces the parent as the root."""

MAX_BONE_STRETCH = 1e-3
"""Largest motion of a rigid bone's end, m: exporters round and solve to about 1 mm."""

MIN_ROTATION_CHANGE = 1e-6
"""Change of a rotation, rad, above which the angles of the file are replaced."""

MAX_LOST_DEGREES = 0.01
"""Largest rotation, degrees, that may be dropped about axes without a rotation channel."""

MIN_BONE_LENGTH = 1e-6
"""Minimum length of a written end site, m: BVH readers drop or lengthen shorter ones."""

DEFAULT_BONE_LENGTH = 0.1
"""Length of an end site without any bone above it, m."""

ZXY = (2, 0, 1)
"""Axes of the rotation channels in clips without an original file."""


def clip_of(
    bvh: BvhFile, unit: float = 1.0, up: str = "y", skip: int = 0, root: str | None = None
) -> Clip:
    """The motion of a loaded BVH file, with rigid bones.

    unit    m per length of the file
    up      up axis of the file, one of TO_WORLD
    skip    frames to drop at the start, such as the T-pose of an exporter
    root    first joint of the clip: the joints above are merged into it, and their other branches
            are dropped. By default the root of the file, or the first joint below it that does not
            move relative to a joint with a single child
    raises  SceneError when `skip` leaves no frame
    note    position channels of the root give its position without its OFFSET
    """
    if not 0 <= skip < len(bvh.values):
        raise SceneError(
            f"{bvh.name} has {len(bvh.values)} frames, and skip = {skip} leaves none. Skip fewer."
        )
    values, world = bvh.values[skip:], TO_WORLD[up]
    if root is None:
        first = _first_at_rest(bvh, values)
    else:
        first = [joint.name for joint in bvh.joints].index(root)
    kept, translation, rotation = [first], *_world_pose(bvh, first, values, world)
    for number, joint in enumerate(bvh.joints):
        if joint.parent in kept:
            kept.append(number)
    joints = [bvh.joints[number] for number in kept]
    offsets, deviations = [np.zeros(3)], {}
    for joint in joints[1:]:
        positions = _positions(joint, values)
        offsets.append((positions.min(axis=0) + positions.max(axis=0)) / 2.0)
        distance = unit * np.abs(positions - offsets[-1]).max(axis=1)
        if distance.max() > 0.0:
            deviations[joint.name] = float(distance.max()), int(distance.argmax())
    return Clip(
        names=tuple(joint.name for joint in joints),
        parents=np.array([-1] + [kept.index(joint.parent) for joint in joints[1:]], np.int64),
        offsets=unit * np.array(offsets) @ world.T,
        ends={j.name: unit * world @ j.end for j in joints if j.end is not None},
        frame_time=bvh.frame_time,
        rotations=np.stack(
            [rotation, *(_rotations(joint, values, world) for joint in joints[1:])], axis=1
        ),
        translation=unit * translation,
        deviations=deviations,
    )


def check_rigid(
    bvh: BvhFile, clip: Clip, joints: Iterable[str], most: float = MAX_BONE_STRETCH
) -> None:
    """Raise SceneError when a joint is more than `most` (m) from the end of its rigid bone."""
    for joint in joints:
        deviation, frame = clip.deviations.get(joint, (0.0, 0))
        if deviation > most:
            raise SceneError(
                f"{bvh.name}, line {bvh.lines[frame + len(bvh.values) - clip.frames]}: the "
                f"position channels of joint '{joint}' move by {2.0 * deviation:.3g} m, but bones "
                "must be rigid. Export the clip without stretching bones, or skip frames that do "
                "not belong to the motion."
            )


def write_bvh(
    path: str | Path,
    source: str | Path,
    rotations: Mapping[str, Array],
    *,
    root: tuple[str, Array, Array] | None = None,
    unit: float = 1.0,
    up: str = "y",
    first: int = 0,
    last: int | None = None,
) -> None:
    """Write a copy of a BVH file with other rotations of some joints; the rest is unchanged.

    source     file for the skeleton, channels, frame time and numbers, which are copied verbatim
    rotations  joint -> (frames, 4) unit quaternions relative to its parent in the file, in world
               axes. Written angles are continuous from frame to frame; unchanged rotations keep
               the angles of the file
    root       a joint with position channels, and its (frames, 3) positions, m, and (frames, 4)
               rotations in the world
    unit, up   as in `clip_of`
    first      first frame of the file to write, counting skipped ones
    last       frame after the last one; the end of the file by default
    raises     SceneError when the file is invalid, lacks a joint or a channel, or has no frame in
               the range; OSError
    """
    bvh = load_bvh(Path(source))
    span = slice(first, last)
    rows, values = bvh.rows[span], bvh.values[span]
    if not rows:
        raise SceneError(
            f"{bvh.name} has {len(bvh.rows)} frames, none of them from {first} to {last}. "
            "Give a range with frames."
        )
    joints = {joint.name: joint for joint in bvh.joints}
    for name in (*rotations, *([] if root is None else [root[0]])):
        if name not in joints:
            raise SceneError(f"{bvh.name} has no joint '{name}'. It has: {', '.join(joints)}.")
    words = [row.split() for row in rows] if rotations or root is not None else []
    if root is not None:
        name, positions, turns = root
        columns, numbers, turns = _root_channels(
            bvh, joints[name], positions / unit, turns, values, TO_WORLD[up]
        )
        rotations = {name: turns, **rotations}
        for row, new in zip(words, numbers, strict=True):
            for column, number in zip(columns, new, strict=True):
                row[column] = f"{number:.6f}"
    for name, wanted in rotations.items():
        columns, angles, new = _replaced(bvh, joints[name], values, wanted, TO_WORLD[up])
        for frame in np.flatnonzero(new):
            for column, degrees in zip(columns, angles[frame], strict=True):
                words[frame][column] = f"{degrees:.6f}"
    lines = [" ".join(row) for row in words] or rows
    text = f"{bvh.hierarchy}Frames: {len(rows)}\nFrame Time: {bvh.time_text}\n"
    content = (text + "\n".join(lines) + "\n").encode(bvh.encoding)
    write_atomically(Path(path), lambda stream: stream.write(content))


def write_clip(
    path: str | Path, clip: Clip, unit: float = 1.0, sliding: Mapping[str, Array] | None = None
) -> None:
    """Write a clip as a BVH file; see `bvh_text`. Raises OSError."""
    write_text(Path(path), bvh_text(clip, unit, sliding))


def bvh_text(clip: Clip, unit: float = 1.0, sliding: Mapping[str, Array] | None = None) -> str:
    """A clip in BVH: y up, facing +z, channels Zrotation Xrotation Yrotation.

    Every last bone gets an end site of nonzero length (see `_end_site`).

    unit     m per length of the file
    sliding  joint -> (frames, 3) m, positions in the parent's axes of joints other than the root
             that move relative to their parent
    """
    back = TO_WORLD["y"].T
    moving = {clip.names[0]: clip.translation} | dict(sliding or {})
    columns = []
    for joint, name in enumerate(clip.names):
        if name in moving:
            columns.append(moving[name] @ back.T / unit)
        local = _in_axes(clip.rotations[:, joint], back)
        columns.append(angles_of(local, ZXY, np.zeros(3)))
    offsets = clip.offsets @ back.T / unit
    inner = {clip.names[joint] for joint in clip.parents if joint >= 0}
    tips = {n: end for n, end in clip.ends.items() if np.linalg.norm(end) >= MIN_BONE_LENGTH}
    tips |= {n: _end_site(clip, k) for k, n in enumerate(clip.names) if n not in {*inner, *tips}}
    ends = {name: back @ end / unit for name, end in tips.items()}
    lines = [
        "HIERARCHY",
        *_block(clip, offsets, ends, set(moving), 0, 0),
        "MOTION",
        f"Frames: {clip.frames}",
        f"Frame Time: {clip.frame_time:.10g}",
        *(_spaced(row) for row in np.concatenate(columns, axis=1)),
    ]
    return "\n".join(lines) + "\n"


def _positions(joint: BvhJoint, values: Array) -> Array:
    """(frames, 3) position of a joint in its parent's axes, in the file's unit.

    Position channels of the root contain the full position. For other joints, some tools write the
    full position, and others the difference from OFFSET: the numbers are closer to OFFSET in the
    first case and closer to 0 in the second.
    """
    result = np.tile(joint.offset, (len(values), 1))
    columns, axes = joint.columns(rotations=False)
    result[:, axes] = values[:, columns]
    middle = (result.min(axis=0) + result.max(axis=0)) / 2.0
    if joint.parent >= 0 and np.linalg.norm(middle - joint.offset) > np.linalg.norm(middle):
        result[:, axes] += joint.offset[axes]
    return result


def _world_pose(bvh: BvhFile, number: int, values: Array, world: Array) -> tuple[Array, Array]:
    """(frames, 3) position, in the file's unit, and (frames, 4) rotation of a joint, world axes."""
    joint = bvh.joints[number]
    position, rotation = _positions(joint, values) @ world.T, _rotations(joint, values, world)
    if joint.parent < 0:
        return position, rotation
    start, above = _world_pose(bvh, joint.parent, values, world)
    return start + rotated(above, position), product(above, rotation)


def _root_channels(
    bvh: BvhFile, joint: BvhJoint, positions: Array, rotations: Array, values: Array, world: Array
) -> tuple[list[int], Array, Array]:
    """Columns of the position channels of a joint, (frames, k) numbers for them, and (frames, 4)
    rotations relative to its parent, from positions in the file's unit and world rotations."""
    if joint.parent >= 0:
        start, above = _world_pose(bvh, joint.parent, values, world)
        positions = rotated(inverse(above), positions - start)
        rotations = product(inverse(above), rotations)
    columns, axes = joint.columns(rotations=False)
    added = _positions(joint, values)[:, axes] - values[:, columns]  # OFFSET, if the file omits it
    return columns, (positions @ world)[:, axes] - added, rotations


def _first_at_rest(bvh: BvhFile, values: Array) -> int:
    """The first joint of a clip: an only child that moves relative to its parent replaces it."""
    first = 0
    while True:
        below = [number for number, j in enumerate(bvh.joints) if j.parent == first]
        if len(below) != 1:
            return first
        positions = _positions(bvh.joints[below[0]], values)
        moved = np.ptp(positions, axis=0).max()
        if moved <= ROOT_MOTION_RATIO * np.linalg.norm(positions, axis=1).max():
            return first
        first = below[0]


def _rotations(joint: BvhJoint, values: Array, world: Array) -> Array:
    """(frames, 4) rotations relative to the parent, in world axes."""
    columns, axes = joint.columns(rotations=True)
    return quaternions_of(values[:, columns], world.T[axes])


def _in_axes(rotations: Array, axes: Array) -> Array:
    """(frames, 4) the same rotations in axes rotated by a (3, 3) rotation."""
    return np.concatenate([rotations[:, :1], rotations[:, 1:] @ axes.T], axis=1)


def _replaced(
    bvh: BvhFile, joint: BvhJoint, values: Array, wanted: Array, world: Array
) -> tuple[list[int], Array, Mask]:
    """Columns, angles (frames, k) in degrees for them, and the frames with new angles."""
    if wanted.shape != (len(values), 4):
        raise ValueError(f"{wanted.shape} is not the shape of {len(values)} quaternions.")
    columns, axes = joint.columns(rotations=True)
    if len(set(axes)) != len(axes):
        raise SceneError(
            f"{bvh.name}, line {joint.line}: joint '{joint.name}' has two rotation channels "
            "about one axis. To write its motion, export the clip with three different channels."
        )
    own = _rotations(joint, values, world)
    new = angle(product(inverse(own), wanted)) > MIN_ROTATION_CHANGE
    if not new.any():
        return columns, values[:, columns], new
    missing = [axis for axis in range(3) if axis not in axes]
    i, j, k = axes + missing
    start = np.concatenate([values[0, columns], np.zeros(len(missing))])
    result = values[:, columns].copy()
    for begin, end in _runs(new):
        if begin > 0:
            start[: len(columns)] = result[begin - 1]
        angles = angles_of(_in_axes(wanted[begin:end], world.T), (i, j, k), start)
        lost = np.abs(angles[:, len(columns) :]).max(initial=0.0)
        if lost > MAX_LOST_DEGREES:
            raise SceneError(
                f"{bvh.name}, line {joint.line}: joint '{joint.name}' has {len(columns)} rotation "
                f"channels, and its motion turns {lost:.3g} degrees about axes without one. "
                "To write its motion, export the clip with three rotation channels."
            )
        result[begin:end] = angles[:, : len(columns)]
    return columns, result, new


def _runs(marked: Mask) -> list[tuple[int, int]]:
    """Begin and end of each run of marked frames."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], marked.astype(int), [0]])))
    return list(zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True))


def _end_site(clip: Clip, joint: int) -> Array:
    """(3,) m, end site for a last joint without a usable one: a copy of the nearest bone above that
    has a length."""
    found = np.zeros(3)
    while np.linalg.norm(found) < MIN_BONE_LENGTH and joint >= 0:
        found, joint = clip.offsets[joint], int(clip.parents[joint])
    return (
        found
        if np.linalg.norm(found) >= MIN_BONE_LENGTH
        else np.array([0.0, 0.0, DEFAULT_BONE_LENGTH])
    )


def _block(
    clip: Clip, offsets: Array, ends: Mapping[str, Array], moving: set[str], joint: int, depth: int
) -> list[str]:
    """Lines of a joint and all below it; those in `moving` have position channels."""
    name, inner = clip.names[joint], "\t" * (depth + 1)
    channels = "6 Xposition Yposition Zposition" if name in moving else "3"
    lines = [
        f"{'ROOT' if joint == 0 else 'JOINT'} {name}",
        "{",
        f"\tOFFSET {_spaced(offsets[joint])}",
        f"\tCHANNELS {channels} Zrotation Xrotation Yrotation",
    ]
    lines = ["\t" * depth + line for line in lines]
    for child in np.flatnonzero(clip.parents == joint):
        lines += _block(clip, offsets, ends, moving, int(child), depth + 1)
    if name in ends:
        tip = f"{inner}\tOFFSET {_spaced(ends[name])}"
        lines += [f"{inner}End Site", f"{inner}{{", tip, f"{inner}}}"]
    return [*lines, "\t" * depth + "}"]


def _spaced(numbers: Array) -> str:
    return " ".join(f"{number:.8f}" for number in numbers)
