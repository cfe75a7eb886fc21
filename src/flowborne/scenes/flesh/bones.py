"""What the bones fill at rest, as a signed distance in world axes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import mujoco
import numpy as np
import pyvista as pv
from numpy.typing import NDArray

from flowborne.kernels.distance import BOX, CAPSULE, CYLINDER, ELLIPSOID, SPHERE, distances
from flowborne.scenes.wording import suggestion
from flowborne.solids.mjcf import (
    compiled_quietly,
    displacing_geoms,
    element_name,
    kind_of,
    mesh_of,
    rest_poses,
)

Array = NDArray[np.float64]

KINDS = {
    "sphere": SPHERE,
    "capsule": CAPSULE,
    "cylinder": CYLINDER,
    "box": BOX,
    "ellipsoid": ELLIPSOID,
}


@dataclass(frozen=True)
class Part:
    """One geometry of a bone.

    bone      number of the bone
    kind      as MJCF spells it
    size      (3,) MuJoCo's half sizes, m
    position  (3,) centre, m
    rotation  (3, 3) geometry's frame to the world's
    low, high (3,) corners of a box around it in world axes, m
    thinnest  smallest half size, m
    mesh      closed surface in the geometry's frame, for a mesh
    """

    bone: int
    kind: str
    size: Array
    position: Array
    rotation: Array
    low: Array
    high: Array
    thinnest: float
    mesh: pv.PolyData | None

    def distance(self, points: Array) -> Array:
        """(n,) signed distances of points (n, 3), negative inside, m."""
        local = np.ascontiguousarray((points - self.position) @ self.rotation)
        if self.mesh is None:
            return distances(KINDS[self.kind], self.size, local)
        cloud = pv.PolyData(local).compute_implicit_distance(self.mesh)
        return np.asarray(cloud["implicit_distance"], dtype=np.float64)


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
        """(3,) lowest and highest corner around all of them, m."""
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
    """The bodies `names` of a model, as far as they displace fluid.

    raises  ValueError for an unknown body and for one without such a geom
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
        parts += [_part(mj, g, bone, position[g], rotation[g]) for g in own]
    return Bones(tuple(names), tuple(parts))


def _part(mj: mujoco.MjModel, geom: int, bone: int, position: Array, rotation: Array) -> Part:
    kind, size, mesh = kind_of(mj, geom), np.array(mj.geom_size[geom]), mesh_of(mj, geom)
    middle, half = mj.geom_aabb[geom].reshape(2, 3)
    centre, reach = position + rotation @ middle, np.abs(rotation) @ half
    return Part(
        bone,
        kind,
        size,
        position,
        rotation,
        centre - reach,
        centre + reach,
        float(half.min()),
        None if mesh is None else pv.PolyData.from_regular_faces(*mesh),
    )
