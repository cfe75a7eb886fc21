"""The bodies of a run for other programs: a skeleton, surfaces on its bones, and skins.

Lengths are in m, in world axes with z up. The rest pose is the model's reference pose.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.spatial.transform import Rotation

from flowborne.base.errors import SceneError
from flowborne.kernels.arrays import Array, Integers
from flowborne.runs.open_run import StoredRun
from flowborne.runs.recorder import on_skin
from flowborne.scenes.bodies import load_model
from flowborne.scenes.load import read_scene
from flowborne.solids.dynamics import kinematics
from flowborne.solids.model import BALL, HINGE, SolidModel
from flowborne.solids.skins import ModelSkin, clad_bodies, skins_of

WORLD = "world"
"""Name of the bone of the world, if there is one."""

SKIN_COLOUR = np.array([0.86, 0.60, 0.48, 1.0])
"""Red, green, blue and opacity of flesh, which has no colour in the model."""


@dataclass(frozen=True, eq=False)
class Skeleton:
    """A bone for each moving body; its axes are the body's, its origin is at the joint.

    names     (n) of the bodies, parents before children
    parents   (n,) number of the parent, -1 for a root
    bodies    (n,) number of the body in the model
    rest      (n, 3) m and (n, 3, 3), position and rotation of the bones in the rest pose
    position  (frames, n, 3) m
    rotation  (frames, n, 3, 3) from the axes of the bone to the world's
    """

    names: tuple[str, ...]
    parents: Integers
    bodies: Integers
    rest: tuple[Array, Array]
    position: Array
    rotation: Array

    def local(self) -> tuple[Array, Array]:
        """(frames, n, 3) m and (frames, n, 3, 3) of every bone in the frame of its parent."""
        return relative_to_parents(self.parents, self.position, self.rotation)

    def rest_local(self) -> tuple[Array, Array]:
        """The same in the rest pose, (n, 3) m and (n, 3, 3)."""
        return relative_to_parents(self.parents, *self.rest)

    @cached_property
    def carried(self) -> tuple[Array, Array]:
        """(frames, n, 3, 3) R and (frames, n, 3) t, m: motion x -> R x + t from the rest pose."""
        position, rotation = self.rest
        R = np.einsum("fnij,nkj->fnik", self.rotation, rotation)
        return R, self.position - np.einsum("fnij,nj->fni", R, position)


@dataclass(frozen=True, eq=False)
class Surface:
    """A geometry in the rest pose.

    name      of the geometry
    vertices  (k, 3) m
    faces     (m, 3) vertices of each triangle, outward
    rgba      (4,) colour
    bone      number of the bone that carries it, -1 if it is fixed to the world
    """

    name: str
    vertices: Array
    faces: Integers
    rgba: Array
    bone: int


@dataclass(frozen=True, eq=False)
class Skin(ModelSkin):
    """The surface of one flesh in the rest pose, with weights (k, n) of the bones.

    chosen  (k,) its vertices in the `flesh_vertices` of a state
    """

    chosen: Integers


class Creature:
    """The bodies of a run: `skeleton`, `surfaces`, `bound` and `skins`.

    raises  SceneError if the run has no bodies, or its model cannot be read
    """

    def __init__(self, run: StoredRun) -> None:
        if not has_bodies(run):
            raise SceneError(f"{run.folder} has no bodies. Add [solids] or [human] to its scene.")
        self.run, self.model = run, load_model(read_scene(run.folder / "scene.toml"))
        self._bodies = _bones(self.model)
        self._bone_of = {int(body): bone for bone, body in enumerate(self._bodies)}
        self._rest = kinematics(self.model, self.model.rest().q)

    @cached_property
    def skeleton(self) -> Skeleton:
        model, bodies, bone_of = self.model, self._bodies, self._bone_of
        pivot = np.array([_pivot(model, int(body)) for body in bodies])
        parents = [bone_of.get(int(model.mj.body_parentid[b]), -1) if b else -1 for b in bodies]
        rest_rotation = self._rest.body_rotation[bodies]
        rest_position = self._rest.body_position[bodies]
        rotation = self.run.every("body_rotation")[:, bodies]
        position = self.run.every("body_position")[:, bodies]
        return Skeleton(
            tuple(model.body_names[body] if body else WORLD for body in bodies),
            np.array(parents, np.int64),
            bodies,
            (rest_position + np.einsum("nij,nj->ni", rest_rotation, pivot), rest_rotation),
            position + np.einsum("fnij,nj->fni", rotation, pivot),
            rotation,
        )

    @cached_property
    def surfaces(self) -> tuple[Surface, ...]:
        """All geometries of the model."""
        model, rest, bone_of = self.model, self._rest, {0: -1} | self._bone_of
        found = []
        for geom, shape in enumerate(model.geom_shape):
            vertices, faces = shape.triangles()
            found.append(
                Surface(
                    model.geom_names[geom],
                    rest.geom_position[geom] + vertices @ rest.geom_rotation[geom].T,
                    np.asarray(faces, np.int64),
                    model.geom_rgba[geom],
                    bone_of[int(model.geom_body[geom])],
                )
            )
        return tuple(found)

    @cached_property
    def bound(self) -> tuple[ModelSkin, ...]:
        """The model's skins with weights (k, n) of the bones; they do not affect the flow."""
        skins = skins_of(self.model.mj)
        return tuple(replace(skin, weights=skin.weights[:, self._bodies]) for skin in skins)

    @cached_property
    def seen(self) -> tuple[Surface, ...]:
        """The surfaces except those that a skin of the model replaces: surfaces of the bones that
        carry it, and of bones rigidly connected to these."""
        clad = clad_bodies(self.model.mj)[self._bodies]
        return tuple(s for s in self.surfaces if s.bone < 0 or not clad[s.bone])

    @cached_property
    def skins(self) -> tuple[Skin, ...]:
        """One of every flesh that has a surface; empty without flesh."""
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
                        flesh.rest[vertices],
                        np.searchsorted(vertices, triangles),
                        flesh.carried[vertices][:, self._bodies],
                        SKIN_COLOUR,
                        np.searchsorted(kept, vertices),
                    )
                )
        return tuple(found)

    @cached_property
    def bounds(self) -> tuple[Array, Array]:
        """(3,) lower and upper corner of all moving surfaces and flesh over the whole run, m."""
        points = [self.run.every("flesh_vertices").reshape(-1, 3)] if self.skins else []
        R, t = self.skeleton.carried
        for surface in self.surfaces:
            if surface.bone < 0:
                continue
            low, high = surface.vertices.min(axis=0), surface.vertices.max(axis=0)
            corners = np.where(np.indices((2, 2, 2)).reshape(3, -1).T, low, high)
            moved = np.einsum("fij,kj->fki", R[:, surface.bone], corners)
            points.append((moved + t[:, None, surface.bone]).reshape(-1, 3))
        every = np.concatenate(points or [self.skeleton.position.reshape(-1, 3)])
        return every.min(axis=0), every.max(axis=0)

    @property
    def size(self) -> float:
        """Largest extent of bodies and flesh in the rest pose, m."""
        points = [surface.vertices for surface in self.surfaces if surface.bone >= 0]
        points += [skin.vertices for skin in self.skins]
        every = np.concatenate(points or [self.skeleton.rest[0]])
        return float(np.ptp(every, axis=0).max())


def has_bodies(run: StoredRun) -> bool:
    """Whether the scene of a run has a model."""
    return not {"solids", "human"}.isdisjoint(run.tables)


def quaternions(rotation: Array) -> Array:
    """(..., 4) x, y, z, w of rotations (..., 3, 3)."""
    found = Rotation.from_matrix(rotation.reshape(-1, 3, 3)).as_quat()
    return np.asarray(found.reshape(*rotation.shape[:-2], 4))


def relative_to_parents(parents: Integers, position: Array, rotation: Array) -> tuple[Array, Array]:
    """Positions (..., n, 3) and rotations (..., n, 3, 3) in the parents' frames; roots stay."""
    local_position, local_rotation = position.copy(), rotation.copy()
    for bone, parent in enumerate(parents):
        if parent >= 0:
            to_parent = np.swapaxes(rotation[..., parent, :, :], -1, -2)
            local_rotation[..., bone, :, :] = to_parent @ rotation[..., bone, :, :]
            offset = position[..., bone, :] - position[..., parent, :]
            local_position[..., bone, :] = (to_parent @ offset[..., None])[..., 0]
    return local_position, local_rotation


def _bones(model: SolidModel) -> Integers:
    """Bodies that become bones. The world is one if it joins several trees or carries flesh."""
    roots = int((model.mj.body_parentid[1 : model.nbody] == 0).sum())
    carries_flesh = model.flesh is not None and bool(model.flesh.carried[:, 0].any())
    return np.arange(0 if roots != 1 or carries_flesh else 1, model.nbody)


def _pivot(model: SolidModel, body: int) -> Array:
    """(3,) position of a body's first rotational joint in the body's frame, m; 0 without one."""
    mj = model.mj
    first = int(mj.body_jntadr[body])
    for joint in range(first, first + int(mj.body_jntnum[body])):
        if mj.jnt_type[joint] in (BALL, HINGE):
            return np.array(mj.jnt_pos[joint])
    return np.zeros(3)
