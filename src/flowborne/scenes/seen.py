"""How thick the fluid sees each body.

A sheet thinner than the diagonal of a cell would let fluid through, so it is seen as thick as that
(see `shapes.WATERTIGHT`); and the flow around what is fewer than three cells thick is a guess.
A tip sharper than a cell, as the edge of a wedge or the rim of a lens, is lost between the nodes.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from flowborne.coupling.shapes import WATERTIGHT, own_shape, seen_shape
from flowborne.coupling.world import Setup
from flowborne.fluid.grid import Grid
from flowborne.shapes.thickness import sides, thin_parts
from flowborne.solids.enclosed import hidden_geoms
from flowborne.solids.model import SolidModel

FEW = 3.0
"""Cells across a body below which the flow around it is a guess."""

LOST = 1.0
"""Cells of a tip above which it is told of; from a right angle the grid takes half a cell."""


@dataclass(frozen=True)
class Seen:
    """A body or a flesh on the grid.

    name       as in the model or the scene
    thickness  of its thinnest part, m
    seen       how thick that part is for the fluid, m
    cells      the same in cells
    tight      whether nothing flows through it
    tips       how far it reaches, as thick as it is seen, beyond where a ball a cell across fits, m
    tip_cells  the same in cells
    """

    name: str
    thickness: float
    seen: float
    cells: float
    tight: bool
    tips: float
    tip_cells: float

    def sentence(self) -> str:
        """For people."""
        said = f"{self.name}: {self.thickness:.3g} m thick"
        if self.seen > self.thickness * (1.0 + 1e-9):
            said += f", seen as {self.seen:.3g} m"
        said += f", {self.cells:.2g} cells"
        if not self.tight:
            return f"{said}: fluid passes through it. Refine the grid or thicken it"
        if self.cells < FEW:
            said += f": fewer than {FEW:g}"
        if self.tip_cells > LOST:
            said += (
                f"; {self.tips:.3g} m of a tip, {self.tip_cells:.2g} cells, are thinner than a "
                "cell and seen rounded off. Blunt it or refine the grid"
            )
        return said


@lru_cache(maxsize=1)
def seen_bodies(setup: Setup) -> list[Seen]:
    """Every body and flesh that the fluid sees, of each the thinnest part and the longest tips.

    None without a fluid, or with a one-way one. Kept for the last setup: warnings, the lines of
    `check` and the summary ask for them.
    """
    if setup.fluid is None or setup.fluid.one_way:
        return []
    grid = setup.fluid.grid
    parts: dict[str, list[Seen]] = {}
    for found in (*_bones(setup.solid, grid), *_flesh(setup, grid)):
        parts.setdefault(found.name, []).append(found)
    return [_together(several) for several in parts.values()]


def _together(parts: list[Seen]) -> Seen:
    """The thinnest part of a body, with the longest tips of any."""
    sharpest = max(parts, key=lambda part: part.tips)
    thin = min(parts, key=lambda part: part.seen)
    return replace(thin, tips=sharpest.tips, tip_cells=sharpest.tip_cells)


def _bones(model: SolidModel, grid: Grid) -> Iterator[Seen]:
    """Every geometry that the fluid meets."""
    for geom in map(int, np.flatnonzero(~hidden_geoms(model))):
        own, seen = own_shape(model, geom, grid), seen_shape(model, geom, grid)
        shape = seen.section(*model.rest_pose(geom)) if grid.is_slab else seen
        tips = shape.tips(grid.spacing)
        name = model.body_names[model.geom_body[geom]]
        yield _seen(name, own.thickness, seen.thickness, tips, grid)


def _flesh(setup: Setup, grid: Grid) -> Iterator[Seen]:
    flesh = setup.solid.flesh
    if flesh is None:
        return
    least = 2.0 * WATERTIGHT[grid.is_slab] * grid.spacing
    for name, thickness, skin in zip(flesh.names, flesh.thickness, flesh.skins, strict=True):
        seen = max(thickness, least)
        smaller = grid.spacing - (seen - thickness)  # what is offset takes a ball larger by that
        tips = thin_parts(flesh.rest, sides(flesh.rest, skin) if grid.is_slab else skin, smaller)
        yield _seen(name, thickness, seen, tips, grid)


def _seen(name: str, thickness: float, seen: float, tips: float, grid: Grid) -> Seen:
    tight = seen > 2.0 * WATERTIGHT[grid.is_slab] * grid.spacing * (1.0 - 1e-9)
    cells, tip_cells = float(seen / grid.spacing), float(tips / grid.spacing)
    return Seen(name, float(thickness), float(seen), cells, bool(tight), float(tips), tip_cells)
