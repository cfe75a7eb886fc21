"""The bodies of a run as other programs want them: a skeleton, surfaces on its bones, and skin.

Lengths are in m, axes the world's, z up.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from flowborne.errors import SceneError
from flowborne.runs.open_run import OpenRun
from flowborne.runs.recorder import on_skin
from flowborne.scenes.bodies import load_model
from flowborne.scenes.load import read_scene
from flowborne.solids.dynamics import kinematics
from flowborne.solids.model import BALL, HINGE, SolidModel
from flowborne.solids.skins import clad_bodies, skins_of

Array = NDArray[np.float64]
Integers = NDArray[np.int64]

WORLD = "world"
"""Name of the bone that stays, where there is one."""

SKIN_COLOUR = np.array([0.86, 0.60, 0.48, 1.0])
"""Red, green, blue and opacity of flesh, for which models say none."""


@dataclass(frozen=True, eq=False)
class Skeleton:
    """A bone for each body that moves; its frame is the body's, placed at its joint.

    names     (n) of the bodies, parents before children
    parents   (n,) number of the parent, -1 for a root
    bodies    (n,) number of the body in the model
    rest      (n, 3) m and (n, 3, 3), where the bones are in the model's own pose
    position  (frames, n, 3) m
    rotation  (frames, n, 3, 3) bone's frame to the world's
    """

    names: tuple[str, ...]
    parents: Integers
    bodies: Integers
    rest: tuple[Array, Array]
    position: Array
    rotation: Array

    def local(self) -> tuple[Array, Array]:
        """(frames, n, 3) m and (frames, n, 3, 3) of every bone in the frame of its parent."""
        return in_parents(self.parents, self.position, self.rotation)

    def rest_local(self) -> tuple[Array, Array]:
        """The same of the model's own pose."""
        return in_parents(self.parents, *self.rest)

    @cached_property
    def carried(self) -> tuple[Array, Array]:
        """(frames, n, 3, 3) R and (frames, n, 3) t of every bone's motion x -> R x + t from the
        model's own pose."""
        place, frame = self.rest
        turn = np.einsum("fnij,nkj->fnik", self.rotation, frame)
        return turn, self.position - np.einsum("fnij,nj->fni", turn, place)


@dataclass(frozen=True, eq=False)
class Surface:
    """A geometry of a bone, in the model's own pose.

    name      of the geometry
    bone      number, -1 of what stays in the world
    vertices  (k, 3) m, and faces (m, 3) of them, outward
    rgba      (4,) colour
    covered   whether flesh is all around it
    """

    name: str
    bone: int
    vertices: Array
    faces: Integers
    rgba: Array
    covered: bool


@dataclass(frozen=True, eq=False)
class Skin:
    """The outside of one flesh.

    name      of the flesh
    chosen    (k,) numbers of its vertices in the `flesh_vertices` of a state
    faces     (m, 3) of its own vertices, outward
    rest      (k, 3) vertices in the model's own pose, m
    weights   (k, n) share of each bone in carrying a vertex, together 1
    """

    name: str
    chosen: Integers
    faces: Integers
    rest: Array
    weights: Array


@dataclass(frozen=True, eq=False)
class Bound:
    """A surface that several bones carry: a <skin> of the model.

    name      of the skin
    vertices  (k, 3) m in the model's own pose
    faces     (m, 3) of them, outward
    weights   (k, n) share of each bone in carrying a vertex, together 1
    rgba      (4,) colour
    """

    name: str
    vertices: Array
    faces: Integers
    weights: Array
    rgba: Array


class Creature:
    """What of a run is bodies: `skeleton`, `surfaces`, `bound` and `skins`.

    raises  SceneError when the run has no bodies, or its model cannot be read
    """

    def __init__(self, run: OpenRun) -> None:
        if not has_bodies(run):
            raise SceneError(f"{run.folder} has no bodies. Add [solids] or [human] to its scene.")
        self.run, self.model = run, load_model(read_scene(run.folder / "scene.toml"))
        self._numbers = _bones(self.model)

    @cached_property
    def skeleton(self) -> Skeleton:
        model, bodies = self.model, self._numbers
        pivot = np.array([_pivot(model, int(body)) for body in bodies])
        number = {int(body): n for n, body in enumerate(bodies)}
        parents = [number.get(int(model.mj.body_parentid[b]), -1) if b else -1 for b in bodies]
        pose = kinematics(model, model.rest().q)
        rotation = self.run.every("body_rotation")[:, bodies]
        position = self.run.every("body_position")[:, bodies]
        frame = pose.body_rotation[bodies]
        return Skeleton(
            tuple(model.body_names[body] if body else WORLD for body in bodies),
            np.array(parents, np.int64),
            bodies,
            (pose.body_position[bodies] + np.einsum("nij,nj->ni", frame, pivot), frame),
            position + np.einsum("fnij,nj->fni", rotation, pivot),
            rotation,
        )

    @cached_property
    def surfaces(self) -> tuple[Surface, ...]:
        model = self.model
        pose = kinematics(model, model.rest().q)
        number = {int(body): n for n, body in enumerate(self._numbers)}
        number.setdefault(0, -1)
        found = []
        for geom, shape in enumerate(model.geom_shape):
            vertices, faces = shape.triangles()
            found.append(
                Surface(
                    model.geom_names[geom],
                    number[int(model.geom_body[geom])],
                    pose.geom_position[geom] + vertices @ pose.geom_rotation[geom].T,
                    np.asarray(faces, np.int64),
                    model.geom_rgba[geom],
                    bool(model.geom_covered[geom]),
                )
            )
        return tuple(found)

    @cached_property
    def bound(self) -> tuple[Bound, ...]:
        """The model's skins, which follow the bodies and have no part in the flow."""
        return tuple(
            Bound(skin.name, skin.vertices, skin.faces, skin.weights[:, self._numbers], skin.rgba)
            for skin in skins_of(self.model.mj)
        )

    @cached_property
    def seen(self) -> tuple[Surface, ...]:
        """The surfaces of bones that carry no skin of the model, which stands for theirs, and are
        not rigid with one that does."""
        clad = clad_bodies(self.model.mj)[self._numbers]
        return tuple(s for s in self.surfaces if s.bone < 0 or not clad[s.bone])

    @cached_property
    def skins(self) -> tuple[Skin, ...]:
        """Of every flesh that has an outside; empty without flesh."""
        flesh = self.model.flesh
        if flesh is None:
            return ()
        kept, found = on_skin(flesh), []
        for number, name in enumerate(flesh.names):
            triangles = flesh.surface[flesh.of_surface == number]
            vertices = np.unique(triangles)
            if vertices.size:
                found.append(
                    Skin(
                        name,
                        np.searchsorted(kept, vertices),
                        np.searchsorted(vertices, triangles),
                        flesh.rest[vertices],
                        flesh.carried[vertices][:, self._numbers],
                    )
                )
        return tuple(found)

    @cached_property
    def bounds(self) -> tuple[Array, Array]:
        """(3,) lower and upper corner of all that moves or is carried, over the whole run, m."""
        points = [self.run.every("flesh_vertices").reshape(-1, 3)] if self.skins else []
        turn, shift = self.skeleton.carried
        for surface in self.surfaces:
            if surface.bone < 0:
                continue
            low, high = surface.vertices.min(axis=0), surface.vertices.max(axis=0)
            corners = np.where(np.indices((2, 2, 2)).reshape(3, -1).T, low, high)
            moved = np.einsum("fij,kj->fki", turn[:, surface.bone], corners)
            points.append((moved + shift[:, None, surface.bone]).reshape(-1, 3))
        every = np.concatenate(points or [self.skeleton.position.reshape(-1, 3)])
        return every.min(axis=0), every.max(axis=0)

    @property
    def size(self) -> float:
        """Largest extent of bodies and flesh in the model's own pose, m."""
        points = [surface.vertices for surface in self.surfaces if surface.bone >= 0]
        points += [skin.rest for skin in self.skins]
        every = np.concatenate(points or [self.skeleton.rest[0]])
        return float(np.ptp(every, axis=0).max())


def has_bodies(run: OpenRun) -> bool:
    """Whether the scene of a run has a model."""
    return not {"solids", "human"}.isdisjoint(run.scene)


def in_parents(parents: Integers, position: Array, rotation: Array) -> tuple[Array, Array]:
    """Places (..., n, 3) and rotations (..., n, 3, 3) in the frames of the parents; roots stay."""
    place, turn = position.copy(), rotation.copy()
    for bone, parent in enumerate(parents):
        if parent >= 0:
            above = np.swapaxes(rotation[..., parent, :, :], -1, -2)
            turn[..., bone, :, :] = above @ rotation[..., bone, :, :]
            apart = position[..., bone, :] - position[..., parent, :]
            place[..., bone, :] = (above @ apart[..., None])[..., 0]
    return place, turn


def _bones(model: SolidModel) -> Integers:
    """Bodies that become bones; the world's where it holds several trees together, or flesh."""
    roots = int((model.mj.body_parentid[1 : model.nbody] == 0).sum())
    held = model.flesh is not None and bool(model.flesh.carried[:, 0].any())
    return np.arange(0 if roots != 1 or held else 1, model.nbody)


def _pivot(model: SolidModel, body: int) -> Array:
    """(3,) the point in a body's frame about which its first joint that turns does so, m."""
    mj = model.mj
    first = int(mj.body_jntadr[body])
    for joint in range(first, first + int(mj.body_jntnum[body])):
        if mj.jnt_type[joint] in (BALL, HINGE):
            return np.array(mj.jnt_pos[joint])
    return np.zeros(3)
