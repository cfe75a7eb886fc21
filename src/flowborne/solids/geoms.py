"""Geometries of a compiled model: their kinds, shapes and poses at rest."""

from __future__ import annotations

from collections.abc import Sequence

import mujoco
import numpy as np

from flowborne.kernels.arrays import Array, Mesh
from flowborne.shapes.own import OwnGeometry, PlacedShape, ShapeOwn, triangulated
from flowborne.shapes.primitives import shape_of
from flowborne.shapes.shape import Shape

Own = dict[str, OwnGeometry]
"""Name of a mesh of the model -> the user's geometry that it represents."""

HIDDEN_GROUP = 3
"""Geometries in this group and above collide but displace no fluid (MuJoCo's convention)."""

DISPLACED = "displaced by "
"""Prefix of the name of a body's <numeric>, see `said_to_displace`."""

CONTACT_ONLY = ("plane", "hfield")

NONE: Own = {}


def own_by_mesh(shapes: Sequence[PlacedShape]) -> Own:
    """The user's geometries by the meshes that `add_shapes` makes of them."""
    return {f"own_shape_{n}": one.geometry for n, one in enumerate(shapes)}


def add_shapes(spec: mujoco.MjSpec, shapes: Sequence[PlacedShape]) -> None:
    """Add the user's geometries to the bodies of a model, as meshes.

    They have the mass, inertia and contact of meshes; contact uses the convex hull, so nothing
    passes through the hole of a ring.
    raises  ValueError for an unknown body; PartError as `triangulated`
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


def rotation_of(quaternion: Array) -> Array:
    """(3, 3) rotation of a unit quaternion (4,) with its real part first."""
    entries = np.empty(9)
    mujoco.mju_quat2Mat(entries, quaternion)
    return entries.reshape(3, 3)


def box_of(mj: mujoco.MjModel, geom: int, position: Array, rotation: Array) -> tuple[Array, Array]:
    """(3,) lowest and highest corner of a box around a geometry at a pose, m."""
    middle, half = mj.geom_aabb[geom].reshape(2, 3)
    centre, reach = position + rotation @ middle, np.abs(rotation) @ half
    return centre - reach, centre + reach


def kind_of(mj: mujoco.MjModel, geom: int) -> str:
    """Type of a geometry as MJCF spells it."""
    return mujoco.mjtGeom(int(mj.geom_type[geom])).name.removeprefix("mjGEOM_").lower()


def floors(mj: mujoco.MjModel) -> list[int]:
    """Numbers of the planes and height fields."""
    return [g for g in range(mj.ngeom) if kind_of(mj, g) in CONTACT_ONLY]


def solid_geoms(mj: mujoco.MjModel) -> list[int]:
    """Numbers of the geoms that have a volume."""
    return [g for g in range(mj.ngeom) if kind_of(mj, g) not in CONTACT_ONLY]


def displacing_geoms(mj: mujoco.MjModel) -> list[int]:
    """Numbers of the geoms that displace fluid: solid ones below HIDDEN_GROUP."""
    return [g for g in solid_geoms(mj) if mj.geom_group[g] < HIDDEN_GROUP]


def element_name(mj: mujoco.MjModel, kind: mujoco.mjtObj, index: int) -> str:
    """Name in the MJCF, or the kind and number of a nameless element."""
    name = mujoco.mj_id2name(mj, kind, index)
    return str(name) if name else f"{kind.name.removeprefix('mjOBJ_').lower()}{index}"


def geom_name(mj: mujoco.MjModel, geom: int) -> str:
    """Name of a geometry, see `element_name`."""
    return element_name(mj, mujoco.mjtObj.mjOBJ_GEOM, geom)


def mesh_of(mj: mujoco.MjModel, geom: int) -> Mesh | None:
    """Vertices in the geometry's frame and faces of a mesh geometry; None for the others."""
    if kind_of(mj, geom) != "mesh":
        return None
    m = mj.geom_dataid[geom]
    vertex, face = mj.mesh_vertadr[m], mj.mesh_faceadr[m]
    vertices = mj.mesh_vert[vertex : vertex + mj.mesh_vertnum[m]]
    faces = mj.mesh_face[face : face + mj.mesh_facenum[m]]
    return vertices.astype(np.float64), faces.astype(np.int64)


def geom_shape(mj: mujoco.MjModel, geom: int, own: Own = NONE) -> Shape:
    """A geometry that displaces fluid, in its own frame; `own` are the user's geometries.

    MuJoCo moves the vertices of a mesh to its centre of mass and along its principal axes.
    """
    mesh = mesh_of(mj, geom)
    if mesh is not None:
        number = int(mj.geom_dataid[geom])
        geometry = own.get(element_name(mj, mujoco.mjtObj.mjOBJ_MESH, number))
        if geometry is not None:
            centre, rotation = np.array(mj.mesh_pos[number]), rotation_of(mj.mesh_quat[number])
            return ShapeOwn(geometry, centre, rotation, *mesh)
    return shape_of(kind_of(mj, geom), mj.geom_size[geom], mesh)


def rest_poses(mj: mujoco.MjModel) -> tuple[Array, Array, Array, Array]:
    """World poses at rest: body positions and rotations, geometry positions and rotations."""
    data = mujoco.MjData(mj)
    mujoco.mj_kinematics(mj, data)
    return (
        data.xpos.copy(),
        data.xmat.reshape(-1, 3, 3).copy(),
        data.geom_xpos.copy(),
        data.geom_xmat.reshape(-1, 3, 3).copy(),
    )


def quaternion_of(rotation: Array) -> Array:
    """(4,) w, x, y, z of a rotation matrix (3, 3), with w >= 0."""
    unit = np.zeros(4)
    mujoco.mju_mat2Quat(unit, np.ascontiguousarray(rotation).ravel())
    return unit if unit[0] >= 0.0 else -unit


def said_to_displace(mj: mujoco.MjModel, body: int) -> tuple[float, Array] | None:
    """Volume, m^3, and (3,) centre in the frame of a body, m, from the model; None if not given.

    The model gives them, where bodies overlap, as a <numeric> of four numbers. Its name is
    DISPLACED followed by the name of the body.
    """
    name = DISPLACED + element_name(mj, mujoco.mjtObj.mjOBJ_BODY, body)
    number = mujoco.mj_name2id(mj, mujoco.mjtObj.mjOBJ_NUMERIC, name)
    if number < 0:
        return None
    first = int(mj.numeric_adr[number])
    volume, *centre = mj.numeric_data[first : first + 4].tolist()
    return volume, np.array(centre)
