"""A skeleton at rest, its surface and its clips, read from a file; metres, z up."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import count

import numpy as np

from flowborne.base.errors import SceneError
from flowborne.characters.limits import (
    MAX_NAME_LENGTH,
    MAX_SCALE,
    check_frames,
    check_points,
    check_surface,
)
from flowborne.kernels.arrays import Array, Integers

Z_UP = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])
"""Rotation from axes with y up to the world's, the inverse of the one that exporters apply."""

PLAIN = 0.5
"""Red, green and blue of a surface without a colour in the file."""

ANIMAL_LENGTHS = (2e-3, 35.0)
"""Range of the longest side of animals in m, from a fruit fly to a whale. Files have numbers
without a unit or with a wrong one: centimetres read as metres make a fox 156 m long."""


@dataclass(frozen=True, eq=False)
class Rig:
    """Joints in the pose in which their surface was bound to them.

    names     (n) each once, parents before children
    parents   (n,) number of the parent, -1 for a root; of a tree the first is the only one
    position  (n, 3) m
    rotation  (n, 3, 3) joint's frame to the world's
    """

    names: tuple[str, ...]
    parents: Integers
    position: Array
    rotation: Array

    def offsets(self, position: Array, rotation: Array) -> Array:
        """(..., n, 3) m, positions (..., n, 3) in the parents' frames (..., n, 3, 3); the root's
        position is in the world's frame."""
        found = position.copy()
        for joint, parent in enumerate(self.parents):
            if parent >= 0:
                apart = position[..., joint, :] - position[..., parent, :]
                found[..., joint, :] = np.einsum(
                    "...ji,...j->...i", rotation[..., parent, :, :], apart
                )
        return found


@dataclass(frozen=True, eq=False)
class Surface:
    """Triangles with weights for linear blend skinning, in the rest pose of the rig.

    vertices  (k, 3) m
    faces     (m, 3) outward
    weights   (k, n) share of each joint, together 1
    colours   (m, 3) sRGB values from 0 to 1 of the faces
    """

    vertices: Array
    faces: Integers
    weights: Array
    colours: Array


@dataclass(frozen=True, eq=False)
class Action:
    """A clip of a file, on the file's own skeleton.

    frame_time  s
    position    (frames, n, 3) m of the joints of its rig
    rotation    (frames, n, 3, 3) joint's frame to the world's
    """

    frame_time: float
    position: Array
    rotation: Array


def joined(parts: Sequence[Surface], where: str) -> Surface | None:
    """Several surfaces as one, None without parts. Raises SceneError like `check_surface`."""
    if not parts:
        return None
    counts = [len(part.vertices) for part in parts]
    starts = np.cumsum(counts) - counts
    vertices = np.concatenate([part.vertices for part in parts])
    check_surface(vertices, where)
    return Surface(
        vertices,
        np.concatenate([part.faces + start for part, start in zip(parts, starts, strict=True)]),
        np.concatenate([part.weights for part in parts]),
        np.concatenate([part.colours for part in parts]),
    )


def scaled(rig: Rig, surface: Surface, scale: float, name: str) -> tuple[Rig, Surface]:
    """A character scaled about the origin.

    name    of its file, for messages
    raises  SceneError when the scale is not positive, or the result exceeds the limits
    """
    if not (scale > 0.0 and math.isfinite(scale)):
        raise SceneError(f"scale is {scale:g}. Give a number above 0.")
    if scale == 1.0:
        return rig, surface
    where = f"{name} scaled by {scale:g}"
    larger = replace(surface, vertices=scale * surface.vertices)
    check_surface(larger.vertices, where)
    check_points(scale * rig.position, where)
    return replace(rig, position=scale * rig.position), larger


def size_notes(vertices: Array, mass: float, scale: float, name: str) -> Iterator[str]:
    """A note if a surface (k, 3), m, is far longer than any animal.

    mass    kg
    scale   already applied to the surface
    name    of its file, for messages
    raises  SceneError when it is far smaller than any animal: MuJoCo refuses the inertia of its
            parts
    """
    length = float(np.ptp(vertices, axis=0).max())
    more = 10.0 ** round(-math.log10(length))
    resized = (
        f"with a scale of {more * scale:g} it is {more * length:.3g} m long and "
        f"{more**3 * mass:.3g} kg"
    )
    size = f"{length:.3g} m long and {mass:.3g} kg"
    if length < ANIMAL_LENGTHS[0]:
        raise SceneError(
            f"{name} is {size}, smaller than a fly: its parts are too small to simulate. Import it "
            f"in its own unit: {resized}."
        )
    if length > ANIMAL_LENGTHS[1]:
        yield (
            f"it is {size}, longer than a whale: is the file in another unit than metres? Imported "
            f"into another folder {resized}"
        )


def own_names(names: list[str]) -> tuple[str, ...]:
    """Unique short names of joints, also for missing and repeated names.

    BVH reserves braces, and MuJoCo the name "world".
    """
    plain = [re.sub(r"[{}]", "_", printable(name))[:MAX_NAME_LENGTH].strip() for name in names]
    given = [name or f"joint_{number}" for number, name in enumerate(plain)]
    return unique_names(["world", *given])[1:]


def unique_names(names: Sequence[str]) -> tuple[str, ...]:
    """Unique names: repeated names get a suffix, starting with _2."""
    found: dict[str, None] = {}
    for base in names:
        again = (f"{base}_{n}" for n in count(2))
        found[base if base not in found else next(n for n in again if n not in found)] = None
    return tuple(found)


def printable(text: str) -> str:
    """A text with '_' in place of each character that is not printable."""
    return "".join(letter if letter.isprintable() else "_" for letter in text)


def one_tree(rig: Rig, main: int) -> tuple[Rig, Integers]:
    """A skeleton with one root: further roots hang on the joint `main`.

    returns  the skeleton, and (n,) the number that each of its joints had
    """
    if np.count_nonzero(rig.parents < 0) == 1:
        return rig, np.arange(len(rig.parents))
    parents, root = rig.parents.copy(), main
    while parents[root] >= 0:
        root = int(parents[root])
    parents[(parents < 0) & (np.arange(len(parents)) != root)] = main
    order, below = [root], [np.flatnonzero(parents == n) for n in range(len(parents))]
    for joint in order:
        order += below[joint].tolist()
    number = np.array(order)
    place = np.argsort(number)
    above = np.where(parents[number] < 0, -1, place[parents[number]])
    names = tuple(rig.names[joint] for joint in order)
    return Rig(names, above, rig.position[number], rig.rotation[number]), number


def heaviest(surface: Surface) -> int:
    """The joint with the most weight, by the area of the surface."""
    corners = surface.vertices[surface.faces]
    area = np.linalg.norm(
        np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1
    )
    share = np.bincount(surface.faces.ravel(), np.repeat(area, 3), len(surface.vertices))
    return int((share @ surface.weights).argmax())


def placed(matrices: Array, where: str) -> tuple[Array, Array]:
    """(..., 3) m and (..., 3, 3), positions and nearest rotations of frames (..., 4, 4), which may
    scale and shear.

    where   the file and the part of it, for messages
    raises  SceneError when they are not finite, or too far away
    """
    check_points(matrices[..., :3, 3], where)
    with np.errstate(all="ignore"):
        largest = float(np.abs(matrices[..., :3, :3]).max(initial=0.0))
    if not largest < MAX_SCALE:
        raise SceneError(
            f"{where}: a joint is scaled by {largest:.3g}. Apply scales before exporting."
        )
    left, _, right = np.linalg.svd(matrices[..., :3, :3])
    flips = np.where(np.linalg.det(left @ right) < 0.0, -1.0, 1.0)
    left[..., :, 2] *= flips[..., None]
    return matrices[..., :3, 3], np.asarray(left @ right)


def normalised(weights: Array, root: int) -> Array:
    """Weights (k, n) with rows that sum to 1: in files they may not. A vertex without weights gets
    joint `root`; changes the argument."""
    total = weights.sum(axis=1)
    weights[total <= 0.0, root] = 1.0
    return np.asarray(weights / np.where(total > 0.0, total, 1.0)[:, None])


def sampled_action(times: Array, world: Array, where: str) -> Action:
    """A clip from joint frames (frames, n, 4, 4) at evenly spaced times, s; see `placed`."""
    step = float(times[-1] - times[0]) / (len(times) - 1) or 1.0
    return Action(step, *placed(world, where))


def frame_times(keys: Array, densest: Array, nodes: int, where: str) -> Array:
    """(frames,) s, evenly spaced from the first key to the last.

    keys     s of all curves of a clip
    densest  s of the curve with most keys; its median step is the time between frames
    nodes    number of nodes with a pose in every frame
    where    the file and its clip
    raises   SceneError when there are too many frames, or their interval is out of range
    """
    first, last = float(keys.min()), float(keys.max())
    step = float(np.median(np.diff(densest))) if len(densest) > 1 else 0.0
    if len(densest) > 1:
        check_frames((last - first) / step, step, nodes, where)
    count = max(round((last - first) / step), 1) if step > 0.0 else 1
    return np.linspace(first, last, count + 1)
