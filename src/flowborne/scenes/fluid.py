"""The fluid of a scene: the checks of all that belongs to it, and its builder."""

from __future__ import annotations

from collections.abc import Iterator

from flowborne.base.tables import triple
from flowborne.coupling.world import Fluid
from flowborne.fluid.boundary import Boundaries
from flowborne.fluid.grid import Grid
from flowborne.kernels.arrays import FREE
from flowborne.motion.inflow import Bands, DyeBandsValue
from flowborne.scenes.domain import check_memory
from flowborne.scenes.draft import Draft, Key
from flowborne.scenes.dye import DyeBands, DyeBox, check_bands, check_boxes
from flowborne.scenes.schema import Scene
from flowborne.scenes.sides import DyeValue, check_outlet, check_sides
from flowborne.scenes.window import check_window

NEEDS_DOMAIN = ("fluid", "boundaries", "sources", "mouths", "dye")


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
    if scene.fluid is not None:
        yield ("fluid", "velocity"), scene.fluid.velocity
        yield ("fluid", "body_force"), scene.fluid.body_force
    if scene.boundaries is not None:
        for name, side in scene.boundaries:
            if hasattr(side, "velocity"):
                yield ("boundaries", name, "velocity"), side.velocity
    for index, source in enumerate(scene.sources):
        if source.velocity is not None:
            yield ("sources", index, "velocity"), source.velocity
    for index, mouth in enumerate(scene.mouths):
        yield ("mouths", index, "position"), mouth.position
        yield ("mouths", index, "direction"), mouth.direction
    for index, wind in enumerate(scene.wind):
        for key in ("velocity", "force"):
            if hasattr(wind, key):
                yield ("wind", index, key), getattr(wind, key)


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
    yield from check_window(draft)
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
    yield from check_boxes(draft, scene.sources, scene.dye, scene.domain)
    if scene.film.field == "dye" and not scene.scalars() and draft.sound("film", "dye", "mouths"):
        yield (
            f"{draft.at('film', 'field')}: there is no dye to show. Add [[dye]], or show "
            "vorticity, speed or pressure."
        )
