"""The fluid of a scene and the window in which it is simulated: checks and builders."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from flowborne.base.phrases import listed
from flowborne.base.tables import triple
from flowborne.control.surroundings import Surroundings
from flowborne.coupling.cut import following
from flowborne.coupling.world import Fluid
from flowborne.fluid.boundary import Boundaries
from flowborne.fluid.grid import Grid
from flowborne.fluid.window import crosses
from flowborne.kernels.arrays import FREE, Array
from flowborne.motion.inflow import Bands, DyeBandsValue
from flowborne.scenes.domain import Domain, check_memory
from flowborne.scenes.draft import Draft, Key
from flowborne.scenes.dye import BoxTable, DyeBands, DyeBox, check_bands
from flowborne.scenes.schema import Scene
from flowborne.scenes.sides import DyeValue, InflowSide, check_outlet, check_sides
from flowborne.solids.model import SolidModel

NEEDS_DOMAIN = ("fluid", "boundaries", "sources", "mouths", "thruster", "dye")


def fluid_of(scene: Scene) -> Fluid | None:
    """The fluid's fixed properties; None when the scene has none, or leaves it out."""
    if scene.domain is None or not scene.has_fluid:
        return None
    assert scene.fluid is not None
    assert scene.boundaries is not None
    table, grid = scene.fluid, scene.domain.grid()
    sides = {
        name: side.build(grid, "xyz".index(name[0]), _entering(name, scene, grid))
        for name, side in scene.boundaries
        if not (scene.is_slab and name[0] == "z")
    }
    sources = tuple(source.build() for source in scene.sources)
    sources += tuple(dye.build() for dye in scene.dye if isinstance(dye, DyeBox))
    return Fluid(
        grid,
        table.density,
        viscosity=table.viscosity,
        boundaries=Boundaries(**sides),
        sources=sources,
        scalars=scene.scalars(),
        body_force=triple(table.body_force),
        tolerance=table.tolerance,
        one_way=table.coupling == "one-way",
    )


def _entering(side: str, scene: Scene, grid: Grid) -> dict[str, DyeValue]:
    """The dyes that enter through a side."""
    groups: dict[str, tuple[Bands, ...]] = {}
    for dye in scene.dye:
        if isinstance(dye, DyeBands) and dye.side == side:
            groups[dye.name] = (*groups.get(dye.name, ()), dye.build(grid))
    return {name: DyeBandsValue(bands) for name, bands in groups.items()}


def with_window(fluid: Fluid | None, scene: Scene, model: SolidModel, q: Array) -> Fluid | None:
    """The fluid whose grid follows what the scene names, from the positions q (nq,) on."""
    domain = scene.domain
    if fluid is None or domain is None or not domain.follows:
        return fluid
    named = domain.follow != "bodies"
    bodies = [model.body(domain.follow)] if named else np.flatnonzero(model.moving).tolist()
    return following(fluid, model, q, bodies, domain.axes)


def check_dimensions(draft: Draft) -> Iterator[str]:
    """Vectors and corners must have the dimensions of the scene."""
    scene = draft.scene
    if not draft.sound("dimensions"):
        return
    if scene.domain is not None and len(scene.domain.lower) != scene.dimensions:
        yield (
            f"{draft.at('domain')} has corners of {len(scene.domain.lower)} numbers in a scene of "
            f"{scene.dimensions} dimensions. Give {scene.dimensions} numbers, or change dimensions."
        )
    if scene.is_slab:
        for keys, vector in _vectors(draft):
            if vector[2] != 0.0:
                yield (
                    f"{draft.at(*keys)}: {list(vector)} leaves the plane of a scene of 2 "
                    "dimensions. Make its z component 0."
                )


def _vectors(draft: Draft) -> Iterator[tuple[tuple[Key, ...], tuple[float, ...]]]:
    scene = draft.scene
    yield ("gravity",), scene.gravity
    tables: list[tuple[tuple[Key, ...], Any]] = [(("fluid",), scene.fluid)]
    tables += [(("boundaries", name), side) for name, side in scene.boundaries or ()]
    for key in ("sources", "mouths", "wind"):
        tables += [((key, index), table) for index, table in enumerate(getattr(scene, key))]
    for keys, table in tables:
        for key in ("velocity", "body_force", "position", "direction", "force"):
            if (vector := getattr(table, key, None)) is not None:
                yield (*keys, key), vector


def check_fluid(draft: Draft) -> Iterator[str]:
    """Everything about the fluid belongs to a domain, and its boundaries must agree."""
    scene = draft.scene
    if scene.domain is None:
        if draft.sound("domain"):
            for table in NEEDS_DOMAIN:
                if draft.gives(table):
                    yield (
                        f"{draft.at(table)}: there is no [domain] to fill. "
                        "Add [domain], or drop this table."
                    )
            if not scene.has_bodies and draft.sound("solids", "human"):
                yield (
                    f"{draft.at()} has neither [domain] nor [solids]: there is nothing to "
                    "simulate. Add one of them."
                )
        return
    if len(scene.domain.lower) != scene.dimensions:
        return
    yield from check_memory(draft, scene.domain)
    yield from _check_window(draft, scene.domain)
    if scene.boundaries is not None and draft.sound("boundaries"):
        yield from check_sides(draft, scene.boundaries, slab=scene.is_slab)
        free = any(side.boundary.normal == FREE for _, side in scene.boundaries)
        if scene.mouths and scene.is_two_way and not free:
            yield (
                f"{draft.at('boundaries')}: what a mouth expels has nowhere to go, as no side is "
                "open. Make a side open."
            )
        rates = [source.volume_rate or 0.0 for source in scene.sources]
        if draft.sound("sources"):
            yield from check_outlet(draft, scene.boundaries, scene.domain, rates)
        yield from check_bands(draft, scene.dye, scene.boundaries, scene.domain)
    for key, tables in (("sources", scene.sources), ("dye", scene.dye)):
        for index, box in enumerate(tables):
            if isinstance(box, BoxTable):
                yield from draft.said(box.check(scene.domain), key, index)
    if scene.film.field == "dye" and not scene.scalars() and draft.sound("film", "dye", "mouths"):
        yield (
            f"{draft.at('film', 'field')}: there is no dye to show. Add [[dye]], or show "
            "vorticity, speed or pressure."
        )


def _check_window(draft: Draft, domain: Domain) -> Iterator[str]:
    """There must be fluid beyond the sides across which the domain moves."""
    scene, axes = draft.scene, domain.axes
    if not domain.follows:
        if domain.along is not None:
            yield (
                f"{draft.at('domain', 'along')}: the domain follows nothing. "
                "Give follow, or drop this key."
            )
        return
    if not scene.has_bodies:
        yield (
            f"{draft.at('domain', 'follow')}: there are no bodies. "
            "Add [solids] with a model, or drop this key."
        )
    if scene.is_slab and 2 in axes:
        yield (
            f"{draft.at('domain', 'along')}: a scene of 2 dimensions has no z. Give x, y or both."
        )
        return
    if scene.boundaries is None or not draft.sound("boundaries"):
        return
    for name, side in scene.boundaries:
        kind, normal = side.boundary, "xyz".index(name[0])
        across = ["xyz"[axis] for axis in axes if axis != normal]
        if normal in axes and not crosses(kind):
            others = ", ".join(f'"{axis}"' for axis in across)
            yield (
                f"{draft.at('boundaries', name)}: the domain follows bodies along {name[0]}, and "
                f"beyond a {kind.kind} side there is no fluid. Make the side far, open or inflow"
                + (f", or give [domain] along = [{others}]." if others else ".")
            )
        if isinstance(side, InflowSide) and side.profile == "parabolic" and across:
            yield (
                f"{draft.at('boundaries', name)}: its profile is 0 at the edges of the side, which "
                f"move along {listed(across)} with the domain. Give profile = "
                f'"uniform", or [domain] along = ["{name[0]}"].'
            )


def check_followed(draft: Draft, around: Surroundings) -> Iterator[str]:
    """What the domain follows must be a body that can move."""
    domain, model = draft.scene.domain, around.model
    if domain is None or not domain.follows:
        return
    name, where = domain.follow, draft.at("domain", "follow")
    if name == "bodies":
        if not model.moving.any():
            yield f"{where}: no body of the model moves. Drop this key."
        return
    unknown = draft.said(around.unknown_bodies([name]), "domain", "follow")
    yield from unknown
    if not unknown and not model.moving[model.body(name)]:
        yield f"{where}: body '{name}' does not move. Name one that does, or give \"bodies\"."
