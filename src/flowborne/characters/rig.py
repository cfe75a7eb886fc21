"""A skeleton at rest, the surface that it carries, and how a clip moves it; metres, z up."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import count

import numpy as np
from numpy.typing import NDArray

from flowborne.characters.limits import LONGEST_NAME, check_frames, check_poses, check_surface

Array = NDArray[np.float64]
Integers = NDArray[np.int64]

Z_UP = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])
"""From axes with y up to the world's: the way back of what exporters do."""


@dataclass(frozen=True, eq=False)
class Rig:
    """Joints in the pose in which their surface was bound to them.

    names     (n) each once, the root first and parents before children
    parents   (n,) number of the parent, -1 for the root
    position  (n, 3) m
    rotation  (n, 3, 3) joint's frame to the world's
    """

    names: tuple[str, ...]
    parents: Integers
    position: Array
    rotation: Array

    def offsets(self, position: Array, rotation: Array) -> Array:
        """(..., n, 3) m, places (..., n, 3) in the frames (..., n, 3, 3) of the parents, the root's
        in the world's."""
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
    """Triangles that joints carry by linear blend skinning, where the rig has them at rest.

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
    """Several surfaces as one; None for no parts. Raises SceneError as `check_surface`."""
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


def own_names(names: list[str]) -> tuple[str, ...]:
    """Names of joints, each once, also where a file has none or one twice; in one short line.

    Braces are BVH's own, and the name of the world is MuJoCo's.
    """
    plain = [re.sub(r"[{}]", "_", printable(name))[:LONGEST_NAME].strip() for name in names]
    given = [name or f"joint_{number}" for number, name in enumerate(plain)]
    return told_apart(["world", *given])[1:]


def told_apart(names: Sequence[str]) -> tuple[str, ...]:
    """Names each once: the second of a kind ends in _2."""
    found: dict[str, None] = {}
    for base in names:
        again = (f"{base}_{n}" for n in count(2))
        found[base if base not in found else next(n for n in again if n not in found)] = None
    return tuple(found)


def printable(text: str) -> str:
    """A text with '_' in place of each letter that has no width or breaks a line."""
    return "".join(letter if letter.isprintable() else "_" for letter in text)


def one_tree(parents: list[int]) -> Integers:
    """Parents of joints; further roots hang on the first."""
    return np.array([-1, *(max(parent, 0) for parent in parents[1:])], np.int64)


def rotations_in(matrices: Array) -> Array:
    """(..., 3, 3) the rotation nearest to each matrix (..., 3, 3), which may scale and shear."""
    left, _, right = np.linalg.svd(matrices)
    flips = np.where(np.linalg.det(left @ right) < 0.0, -1.0, 1.0)
    left[..., :, 2] *= flips[..., None]
    return np.asarray(left @ right)


def placed(matrices: Array, where: str) -> tuple[Array, Array]:
    """(..., 3) m and (..., 3, 3), places and rotations of frames (..., 4, 4).

    where   the file and what of it they are
    raises  SceneError when they are not finite, or too far away
    """
    check_poses(matrices, where)
    return matrices[..., :3, 3], rotations_in(matrices[..., :3, :3])


def frame_times(keys: Array, densest: Array, nodes: int, where: str) -> Array:
    """(frames,) s evenly from the first key to the last.

    keys     s of all curves of a clip
    densest  s of the curve that has most: its usual step is the frames'
    nodes    number of things that are posed in every frame
    where    the file and its clip
    raises   SceneError when these are more frames, or closer ones, than a run can have
    """
    first, last = float(keys.min()), float(keys.max())
    step = float(np.median(np.diff(densest))) if len(densest) > 1 else 0.0
    if len(densest) > 1:
        check_frames((last - first) / step, step, nodes, where)
    count = max(round((last - first) / step), 1) if step > 0.0 else 1
    return np.linspace(first, last, count + 1)
