"""Corrections of a model: open meshes are closed, and overlaps at a fixed base do not collide.

MuJoCo ignores contact between a body and its parent, except where the parent is fixed to the
world. A base that floats in its own simulator, and is fixed here, would push away the hips that
overlap it.
"""

from __future__ import annotations

from collections.abc import Iterable

import mujoco
import numpy as np

from flowborne.kernels.arrays import Mesh
from flowborne.shapes.closing import SMALL_HOLE, closed, hull, is_closed, open_edges
from flowborne.solids.geoms import element_name, floors, mesh_of, rotation_of

MENDED = "(mended)"
"""Suffix of the names of changed meshes, and name of the text that lists them."""

EXCLUDED = "overlap at rest: "
"""Prefix of the names of <exclude> elements made here; the names of both bodies follow."""

ROTATIONAL = (mujoco.mjtJoint.mjJNT_HINGE, mujoco.mjtJoint.mjJNT_BALL)


def mend_meshes(spec: mujoco.MjSpec, mj: mujoco.MjModel, geoms: Iterable[int], hulls: bool) -> bool:
    """Close the open meshes of some geometries in a spec; return whether there was one.

    mj      of the spec
    hulls   whether meshes with large holes are replaced by their convex hulls
    raises  ValueError with the name of every body with a mesh that stays open
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
    """The changed meshes of a model and how each was changed; "" for none."""
    number = mujoco.mj_name2id(mj, mujoco.mjtObj.mjOBJ_TEXT, MENDED)
    if number < 0:
        return ""
    first = mj.text_adr[number]
    return bytes(mj.text_data[first : first + mj.text_size[number] - 1]).decode()


def _open(mj: mujoco.MjModel, geoms: Iterable[int]) -> dict[int, tuple[Mesh, str]]:
    """Number of each open mesh of the geometries -> the mesh, and a body that has it."""
    first: dict[int, int] = {}
    for geom in geoms:
        first.setdefault(int(mj.geom_dataid[geom]), geom)
    found = {}
    for number, geom in first.items():
        mesh = mesh_of(mj, geom)
        if mesh is not None and not is_closed(mesh):
            body = element_name(mj, mujoco.mjtObj.mjOBJ_BODY, int(mj.geom_bodyid[geom]))
            found[number] = mesh, body
    return found


def _replace(spec: mujoco.MjSpec, mj: mujoco.MjModel, number: int, mesh: Mesh) -> None:
    """Give the geometries of a mesh another one, in the frame to which MuJoCo has moved it."""
    vertices, faces = mesh
    placed = vertices @ rotation_of(mj.mesh_quat[number]).T + mj.mesh_pos[number]
    own = element_name(mj, mujoco.mjtObj.mjOBJ_MESH, number)
    added = spec.add_mesh(name=f"{own} {MENDED}")
    added.uservert, added.userface = placed.ravel(), faces.ravel().astype(np.int32)
    added.inertia = mujoco.mjtMeshInertia.mjMESH_INERTIA_EXACT
    for geom in spec.geoms:
        if geom.meshname == own and geom.type == mujoco.mjtGeom.mjGEOM_MESH:
            geom.meshname = added.name


def exclude_joined(spec: mujoco.MjSpec, mj: mujoco.MjModel) -> bool:
    """Exclude contact between fixed bodies and their children that overlap at rest.

    Only children on hinges and ball joints count, and no body with a floor.
    returns  whether any contact was excluded
    """
    data = mujoco.MjData(mj)
    mujoco.mj_kinematics(mj, data)
    mujoco.mj_comPos(mj, data)
    mujoco.mj_collision(mj, data)
    with_floor = mj.geom_bodyid[floors(mj)]
    overlapping = mj.geom_bodyid[data.contact.geom[data.contact.dist < 0.0]]
    pairs = {(base, other) for ends in overlapping.tolist() for base, other in (ends, ends[::-1])}
    bodies = {body.id: body for body in spec.bodies}
    excluded = False
    for base, other in sorted(pairs):
        if mj.body_weldid[base] or base in with_floor or not _hangs_on_fixed(mj, other):
            continue
        names = [element_name(mj, mujoco.mjtObj.mjOBJ_BODY, body) for body in (base, other)]
        for body, name in zip((base, other), names, strict=True):
            bodies[body].name = name  # <exclude> refers to bodies by name
        spec.add_exclude(
            name=EXCLUDED + " and ".join(names), bodyname1=names[0], bodyname2=names[1]
        )
        excluded = True
    return excluded


def _hangs_on_fixed(mj: mujoco.MjModel, body: int) -> bool:
    """Whether a body hangs on a fixed one by rotational joints only."""
    top = mj.body_weldid[body]
    first, count = mj.body_jntadr[top], mj.body_jntnum[top]
    held = top > 0 and mj.body_weldid[mj.body_parentid[top]] == 0
    return bool(held and count and np.isin(mj.jnt_type[first : first + count], ROTATIONAL).all())


def joined_pairs(mj: mujoco.MjModel) -> list[str]:
    """The pairs of bodies with excluded contact, both names joined by "and"."""
    names = [
        mujoco.mj_id2name(mj, mujoco.mjtObj.mjOBJ_EXCLUDE, number) for number in range(mj.nexclude)
    ]
    return [name.removeprefix(EXCLUDED) for name in names if name and name.startswith(EXCLUDED)]
