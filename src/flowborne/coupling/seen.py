"""How thick the fluid sees each body.

A sheet thinner than the diagonal of a cell would let fluid through, so it is seen as thick as that
(see `shapes.WATERTIGHT`); and the flow around what is fewer than three cells thick is a guess.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from flowborne.coupling.shapes import WATERTIGHT, own_shape, seen_shape
from flowborne.coupling.world import Setup
from flowborne.fluid.grid import Grid
from flowborne.solids.model import SolidModel

FEW = 3.0
"""Cells across a body below which the flow around it is a guess."""


@dataclass(frozen=True)
class Seen:
    """A body or a flesh on the grid.

    name       as in the model or the scene
    thickness  of its thinnest part, m
    seen       how thick that part is for the fluid, m
    cells      the same in cells
    tight      whether nothing flows through it
    """

    name: str
    thickness: float
    seen: float
    cells: float
    tight: bool

    def sentence(self) -> str:
        """For people."""
        said = f"{self.name}: {self.thickness:.3g} m thick"
        if self.seen > self.thickness * (1.0 + 1e-9):
            said += f", seen as {self.seen:.3g} m"
        said += f", {self.cells:.2g} cells"
        if not self.tight:
            return f"{said}: fluid passes through it. Refine the grid or thicken it"
        return f"{said}: fewer than {FEW:g}" if self.cells < FEW else said


def seen_bodies(setup: Setup) -> list[Seen]:
    """Every body and flesh that the fluid sees, the thinnest part of each; none without a fluid."""
    if setup.fluid is None:
        return []
    grid = setup.fluid.grid
    thin: dict[str, Seen] = {}
    for found in (*_bones(setup.solid, grid), *_flesh(setup, grid)):
        if found.name not in thin or found.seen < thin[found.name].seen:
            thin[found.name] = found
    return list(thin.values())


def _bones(model: SolidModel, grid: Grid) -> Iterator[Seen]:
    """Every geometry that flesh does not cover."""
    for geom in map(int, np.flatnonzero(~model.geom_covered)):
        own, seen = own_shape(model, geom, grid), seen_shape(model, geom, grid)
        yield _seen(model.body_names[model.geom_body[geom]], own.thickness, seen.thickness, grid)


def _flesh(setup: Setup, grid: Grid) -> Iterator[Seen]:
    flesh = setup.solid.flesh
    if flesh is None or (setup.fluid is not None and setup.fluid.one_way):
        return
    least = 2.0 * WATERTIGHT[grid.is_slab] * grid.spacing
    for name, thickness in zip(flesh.names, flesh.thickness, strict=True):
        yield _seen(name, thickness, max(thickness, least), grid)


def _seen(name: str, thickness: float, seen: float, grid: Grid) -> Seen:
    tight = seen > 2.0 * WATERTIGHT[grid.is_slab] * grid.spacing * (1.0 - 1e-9)
    return Seen(name, float(thickness), float(seen), float(seen / grid.spacing), bool(tight))
