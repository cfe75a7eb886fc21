"""Contradictions among the tables that describe the fluid."""

from __future__ import annotations

import math
from collections.abc import Iterator

from flowborne.runs.summary import machine_memory
from flowborne.scenes.draft import Draft
from flowborne.scenes.schema_fluid import BoundariesTable, Domain, DyeBands, InflowSide, NoSlipSide
from flowborne.scenes.wording import Key

BYTES_PER_CELL = 700
"""Least memory that a cell of fluid takes; a run takes 730 to 960 in a room, 1300 to 1500 in a
slab."""

NEEDS_DOMAIN = ("fluid", "boundaries", "sources", "mouths", "dye")


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
            if isinstance(side, InflowSide | NoSlipSide):
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
    yield from _check_memory(draft, scene.domain)
    if scene.boundaries is not None and draft.sound("boundaries"):
        yield from _check_sides(draft, scene.boundaries)
        if draft.sound("sources"):
            yield from _check_outlet(draft, scene.boundaries, scene.domain)
        yield from _check_bands(draft, scene.boundaries, scene.domain)
    yield from _check_boxes(draft, scene.domain)
    if scene.film.field == "dye" and not scene.scalars() and draft.sound("film", "dye", "mouths"):
        yield (
            f"{draft.at('film', 'field')}: there is no dye to show. Add [[dye]], or show "
            "vorticity, speed or pressure."
        )


def fits_memory(counts: list[int]) -> bool:
    """Whether this machine holds a grid of so many cells along each axis, as far as is known."""
    has = machine_memory()
    return has is None or math.prod(counts) * BYTES_PER_CELL <= has


def _check_memory(draft: Draft, domain: Domain) -> Iterator[str]:
    cells, has = math.prod(domain.counts()), machine_memory()
    if has is not None and not fits_memory(domain.counts()):
        yield (
            f"{draft.at('domain')}: {cells:.3g} cells take {cells * BYTES_PER_CELL / 2**30:.3g} GB "
            f"of memory or more, and this machine has {has / 2**30:.3g} GB. Make the grid coarser."
        )


def _half_periodic(low: str, high: str) -> bool:
    """Whether just one of two opposite kinds of sides is periodic."""
    return (low == "periodic") != (high == "periodic")


def _check_sides(draft: Draft, boundaries: BoundariesTable) -> Iterator[str]:
    sides = dict(boundaries)
    for axis, name in enumerate("xyz"):
        low, high = sides[f"{name}_min"], sides[f"{name}_max"]
        if _half_periodic(low.kind, high.kind):
            yield (
                f"{draft.at('boundaries')}: {name}_min is {low.kind} and {name}_max is "
                f"{high.kind}. Make both of them periodic or neither."
            )
        for side, table in ((f"{name}_min", low), (f"{name}_max", high)):
            if axis == 2 and draft.scene.is_slab and table.kind != "closed":
                yield (
                    f"{draft.at('boundaries', side)} is {table.kind}, but a scene of 2 dimensions "
                    "has no sides in z. Drop it."
                )
            if isinstance(table, NoSlipSide) and table.velocity[axis] != 0.0:
                yield (
                    f"{draft.at('boundaries', side)}: velocity {list(table.velocity)} moves the "
                    f"wall out of its place. Make its {name} component 0."
                )


def _check_outlet(draft: Draft, boundaries: BoundariesTable, domain: Domain) -> Iterator[str]:
    """Fluid that comes in must be able to leave: it does not give way."""
    scene = draft.scene
    kinds = {name: side.kind for name, side in boundaries}
    unclear = any(_half_periodic(kinds[f"{a}_min"], kinds[f"{a}_max"]) for a in "xyz")
    if unclear or "open" in kinds.values():
        return
    total, largest = 0.0, 0.0
    for name, side in boundaries:
        if isinstance(side, InflowSide):
            axis = "xyz".index(name[0])
            others = [e for i, e in enumerate(domain.extent()) if i != axis]
            inward = 1.0 if name.endswith("min") else -1.0
            flux = inward * side.velocity[axis] * math.prod(others)
            total, largest = total + flux, max(largest, abs(flux))
    for source in scene.sources:
        rate = source.volume_rate or 0.0
        total, largest = total + rate, max(largest, abs(rate))
    if abs(total) > 1e-9 * largest:
        yield (
            f"{draft.at('boundaries')}: {total:+g} m^{scene.dimensions}/s enters through inflow "
            "sides and sources, and no side is open for as much to leave. Make a side open."
        )


def _check_bands(draft: Draft, boundaries: BoundariesTable, domain: Domain) -> Iterator[str]:
    sides = dict(boundaries)
    for index, dye in enumerate(draft.scene.dye):
        if not isinstance(dye, DyeBands):
            continue
        where = draft.at("dye", index)
        if sides[dye.side].kind != "inflow":
            yield (
                f"{where}: side {dye.side} is {sides[dye.side].kind}, and dye enters with an "
                "inflow. Choose an inflow side, or use a dye of kind 'box'."
            )
        axis = "xyz".index(band_axis(dye))
        if axis >= len(domain.lower):
            yield f"{where} has across = 'z' in a scene of 2 dimensions. Choose another axis."
            continue
        low, high = domain.lower[axis], domain.upper[axis]
        for number, (start, stop) in enumerate(dye.bands or (), start=1):
            if stop <= low or start >= high:
                yield (
                    f"{where}, bands, entry {number}: [{start:g}, {stop:g}] m is beside the side, "
                    f"which reaches from {low:g} to {high:g} m. Move it."
                )


def band_axis(dye: DyeBands) -> str:
    """The axis across which bands of dye follow each other."""
    if dye.across is not None:
        return dye.across
    return "x" if dye.side[0] == "y" else "y"


def _check_boxes(draft: Draft, domain: Domain) -> Iterator[str]:
    boxes = [(("sources", i), s.lower, s.upper) for i, s in enumerate(draft.scene.sources)]
    boxes += [
        (("dye", i), d.lower, d.upper)
        for i, d in enumerate(draft.scene.dye)
        if not isinstance(d, DyeBands)
    ]
    for keys, lower, upper in boxes:
        for axis, low, high in zip("xyz", domain.lower, domain.upper, strict=False):
            i = "xyz".index(axis)
            if upper[i] <= low or lower[i] >= high:
                yield (
                    f"{draft.at(*keys)}: the box reaches from {lower[i]:g} to {upper[i]:g} m in "
                    f"{axis}, outside the domain from {low:g} to {high:g} m. Move it."
                )
