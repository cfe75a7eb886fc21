"""Geometries of one's own in a model: MuJoCo sees them as meshes."""

from __future__ import annotations

from collections.abc import Sequence

import mujoco
import numpy as np

from flowborne.shapes.own import OwnGeometry, PlacedShape, ShapeOwn, triangulated
from flowborne.shapes.shape import Mesh

Own = dict[str, OwnGeometry]
"""Name of a mesh of the model -> the geometry that it stands for."""


def own_by_mesh(shapes: Sequence[PlacedShape]) -> Own:
    """The geometries by the meshes that `add_shapes` makes of them."""
    return {f"own_shape_{n}": one.geometry for n, one in enumerate(shapes)}


def add_shapes(spec: mujoco.MjSpec, shapes: Sequence[PlacedShape]) -> None:
    """Add geometries of one's own to the bodies of a model.

    They have mass, inertia and contact as meshes have; in contact the hull counts, so nothing goes
    through the hole of a ring.
    raises  ValueError for one on a body that is not there; PartError as `triangulated`
    """
    for name, one in zip(own_by_mesh(shapes), shapes, strict=True):
        body = spec.body(one.body)
        if body is None:
            known = ", ".join(body.name for body in spec.bodies)
            raise ValueError(f"there is no body '{one.body}' for a shape. There are: {known}.")
        vertices, faces = triangulated(one.geometry)
        mesh = spec.add_mesh(name=name)
        mesh.uservert, mesh.userface = vertices.ravel(), faces.ravel().astype(np.int32)
        mesh.inertia = mujoco.mjtMeshInertia.mjMESH_INERTIA_EXACT
        geom = body.add_geom(type=mujoco.mjtGeom.mjGEOM_MESH, meshname=name, pos=one.position)
        mujoco.mju_mat2Quat(geom.quat, one.rotation.ravel())
        if one.density is not None:
            geom.density, geom.mass = one.density, np.nan


def own_shape(mj: mujoco.MjModel, mesh: int, geometry: OwnGeometry, triangles: Mesh) -> ShapeOwn:
    """A geometry of one's own in the frame of the mesh that stands for it.

    MuJoCo moves the vertices of a mesh to its centre of mass and along its principal axes.
    """
    turn = np.empty(9)
    mujoco.mju_quat2Mat(turn, mj.mesh_quat[mesh])
    return ShapeOwn(geometry, np.array(mj.mesh_pos[mesh]), turn.reshape(3, 3), *triangles)
