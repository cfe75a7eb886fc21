"""The domain of a scene and its fluid: their tables, the grid, and whether memory holds it."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Annotated, Any, Literal, Self

from pydantic import Field, model_validator

from flowborne.base.tables import Corner, Count, NotNegative, Places, Positive, Table, Text, Vector
from flowborne.fluid.grid import Grid
from flowborne.runs.summary import machine_memory

FEWEST_CELLS = 4
"""Cells that a domain has at least along each axis."""

BYTES_PER_CELL = 700
"""Least memory that a cell of fluid takes; a run takes 730 to 960 in a room, 1300 to 1500 in a
slab."""


class Domain(Table):
    """[domain]: the box of fluid. A scene without it has no fluid.

    lower, upper  corners in m; instead of them `origin` (the lower corner, 0 unless given) and
                  `size` may be given
    resolution    cells along the longest side; the other sides are rounded up to whole cells
    cells         instead of `resolution`: cells along each axis
    follow        the box moves, by whole cells, with the centre of mass of a body or of all
                  "bodies"; "nothing" keeps it in place. Dye and vortices that leave it are gone.
                  The sides across the axes along which it moves are far, open or inflow
    along         axes along which it moves; all of them unless given
    """

    lower: Corner
    upper: Corner
    resolution: Count | None = None
    cells: tuple[Count, ...] | None = None
    follow: Text = "nothing"
    along: tuple[Literal["x", "y", "z"], ...] | None = None

    @model_validator(mode="before")
    @classmethod
    def _corners_from_size(cls, data: Any) -> Any:
        if not isinstance(data, dict) or not {"size", "origin"} & data.keys():
            return data
        data = dict(data)
        size, origin = data.pop("size", None), data.pop("origin", None)
        if {"lower", "upper"} & data.keys() or size is None:
            raise ValueError(
                "mixes two ways of saying where it is. Give lower and upper, or size (and origin)"
            )
        try:
            origin = [0.0] * len(size) if origin is None else origin
            upper = [float(a) + float(b) for a, b in zip(origin, size, strict=True)]
        except (TypeError, ValueError):
            raise ValueError(
                f"has origin {origin!r} and size {size!r}. Give both as lists of as many numbers"
            ) from None
        return {"lower": origin, "upper": upper, **data}

    @model_validator(mode="after")
    def _check(self) -> Self:
        if len(self.lower) != len(self.upper):
            raise ValueError(
                f"has lower = {list(self.lower)} and upper = {list(self.upper)}. "
                "Give both as many numbers"
            )
        for axis, low, high in zip("xyz", self.lower, self.upper, strict=False):
            if high <= low:
                raise ValueError(
                    f"reaches from {low:g} to {high:g} m in {axis}. "
                    "Make every number of upper larger than that of lower"
                )
        if (self.resolution is None) == (self.cells is None):
            raise ValueError(
                "needs a resolution. Give either resolution = cells along the longest side, "
                "or cells = a list with one number per axis"
            )
        if self.cells is not None:
            self._check_cells(self.cells)
        if min(self.counts()) < FEWEST_CELLS:
            raise ValueError(
                f"is too coarse with {' x '.join(map(str, self.counts()))} cells. "
                f"Refine it until every side has at least {FEWEST_CELLS} cells"
            )
        return self

    def _check_cells(self, cells: tuple[int, ...]) -> None:
        if len(cells) != len(self.lower):
            raise ValueError(
                f"has {len(cells)} numbers in cells and {len(self.lower)} in lower. "
                "Give one number of cells per axis"
            )
        edges = [e / n for e, n in zip(self.extent(), cells, strict=True)]
        if max(edges) - min(edges) > 1e-9 * max(edges):
            shown = " x ".join(f"{edge:.6g}" for edge in edges)
            raise ValueError(
                f"has cells of {shown} m, but cells are cubes. "
                "Change cells or the corners, or give resolution alone"
            )

    @property
    def follows(self) -> bool:
        """Whether it moves with bodies."""
        return self.follow != "nothing"

    @property
    def axes(self) -> tuple[int, ...]:
        """Axes along which it moves."""
        along = "xyz"[: len(self.lower)] if self.along is None else self.along
        return tuple(sorted({"xyz".index(name) for name in along}))

    def extent(self) -> list[float]:
        """Length of each side as given, m."""
        return [high - low for low, high in zip(self.lower, self.upper, strict=True)]

    def spacing(self) -> float:
        """Edge of a cell, m."""
        if self.cells is not None:
            return self.extent()[0] / self.cells[0]
        assert self.resolution is not None
        return max(self.extent()) / self.resolution

    def counts(self) -> list[int]:
        """Cells along each axis."""
        if self.cells is not None:
            return list(self.cells)
        h = self.spacing()
        return [math.ceil(side / h * (1.0 - 1e-9)) for side in self.extent()]

    def grid(self) -> Grid:
        """The grid that fills the domain; a domain with corners of two numbers is a slab."""
        counts, h = self.counts(), self.spacing()
        if len(counts) == 2:
            return Grid.slab(counts[0], counts[1], h, (self.lower[0], self.lower[1]))
        x, y, z = self.lower
        return Grid((counts[0], counts[1], counts[2]), h, (x, y, z))


class FluidTable(Table):
    """[fluid]: what fills the domain.

    density     kg/m^3
    viscosity   dynamic, Pa s; 0 is inviscid
    velocity    initial velocity everywhere, m/s
    body_force  uniform force per mass besides gravity, m/s^2
    tolerance   relative residual at which the pressure solve stops: forces are right to 5e-7 of
                themselves with 1e-7, joint velocities to 3e-8 (fish, flyers, swimmer, block). The
                budgets of momentum and dye hold to rounding whatever it is; a divergence of its
                size is left to the next step
    coupling    "two-way": fluid and bodies exert forces on each other. "one-way": the fluid flows
                as without bodies, and winds of kind "stream" exert its force on them. "none": no
                fluid is simulated, and those winds have their own velocity
    """

    density: Positive = 1000.0
    viscosity: NotNegative = 0.0
    velocity: Vector = (0.0, 0.0, 0.0)
    body_force: Vector = (0.0, 0.0, 0.0)
    tolerance: Annotated[float, Field(gt=0, lt=1)] = 1e-7
    coupling: Literal["two-way", "one-way", "none"] = "two-way"

    @model_validator(mode="before")
    @classmethod
    def _without_scheme(cls, data: Any) -> Any:
        """Runs of earlier versions name the one scheme that still carries the velocity."""
        if isinstance(data, dict) and data.get("advection") == "flux":
            return {key: value for key, value in data.items() if key != "advection"}
        return data


def fits_memory(counts: list[int]) -> bool:
    """Whether this machine holds a grid of so many cells along each axis, as far as is known."""
    has = machine_memory()
    return has is None or math.prod(counts) * BYTES_PER_CELL <= has


def check_memory(places: Places, domain: Domain) -> Iterator[str]:
    cells, has = math.prod(domain.counts()), machine_memory()
    if has is not None and not fits_memory(domain.counts()):
        yield (
            f"{places.at('domain')}: {cells:.3g} cells take {cells * BYTES_PER_CELL / 2**30:.3g} "
            f"GB of memory or more, and this machine has {has / 2**30:.3g} GB. Make the grid "
            "coarser."
        )
