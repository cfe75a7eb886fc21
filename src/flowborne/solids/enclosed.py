"""Geoms inside others, which no fluid meets, and bodies that are tied to others."""

from __future__ import annotations

import mujoco
import numpy as np

from flowborne.kernels.arrays import Integers, Mask
from flowborne.solids.geoms import box_of, geom_shape, kind_of, rest_poses, solid_geoms
from flowborne.solids.model import SolidModel

PAIRS = int(mujoco.mjtEq.mjEQ_CONNECT), int(mujoco.mjtEq.mjEQ_WELD)
"""Equalities that tie two bodies or sites."""

SITE, SITE_OF_TENDON = int(mujoco.mjtObj.mjOBJ_SITE), int(mujoco.mjtWrap.mjWRAP_SITE)


def enclosing_geoms(model: SolidModel) -> Integers:
    """(mj.ngeom,) for each geom the geometry of `model` that holds it at rest, -1 for none.

    It lies inside if a line through each of its points enters that geometry before the point, and
    does not leave it there. Geoms without a volume are in none.
    """
    mj, found = model.mj, np.full(model.mj.ngeom, -1)
    _, _, position, rotation = rest_poses(mj)
    solid = [g for g in solid_geoms(mj) if kind_of(mj, g) != "sdf"]
    axes = slice(0, 2 if model.slab else 3)
    boxes = [box_of(mj, g, position[g], rotation[g]) for g in solid]
    low, high = np.array(boxes).reshape(-1, 2, 3).swapaxes(0, 1)[..., axes]
    direction = np.array([0.0, 1.0, 0.0] if model.slab else [0.0, 0.0, 1.0])
    for hull, outer in enumerate(model.geom_id.tolist()):
        place, turn = solid.index(outer), rotation[outer]
        inside = (low > low[place]).all(axis=1) & (high < high[place]).all(axis=1)
        for g in (solid[n] for n in np.flatnonzero(inside)):
            if found[g] >= 0:
                continue
            points = position[g] + geom_shape(mj, g).landmarks() @ rotation[g].T
            if model.slab:
                points[:, 2] = 0.0
            rays = (points - position[outer]) @ turn, direction @ turn
            line, at, sign = model.geom_shape[hull].crossings(*rays)
            entered = np.bincount(line, np.where(at < 0.0, sign, 0.0), len(points))
            found[g] = hull if (entered > 0.0).all() else -1
    return found


def hidden_geoms(model: SolidModel) -> Mask:
    """(ngeom,) geometries of `model` that no fluid meets in any pose: inside flesh, or inside a
    geometry of the same body or of one fixed to it."""
    hull = enclosing_geoms(model)[model.geom_id]
    weld = model.mj.body_weldid[model.geom_body]
    return model.geom_covered | ((hull >= 0) & (weld == weld[hull]))


def tied_bodies(mj: mujoco.MjModel, number: int) -> list[int]:
    """The two bodies that an equality ties to each other, by sites or not; none of another kind."""
    if mj.eq_type[number] not in PAIRS:
        return []
    pair = int(mj.eq_obj1id[number]), int(mj.eq_obj2id[number])
    return [int(mj.site_bodyid[n]) if mj.eq_objtype[number] == SITE else n for n in pair]


def tied_roots(mj: mujoco.MjModel) -> set[int]:
    """Bodies on the world that an equality or a tendon ties to another one, or to the world."""
    ends = [set(tied_bodies(mj, number)) for number in range(mj.neq)]
    for first, count in zip(mj.tendon_adr, mj.tendon_num, strict=True):
        wraps = range(first, first + count)
        sites = [n for n in wraps if mj.wrap_type[n] == SITE_OF_TENDON]
        ends.append({int(mj.site_bodyid[mj.wrap_objid[n]]) for n in sites})
    roots = [{int(mj.body_rootid[body]) for body in bodies} for bodies in ends]
    return set().union(*(tied for tied in roots if len(tied) > 1))
