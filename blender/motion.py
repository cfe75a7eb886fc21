# SPDX-License-Identifier: GPL-3.0-or-later
"""The motion of bones in a run folder, and their rotations as Blender keeps them.

A body of the run has the name and the axes of its bone, in world axes with z up, as in Blender.
"""

from __future__ import annotations

import json
import zipfile
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Integers = NDArray[np.int64]


STATE = ("body_position", "body_rotation", "fluid_centre", "fluid_force")
"""Arrays of a state, in the order of the fields of `Motion`."""


class MotionError(Exception):
    """A run cannot be baked; the text says why and what to do."""


@dataclass(frozen=True, eq=False)
class Motion:
    """The bones in the frames of a run.

    names     (n) of the bones
    moving    names of those that have a joint, the root first; others are rigid with their parent
    position  (frames, n, 3) m
    rotation  (frames, n, 3, 3) from the axes of the bone to the world's
    centre    (frames, n, 3) m, of the mass of the body
    force     (frames, n, 3) N, of air or water on it
    """

    names: tuple[str, ...]
    moving: tuple[str, ...]
    position: Array
    rotation: Array
    centre: Array
    force: Array

    def of(self, bone: str) -> tuple[Array, Array]:
        """(frames, 3) m and (frames, 3, 3) of a bone."""
        number = self.names.index(bone)
        return self.position[:, number], self.rotation[:, number]

    def in_armature(self, bone: str, unit: float, places: Array) -> Array:
        """(frames, 4, 4) axes and head of a bone, without scale, in the axes of its armature.

        unit    m per unit of Blender
        places  (frames, 4, 4) the armature's axes to the world's, with uniform scale
        """
        position, rotation = self.of(bone)
        world = np.tile(np.eye(4), (len(position), 1, 1))
        world[:, :3, :3] = rotation * np.linalg.norm(places[:, :3, :1], axis=1, keepdims=True)
        world[:, :3, 3] = position / unit
        return np.asarray(np.linalg.inv(places) @ world)

    def check(self, bones: Iterable[str]) -> None:
        """Raise MotionError for a bone that the run does not move."""
        for bone in bones:
            if bone not in self.moving:
                raise MotionError(
                    f"the run does not move bone '{bone}'. Select some of: {', '.join(self.moving)}"
                )

    def after(self, lead: int, loop: bool) -> Motion:
        """The motion from a frame on; in a loop it is moved to where the first round starts.

        raises  MotionError when the run has not come that far
        """
        turn, shift = self.back(lead)
        if not loop:
            turn, shift = np.eye(3), np.zeros(3)
        return replace(
            self,
            position=self.position[lead:] @ turn.T + shift,
            rotation=turn @ self.rotation[lead:],
            centre=self.centre[lead:] @ turn.T + shift,
            force=self.force[lead:] @ turn.T,
        )

    def back(self, frame: int) -> tuple[Array, Array]:
        """(3, 3) and (3,) m that move the root from where it is in a frame to where it starts.

        raises  MotionError when the run has not come that far
        """
        if len(self.position) <= frame:
            raise MotionError(
                f"the run has {len(self.position) - 1} frames, and the bake starts after {frame}: "
                "resume the run"
            )
        position, rotation = self.of(self.moving[0])
        turn = rotation[0] @ rotation[frame].T
        return turn, position[0] - turn @ position[frame]

    def ends_apart(self, bones: Iterable[str]) -> float:
        """Largest rotation of bones, relative to the root, from first to last frame, degrees."""
        root = np.swapaxes(self.of(self.moving[0])[1], 1, 2)
        ends = [(root @ self.of(bone)[1])[[0, -1]] for bone in bones]
        return max((float(angles(*pair)) for pair in ends), default=0.0)


def read_motion(run: Path, start: int = 0) -> Motion:
    """The motion of a run, complete or not, from a frame on.

    raises  MotionError when there is no frame, or a file cannot be read
    """
    try:
        model, paths = _files(run, start)
        states = [_read(path) for path in paths]
        if not states:
            raise ValueError("it has no states")
        arrays = (np.array(values, np.float64) for values in zip(*states, strict=True))
        return Motion(tuple(model["bodies"]), tuple(model["joints"]), *arrays)
    except (OSError, ValueError, KeyError, zipfile.BadZipFile) as error:
        raise MotionError(f"{run} has no frames to bake ({error}): resume the run") from error


def _files(run: Path, start: int) -> tuple[dict[str, Any], list[Path]]:
    """What model.json has, and the files of the states from a frame on."""
    model: dict[str, Any] = json.loads((run / "model.json").read_text(encoding="utf-8"))
    return model, sorted((run / "states").glob("[0-9]*.npz"))[start:]


def _read(path: Path, names: Iterable[str] = STATE) -> list[Array]:
    with np.load(path) as state:
        return [state[name] for name in names]


@dataclass(frozen=True, eq=False)
class Skin:
    """The skin of flesh in the frames of a run.

    triangles  (m, 3) vertices, outward
    body       a bone that carries flesh
    rest       (k, 3) m, the vertices at rest in the axes of this bone
    vertices   (frames, k, 3) m
    """

    triangles: Integers
    body: str
    rest: Array
    vertices: Array


def read_skin(run: Path, start: int = 0) -> Skin:
    """The skin of flesh in a run, complete or not, from a frame on.

    raises  MotionError when the run has no flesh, or a file cannot be read
    """
    try:
        model, paths = _files(run, start)
        flesh = model.get("flesh")
        if flesh is None or not paths:
            raise ValueError("it has no flesh: choose it in Flesh, and start a new run")
        body = flesh["bodies"].index(next(filter(None, flesh["bodies"])))
        position, rotation = (
            np.array(flesh[f"body_{key}"][body]) for key in ("position", "rotation")
        )
        return Skin(
            np.array(flesh["triangles"]),
            model["bodies"][flesh["bodies"][body]],
            (np.array(flesh["rest"]) - position) @ rotation,
            np.array([_read(path, ["flesh_vertices"])[0] for path in paths], np.float64),
        )
    except (OSError, ValueError, KeyError, zipfile.BadZipFile) as error:
        raise MotionError(f"{run} has no flesh to show ({error})") from error


def angles(one: Array, other: Array) -> Array:
    """Degrees between rotations (..., 3, 3); exact for small ones too."""
    sines = np.linalg.norm(other - one, axis=(-2, -1)) / 8.0**0.5
    return np.asarray(2.0 * np.degrees(np.arcsin(np.minimum(sines, 1.0))))


def axes_only(matrices: Array) -> Array:
    """(..., 3, 3) rotations of matrices (..., 3, 3) or (..., 4, 4) with uniform scale."""
    inner = matrices[..., :3, :3]
    return np.asarray(inner / np.linalg.norm(inner, axis=-2, keepdims=True))


def same_side(quaternions: Array) -> Array:
    """Quaternions (frames, 4) with the signs that keep each near the one before."""
    products = np.sum(quaternions[1:] * quaternions[:-1], axis=1)
    signs = np.cumprod(np.where(products < 0.0, -1.0, 1.0))
    return quaternions * np.concatenate([[1.0], signs])[:, None]


def turns(quaternions: Array) -> Array:
    """(frames, 4) angle, rad, and axis of quaternions (frames, 4), without jumps.

    The angle may exceed half a turn, and the axis is kept through the rest pose.
    """
    near = same_side(quaternions)
    near = near if near[0, 0] >= 0.0 else -near
    sines = np.linalg.norm(near[:, 1:], axis=1)
    found = np.empty_like(near)
    axis = np.array([0.0, 1.0, 0.0])  # Blender's axis of a bone at rest
    for k, (quaternion, sine) in enumerate(zip(near, sines, strict=True)):
        if sine > 0.0:
            new = quaternion[1:] / sine
            axis = -new if k and new @ axis < 0.0 else new
        found[k] = 2.0 * np.arctan2(quaternion[1:] @ axis, quaternion[0]), *axis
    found[:, 0] = np.unwrap(found[:, 0])
    return found


def keys_within(
    values: Array, quaternions: Callable[[Array], Array], tolerance: float
) -> list[int]:
    """Indices of keys between which linear values give the rotations within a tolerance.

    values       (frames, k) of a rotation mode
    quaternions  (n, k) values to unit quaternions (n, 4)
    tolerance    largest rotation from the exact one in any frame, degrees
    source       Douglas and Peucker 1973, with the angle between rotations as distance
    """
    exact, last = quaternions(values), len(values) - 1
    kept, spans = {0, last}, [(0, last)]
    while spans:
        low, high = spans.pop()
        if high - low < 2:
            continue
        share = np.linspace(0.0, 1.0, high - low + 1)[1:-1, None]
        between = quaternions(values[low] + share * (values[high] - values[low]))
        cosines = np.abs(np.sum(between * exact[low + 1 : high], axis=1))
        if 2.0 * np.degrees(np.arccos(min(cosines.min(), 1.0))) > tolerance:
            middle = low + 1 + int(cosines.argmin())
            kept.add(middle)
            spans += [(low, middle), (middle, high)]
    return sorted(kept)
