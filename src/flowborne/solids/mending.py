"""Meshes of a model that are open: closed, taken as their hulls, or refused, all at once."""

from __future__ import annotations

from collections.abc import Iterable

import mujoco
import numpy as np

from flowborne.shapes.closing import SMALL_HOLE, closed, hull, is_closed, open_edges
from flowborne.shapes.shape import Mesh
from flowborne.solids.geoms import element_name, mesh_of

MENDED = "(mended)"
"""End of the names of meshes that are not as in their files, and name of the text about them."""


def mend_meshes(spec: mujoco.MjSpec, mj: mujoco.MjModel, geoms: Iterable[int], hulls: bool) -> bool:
    """Close the open meshes of some geometries in a spec; gives whether there was one.

    mj      of the spec
    hulls   whether meshes with holes that are not small are replaced by their convex hulls
    raises  ValueError that names every body with a mesh that stays open
    """
    wide, flat, mended = list[str](), list[str](), list[str]()
    for number, (mesh, body) in _open(mj, geoms).items():
        edges = open_edges(mesh)
        name = f"{body} ({edges} open edges)" if edges else f"{body} (inside out)"
        whole, how = closed(mesh, SMALL_HOLE), "closed"
        if whole is None and hulls:
            whole, how = hull(mesh), "taken as its convex hull"
        if whole is not None:
            _replace(spec, mj, number, whole)
            mended.append(f"{name} {how}")
        else:
            (flat if hulls else wide).append(name)
    if wide:
        raise ValueError(
            f"the meshes of {', '.join(wide)} have holes wider than {SMALL_HOLE:.0%} of them. "
            'Close them, or write mend = "hull" into [solids] for their convex hulls.'
        )
    if flat:
        raise ValueError(
            f"the meshes of {', '.join(flat)} are flat. Leave their geoms out by displace in "
            "[solids]."
        )
    if mended:
        spec.add_text(name=MENDED, data=", ".join(mended))
    return bool(mended)


def mended_meshes(mj: mujoco.MjModel) -> str:
    """Which meshes of a model are not as in their files, and what was done; "" for none."""
    number = mujoco.mj_name2id(mj, mujoco.mjtObj.mjOBJ_TEXT, MENDED)
    if number < 0:
        return ""
    first = mj.text_adr[number]
    return bytes(mj.text_data[first : first + mj.text_size[number] - 1]).decode()


def _open(mj: mujoco.MjModel, geoms: Iterable[int]) -> dict[int, tuple[Mesh, str]]:
    """Number of each mesh of the geometries that is open -> the mesh, and a body that has it."""
    found: dict[int, tuple[Mesh, str]] = {}
    closed_ones = set[int]()
    for geom in geoms:
        number = int(mj.geom_dataid[geom])
        mesh = mesh_of(mj, geom)
        if mesh is None or number in found or number in closed_ones:
            continue
        if is_closed(mesh):
            closed_ones.add(number)
            continue
        body = element_name(mj, mujoco.mjtObj.mjOBJ_BODY, int(mj.geom_bodyid[geom]))
        found[number] = mesh, body
    return found


def _replace(spec: mujoco.MjSpec, mj: mujoco.MjModel, number: int, mesh: Mesh) -> None:
    """Give geometries another mesh, in the frame that MuJoCo has moved theirs to."""
    vertices, faces = mesh
    turn = np.empty(9)
    mujoco.mju_quat2Mat(turn, mj.mesh_quat[number])
    placed = vertices @ turn.reshape(3, 3).T + mj.mesh_pos[number]
    own = element_name(mj, mujoco.mjtObj.mjOBJ_MESH, number)
    added = spec.add_mesh(name=f"{own} {MENDED}")
    added.uservert, added.userface = placed.ravel(), faces.ravel().astype(np.int32)
    added.inertia = mujoco.mjtMeshInertia.mjMESH_INERTIA_EXACT
    for geom in spec.geoms:
        if geom.meshname == own and geom.type == mujoco.mjtGeom.mjGEOM_MESH:
            geom.meshname = added.name
