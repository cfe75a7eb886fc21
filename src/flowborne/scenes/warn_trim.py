"""Warnings about trim: what rises to a closed top, and what buoyancy counts twice."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from flowborne.coupling.world import Fluid, Setup
from flowborne.fluid.boundary import SIDES
from flowborne.kernels.arrays import Array
from flowborne.scenes.bodies import driven_dofs, initial_state
from flowborne.scenes.creature import displaced_mass
from flowborne.scenes.schema import Scene
from flowborne.solids.enclosed import enclosing_geoms, tied_roots
from flowborne.solids.geoms import rest_poses
from flowborne.solids.model import FREE, SLIDE
from flowborne.solids.surfaces import Outline

LIDS = "closed", "no-slip"
"""Kinds of sides that no body leaves by."""

UPRIGHT = 0.99
"""Cosine of the angle of gravity to an axis, from which a side of the domain is its top."""

ADDED_MASS = {True: 1.0, False: 0.5}
"""Of a circle in a slab and of a sphere, in masses of the fluid in its place."""

DRAG = 1.0
"""Drag coefficient of a blunt body."""


def pinned_under_lid(scene: Scene, setup: Setup) -> Iterator[str]:
    """Free bodies lighter than the fluid in their place that reach a closed top during the run."""
    model, fluid, gravity = setup.solid, setup.fluid, setup.solid.gravity
    size = float(np.linalg.norm(gravity))
    if fluid is None or fluid.one_way or scene.domain is None or not size:
        return
    axis = int(np.abs(gravity).argmax())
    up = -float(np.sign(gravity[axis]))
    lid = fluid.boundaries.pair(axis)[int(up > 0.0)]
    if lid.kind not in LIDS or abs(gravity[axis]) < UPRIGHT * size or axis >= scene.dimensions:
        return
    grid, q = fluid.grid, initial_state(scene, model).q
    outline = Outline(model)
    points, owner = outline.at(q), model.mj.body_rootid[outline.body]
    top = up * (grid.upper[axis] if up > 0.0 else grid.origin[axis])
    for root in _drifting(scene, setup, axis):
        counted = model.mj.body_rootid[: len(model.body_mass)] == root
        own = points[owner == root]
        if model.flesh is not None:
            own = np.concatenate([own, model.flesh.rest])
        mass, displaced = float(model.body_mass[counted].sum()), displaced_mass(setup, counted)
        if not displaced or mass >= displaced or not len(own):
            continue
        way = top - float((up * own[:, axis]).max())
        time = rising_time(way, mass, displaced, size, _across(own, axis, scene.is_slab), fluid)
        frames = math.floor(time * scene.time.frames_per_second)
        if frames >= scene.time.frames:
            continue
        unit = "kg/m" if scene.is_slab else "kg"
        ends = f", and time.frames = {frames} ends before" if frames > 0 else ""
        yield (
            f"[boundaries]: '{model.body_names[root]}' of {mass:.3g} {unit} is lighter than the "
            f"{displaced:.3g} {unit} of fluid in its place: it is pinned under the {lid.kind} side "
            f"{SIDES[2 * axis + int(up > 0.0)]} about {time:.2g} s after the start, as there is no "
            f"free surface; with {displaced:.6g} {unit} it stays where it is{ends}"
        )


def _drifting(scene: Scene, setup: Setup, axis: int) -> Iterator[int]:
    """Bodies on the world that are free to go along `axis`, by a free joint or by a slide without
    range and spring, which nothing drives and no equality and no tendon ties to another body on
    the world.

    Where there is flesh, only if it is that of the one creature.
    """
    model, mj = setup.solid, setup.solid.mj
    driven, tied = driven_dofs(scene, model, setup.motions), tied_roots(mj)
    turned = rest_poses(mj)[1]
    if model.flesh is not None and len(np.unique(model.dof_root)) > 1:
        return
    for joint in range(mj.njnt):
        root, dof = int(mj.jnt_bodyid[joint]), int(mj.jnt_dofadr[joint])
        if mj.body_parentid[root] or root >= model.nbody or root in tied:
            continue
        along = abs((turned[root] @ mj.jnt_axis[joint])[axis]) > UPRIGHT
        held = mj.jnt_limited[joint] or mj.jnt_stiffness[joint] > 0.0
        slides = mj.jnt_type[joint] == SLIDE and along and not held
        free = mj.jnt_type[joint] == FREE
        if (free and not driven[dof + axis]) or (slides and not driven[dof]):
            yield root


def _across(points: Array, axis: int, slab: bool) -> tuple[float, float]:
    """Frontal area, m^2, and width, m, of what moves along `axis`; both per metre in a slab."""
    wide = np.delete(np.ptp(points, axis=0), axis)
    if slab:
        return float(wide[0]), float(wide[0])
    area = 0.25 * math.pi * float(wide.prod())
    return area, math.sqrt(4.0 / math.pi * area)


def rising_time(
    way: float,
    mass: float,
    displaced: float,
    gravity: float,
    across: tuple[float, float],
    fluid: Fluid,
) -> float:
    """s in which a light body rises by `way` m from rest, about as a sphere of its width does.

    It starts with the acceleration that its added mass leaves, and goes at most as fast as Stokes'
    drag and that of a blunt body allow, 3 pi mu d v + rho A v^2 / 2 = (displaced - mass) g.

    mass, displaced  kg
    gravity          m/s^2
    across           as of `_across`
    """
    area, width = across
    slab = fluid.grid.is_slab
    lift = (displaced - mass) * gravity
    start = lift / (mass + ADDED_MASS[slab] * displaced)
    linear = 3.0 * math.pi * fluid.viscosity * (1.0 if slab else width)
    square = 0.5 * DRAG * fluid.density * area
    end = 2.0 * lift / (linear + math.sqrt(linear**2 + 4.0 * square * lift))
    reach = max(way, 0.0) * start / end**2
    return end / start * (reach + math.log1p(math.sqrt(-math.expm1(-2.0 * reach))))


def counted_twice(scene: Scene, setup: Setup) -> Iterator[str]:
    """Bodies inside the hull of another one: buoyancy acts on both, as if water met both."""
    fluid, model = setup.fluid, setup.solid
    if fluid is None or fluid.one_way or not model.gravity.any():
        return
    hulls = enclosing_geoms(model)[model.geom_id]
    for body in np.unique(model.geom_body):
        own = np.flatnonzero((model.geom_body == body) & ~model.geom_covered)
        held = model.geom_body[hulls[own]]
        if not len(own) or (hulls[own] < 0).any() or (held == body).any():
            continue
        if model.moving[body]:
            yield (
                f"[solids]: '{model.body_names[body]}' lies inside '{model.body_names[held[0]]}', "
                "where no fluid meets it, and buoyancy acts on both; displace.without = "
                f"{[model.geom_names[g] for g in own]} leaves it its mass alone"
            )
