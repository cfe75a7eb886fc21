"""What the bones fill at rest: signed distances, and closed surfaces around them, in world axes."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass

import mujoco
import numpy as np

from flowborne.base.extras import flesh_library
from flowborne.base.phrases import suggestion
from flowborne.kernels.arrays import Array, Mesh
from flowborne.shapes.mesh import ShapeMesh
from flowborne.shapes.own import level_surface
from flowborne.shapes.shape import Shape
from flowborne.solids.geoms import box_of, displacing_geoms, element_name, geom_shape, rest_poses
from flowborne.solids.mjcf import compiled_quietly

MOST_SAMPLES = 2_000_000
"""Most samples of a lattice; a finer lattice is made coarser."""


def signed_distance(points: Array, surface: Mesh) -> Array:
    """(n,) signed distances of points (n, 3) to a closed surface, negative inside, m."""
    pv = flesh_library()
    cloud = pv.PolyData(points)
    cloud.compute_implicit_distance(pv.PolyData.from_regular_faces(*surface), inplace=True)
    return np.asarray(cloud["implicit_distance"], dtype=np.float64)


@dataclass(frozen=True)
class Part:
    """One geometry of a bone.

    bone      number of the bone
    shape     in its own frame
    position  (3,) centre, m
    rotation  (3, 3) geometry's frame to the world's
    low, high (3,) corners of a box around it in world axes, m
    half      (3,) half sizes, m
    surface   the surface of a mesh, for a search by its cells; None for other kinds
    """

    bone: int
    shape: Shape
    position: Array
    rotation: Array
    low: Array
    high: Array
    half: Array
    surface: Mesh | None

    @property
    def thinnest(self) -> float:
        """Smallest half size, m."""
        return float(self.half.min())

    def distance(self, points: Array) -> Array:
        """(n,) signed distances of points (n, 3), negative inside, m."""
        local = np.ascontiguousarray((points - self.position) @ self.rotation)
        if self.surface is None:
            return self.shape.distance(local)
        return signed_distance(local, self.surface)


@dataclass(frozen=True)
class Bones:
    """Some bodies of a model at rest.

    names  of the bodies
    parts  their geometries
    """

    names: tuple[str, ...]
    parts: tuple[Part, ...]

    @property
    def box(self) -> tuple[Array, Array]:
        """(3,) lowest and highest corner of a box around all of them, m."""
        return (
            np.min([part.low for part in self.parts], axis=0),
            np.max([part.high for part in self.parts], axis=0),
        )

    @property
    def thinnest(self) -> float:
        """Smallest half size among the geometries, m."""
        return min(part.thinnest for part in self.parts)

    def distance(self, points: Array) -> Array:
        """(n,) signed distances of points (n, 3) to the nearest bone, negative inside, m."""
        nearest = np.full(len(points), np.inf)
        for part in self.parts:
            np.minimum(nearest, part.distance(points), out=nearest)
        return nearest

    def distances(self, points: Array) -> Array:
        """(n, number of bones) signed distances of points (n, 3) to each bone, m."""
        each = np.full((len(points), len(self.names)), np.inf)
        for part in self.parts:
            each[:, part.bone] = np.minimum(each[:, part.bone], part.distance(points))
        return each


def bones_of(spec: mujoco.MjSpec, names: Sequence[str]) -> Bones:
    """The geometries of the bodies `names` that displace fluid.

    raises  ValueError for an unknown body and for a body without such a geom
    """
    mj = compiled_quietly(spec.copy())
    known = [element_name(mj, mujoco.mjtObj.mjOBJ_BODY, b) for b in range(mj.nbody)]
    _, _, position, rotation = rest_poses(mj)
    displacing = displacing_geoms(mj)
    parts = []
    for bone, name in enumerate(names):
        if name not in known:
            raise ValueError(f"there is no body '{name}'{suggestion(name, known, 'There are')}")
        own = [g for g in displacing if mj.geom_bodyid[g] == known.index(name)]
        if not own:
            raise ValueError(
                f"body '{name}' has no geom for flesh to grow on. "
                "Give it one that displaces fluid, or leave it out of the bones."
            )
        for g in own:
            shape, box = geom_shape(mj, g), box_of(mj, g, position[g], rotation[g])
            surface = shape.triangles() if isinstance(shape, ShapeMesh) else None
            half = mj.geom_aabb[g, 3:]
            parts.append(Part(bone, shape, position[g], rotation[g], *box, half, surface))
    return Bones(tuple(names), tuple(parts))


def digest(spec: mujoco.MjSpec, names: Sequence[str]) -> str:
    """SHA-256 of the shapes and rest poses of all geometries of the bodies `names`, in hex."""
    mj = compiled_quietly(spec.copy())
    _, _, position, rotation = rest_poses(mj)
    found = hashlib.sha256()
    for name in names:
        body = mujoco.mj_name2id(mj, mujoco.mjtObj.mjOBJ_BODY, name)
        for geom in np.flatnonzero(mj.geom_bodyid == body) if body >= 0 else ():
            for values in (mj.geom_size[geom], position[geom], rotation[geom]):
                found.update(np.round(values, 9).tobytes())
            found.update(bytes([mj.geom_type[geom]]))
            mesh = mj.geom_dataid[geom]
            if mesh >= 0:
                first = mj.mesh_vertadr[mesh]
                found.update(mj.mesh_vert[first : first + mj.mesh_vertnum[mesh]].tobytes())
    return found.hexdigest()


def finest(bones: Bones, level: float) -> float:
    """Smallest distance between the samples of a contour, m."""
    low, high = bones.box
    return float(np.cbrt((high - low + 2.0 * level).prod() / MOST_SAMPLES))


def contour(bones: Bones, level: float, pitch: float) -> Mesh:
    """Closed outward surface `level` m outside the union of the bones, in world axes.

    The samples are `pitch` m apart: sharper edges are cut off.
    """
    pv = flesh_library()
    low, high = bones.box
    low, high = low - level, high + level
    pitch = max(pitch, finest(bones, level))
    counts = np.ceil((high - low) / pitch).astype(int) + 5
    lattice = pv.ImageData(dimensions=counts, spacing=(pitch,) * 3, origin=low - 2.0 * pitch)
    distance = bones.distance(np.asarray(lattice.points, dtype=np.float64))
    return level_surface(lattice, distance, level)
