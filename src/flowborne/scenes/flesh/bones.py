"""What the bones fill at rest, as a signed distance in world axes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import mujoco
import numpy as np
import pyvista as pv
from numba import njit
from numpy.typing import NDArray

from flowborne.coupling.shapes import BOX, CAPSULE, CYLINDER, ELLIPSOID, SPHERE, signed_distance
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
            return _distances(KINDS[self.kind], self.size, local)
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


@njit(nogil=True, cache=True)
def _distances(kind: int, size: Array, points: Array) -> Array:
    none, nowhere = np.zeros(1), np.zeros(3)
    table = np.zeros(4, np.int64)
    distance = np.empty(len(points))
    for i in range(len(points)):
        if kind == ELLIPSOID:
            distance[i] = distance_off_ellipsoid(points[i], size)
        else:
            x, y, z = points[i]
            distance[i] = signed_distance(kind, size, x, y, z, none, table, nowhere, 1.0)
    return distance


@njit(nogil=True, cache=True)
def distance_off_ellipsoid(point: Array, semi: Array) -> float:
    """Signed distance of a point to an ellipsoid about the origin, m (Eberly 2013).

    The nearest point is semi^2 point / (t + semi^2) for the largest root t of the ellipsoid's
    equation. That is convex above -min(semi)^2, so Newton's method climbs to it from below.
    """
    least = semi.min()
    place = np.maximum(np.abs(point), 1e-9 * least)
    t = (semi * (place - semi)).max()
    for _ in range(100):
        ratio = semi * place / (t + semi**2)
        excess = (ratio**2).sum() - 1.0
        step = 0.5 * excess / (ratio**2 / (t + semi**2)).sum()
        t += step
        if step <= 1e-14 * least**2:
            break
    offset = place * t / (t + semi**2)
    return float(np.sign(t) * np.sqrt((offset**2).sum()))
