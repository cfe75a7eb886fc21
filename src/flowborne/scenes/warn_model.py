"""Warnings about what a model has that the fluid does not meet."""

from __future__ import annotations

from collections.abc import Iterator

import mujoco
import numpy as np

from flowborne.coupling.world import Setup
from flowborne.phrases import listed
from flowborne.scenes.bodies import initial_state
from flowborne.scenes.check_bodies import geom_boxes
from flowborne.scenes.creature import counted_bodies, unmet_bodies
from flowborne.scenes.schema import Scene
from flowborne.solids.geoms import element_name, floors, kind_of, rest_poses

LEAST_MASS = 0.01
"""Part of the creature's mass. Bodies without any geom that have less together are frames; 1 % of
the mass is less than a force of the fluid is right to on the grids that films have."""


def bodies_not_met(scene: Scene, setup: Setup) -> Iterator[str]:
    """Moving bodies that displace no fluid, though they have geoms that could, or mass."""
    if setup.fluid is None:
        return
    model, unmet = setup.solid, unmet_bodies(setup.solid)
    bare = model.mj.body_geomnum[unmet] == 0
    whole = model.body_mass[counted_bodies(model)].sum()
    named = unmet
    if model.body_mass[unmet[bare]].sum() <= LEAST_MASS * whole:
        named = unmet[~bare]
    if named.size:
        them = "it" if named.size == 1 else "them"
        yield (
            f"[solids]: no geom of {listed([model.body_names[b] for b in named])} displaces "
            f"fluid, which flows through {them}; [solids] displace names geoms that do, and a body "
            "without any needs one in the model"
        )


def fixed_outside(scene: Scene, setup: Setup) -> Iterator[str]:
    """Geoms of bodies that do not move, wholly outside the domain."""
    if setup.fluid is None or scene.domain is None:
        return
    model, domain = setup.solid, scene.domain
    low, high = geom_boxes(model, initial_state(scene, model).q)
    axes = slice(0, scene.dimensions)
    gone = (high[:, axes] <= domain.lower) | (low[:, axes] >= domain.upper)
    fixed = ~model.moving[model.geom_body]
    names = [model.geom_names[g] for g in np.flatnonzero(gone.any(axis=1) & fixed)]
    if names:
        yield (
            f"[domain]: {listed(names)} lie{'s' * (len(names) == 1)} outside the domain, and no "
            "fluid meets it; a larger domain does, and [solids] displace.without leaves geoms out"
        )


def floors_in_fluid(scene: Scene, setup: Setup) -> Iterator[str]:
    """Planes and height fields inside the domain: bodies rest on them, and the fluid does not."""
    if setup.fluid is None or scene.domain is None:
        return
    mj, grid = setup.solid.mj, setup.fluid.grid
    low, high = np.array(grid.origin), np.array(grid.origin) + grid.spacing * np.array(grid.shape)
    corners = np.array(np.meshgrid(*zip(low, high, strict=True))).reshape(3, -1).T
    _, _, position, rotation = rest_poses(mj)
    for geom in floors(mj):
        kind = kind_of(mj, geom)
        height = (corners - position[geom]) @ rotation[geom][:, 2]
        top = mj.hfield_size[mj.geom_dataid[geom], 2] if kind == "hfield" else 0.0
        if height.min() < -grid.spacing and height.max() > top + grid.spacing:
            name = element_name(mj, mujoco.mjtObj.mjOBJ_GEOM, geom)
            yield (
                f"[domain]: the {kind} '{name}' lies inside the fluid, which flows through it; a "
                "domain that ends there has a solid side, and a box in the model is met"
            )
