"""Dye and smoke, carried by the fluxes that carry momentum: their amount is kept exactly.

With the volume fluxes q of a leak-proof field, V^{n+1} - V^n = dt (rate - sum q) in every cell, and

    V^{n+1} c^{n+1} = V^n c^n - dt sum q c_face + what is brought

Whole cells pass it on along one axis after the other, in an order that turns about (Strang 1968);
see `kernels.dye`. Cut cells, and those that mouths and sources fill, come first; see
`kernels.dye`. No value leaves the bounds of what there is and what is brought.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flowborne.fluid.boundary import Boundaries, Source, cells_in
from flowborne.fluid.control_volumes import WHOLE as UNCUT
from flowborne.fluid.ghosts import edge
from flowborne.fluid.grid import Grid, extent, inner_product
from flowborne.fluid.sides.side import Place
from flowborne.fluid.transport import SUBSTEPS, Transport, parts_for
from flowborne.kernels.arrays import Array, Integers, Marks, Three
from flowborne.kernels.control_volumes import mark_cut
from flowborne.kernels.dye import (
    CUT,
    WHOLE,
    Bounds,
    CutCells,
    list_flows,
    pass_on,
    sort_cells,
    sweep,
)

REACH = 2
"""Cells on both sides that the parabola in a cell is made from."""

Box = tuple[slice, slice, slice]
"""Index of some cells along each axis."""


@dataclass(frozen=True)
class Brought:
    """What mouths and sources bring into cells.

    rate   (nx, ny, nz) m^3/s; negative is taken
    cells  (n,) flat indices of the cells into which mouths expel, each once
    gain   (n,) m^3/s that they expel there
    dye    name -> (n,) its amount per time; the rest of `rate` comes in as the fluid that is there
    """

    rate: Array
    cells: Integers
    gain: Array
    dye: dict[str, Array]


def nothing_brought(grid: Grid) -> Brought:
    """What comes into cells where there are neither mouths nor sources."""
    return Brought(np.zeros(grid.shape), np.zeros(0, np.int64), np.zeros(0), {})


@dataclass(frozen=True)
class Dyed:
    """The scalars after a step.

    scalars  name -> (nx, ny, nz)
    error    of the amount of any: what it has changed by less what was brought, relative to it
    """

    scalars: dict[str, Array]
    error: float


def carry_dye(scalars: dict[str, Array], passage: Passage, sources: tuple[Source, ...]) -> Dyed:
    """The scalars a step later."""
    time, later, error = passage.transport.time + passage.transport.dt, {}, 0.0
    for name, values in scalars.items():
        later[name], gained = passage.carry(name, values, passage.bounds(name, values))
        before = inner_product(passage.transport.before.cells, values)
        after = inner_product(passage.transport.after.cells, later[name])
        scale = max(abs(before), abs(after))
        if scale > 0.0:
            error = max(error, abs(after - before - gained) / scale)
    for source in sources:
        if source.active(time):
            for name in later.keys() & source.scalars.keys():
                later[name][cells_in(source, passage.grid)] = source.scalars[name]
    return Dyed(later, error)


class Passage:
    """What carries dye through a step, the same for every scalar.

    It takes what flows through faces of cut cells out of the transport's fluxes, into a list.

    backwards  whether the last axis comes first; to be turned about from step to step
    """

    def __init__(
        self, transport: Transport, brought: Brought, grid: Grid, sides: Boundaries, backwards: bool
    ) -> None:
        self.transport, self.brought, self.backwards = transport, brought, backwards
        self.grid, self.sides = grid, sides
        start, end, uncut = transport.before.cells, transport.after.cells, UNCUT * grid.cell_volume
        kind, fullest = sort_cells(start, end, brought.rate, transport.flux, uncut)
        kind.reshape(-1)[brought.cells] = CUT
        flowing = transport.dt * float(fullest.max())
        self.count = parts_for(min(flowing, SUBSTEPS))
        self.dt = transport.dt / self.count
        others = np.flatnonzero(kind != WHOLE)
        x, y, z = (n * ring for n, ring in zip(grid.shape, sides.periodic(), strict=True))
        shape, wraps = grid.shape, (x, y, z)
        self.clear: Marks = np.ones(grid.shape, np.uint8)
        mark_cut(self.clear, others, shape, wraps, REACH)
        listed = others[kind.reshape(-1)[others] == CUT]
        self.given: dict[tuple[str, int, int], Array | None] = {}
        n = listed.size
        tables = np.full((n, 6), -1), np.full((n, 6), -1), np.zeros((n, 6))
        self.cut = CutCells(listed, *tables)
        for axis in grid.axes if n else ():
            list_flows(self.cut, axis, transport.flux[axis], wraps, shape)
        self.expelled = np.searchsorted(listed, brought.cells)

    def carry(self, name: str, values: Array, bounds: Bounds) -> tuple[Array, float]:
        """A scalar a step later, and the amount that came in through sides, mouths and sources.

        bounds  least and largest value that it may take
        """
        start, end = self.transport.before.cells, self.transport.after.cells
        field, gained = values.copy(), 0.0
        for s in range(self.count):
            volume = start + (s / self.count) * (end - start) if s > 0 else start.copy()
            if self.cut.listed.size:
                gained += self.pass_on(name, field, volume, bounds)
            order = self.grid.axes if (s % 2 == 0) != self.backwards else self.grid.axes[::-1]
            box = self.reached(name, field)
            for axis in order:
                gained += self.carry_along(axis, name, (field, volume), box, bounds)
        return field, gained

    def reached(self, name: str, field: Array) -> Box:
        """The cells that hold some of a scalar, or get some from a side, with those around them,
        farther than it flows along each axis in turn. All others stay as they are."""
        grid, box, there = self.grid, [slice(0, n) for n in self.grid.shape], field != 0.0
        for (scalar, axis, upper), given in self.given.items():
            if scalar == name and given is not None:
                there[Place(grid, axis, bool(upper)).layer] |= given != 0.0
        for axis in grid.axes:
            n, (first, stop) = grid.shape[axis], extent(there, axis)
            first, stop = max(first - REACH, 0), min(stop + REACH, n)
            if not (self.sides.periodic()[axis] and (first == 0 or stop == n)):
                box[axis] = slice(first, stop)
        return box[0], box[1], box[2]

    def carry_along(
        self, axis: int, name: str, fields: tuple[Array, Array], box: Box, bounds: Bounds
    ) -> float:
        """Carry a scalar along an axis in a box, in place, with the volumes; gives what came in."""
        grid, own = self.grid, box[axis]
        within = own.start > 0, own.stop < grid.shape[axis]  # nothing comes in at such an end
        others = tuple(c for a, c in enumerate(box) if a != axis)[:: -1 if grid.is_slab else 1]
        ends = np.stack([self.beyond(name, fields[0], axis, upper)[others] for upper in (0, 1)])
        ends[np.array(within)] = 0.0
        ring = self.sides.periodic()[axis] and not any(within)
        flux, (x, y, z) = self.transport.flux[axis], box
        first, last = (x.start, y.start, z.start), (x.stop, y.stop, z.stop)
        place = first, last, order_along(axis, grid)
        crossed = sweep(fields, flux, self.clear, place, ends, ring, self.dt, bounds)
        return float(crossed[0].sum() - crossed[1].sum())

    def bounds(self, name: str, values: Array) -> Bounds:
        """Least and largest value that there is or comes in."""
        found = [values]
        for axis in self.grid.axes:
            found += [self.beyond(name, values, axis, upper) for upper in (0, 1)]
        if self.brought.cells.size:
            found.append(self.brought.dye[name] / self.brought.gain)
        return min(float(a.min()) for a in found), max(float(a.max()) for a in found)

    def beyond(self, name: str, field: Array, axis: int, upper: int) -> Array:
        """Values that come in through a side across `axis`, in the order of `order_along`: what the
        side prescribes, or those beside it."""
        place, time = Place(self.grid, axis, bool(upper)), self.transport.time + self.transport.dt
        if (name, axis, upper) not in self.given:
            prescribed = self.sides.pair(axis)[upper].entering_scalar(name, place, time)
            self.given[name, axis, upper] = prescribed
        layer, given = field[place.layer], self.given[name, axis, upper]
        values = (layer if given is None else np.broadcast_to(given, layer.shape))[edge(axis, 0)]
        return values.T if self.grid.is_slab else values

    def pass_on(self, name: str, field: Array, volume: Array, bounds: Bounds) -> float:
        """Carry a scalar through the faces of the cut cells, in place; gives what came in."""
        listed, n, dt = self.cut.listed, self.cut.listed.size, self.dt
        entering, gain, dye = np.zeros((n, 6)), np.zeros(n), np.zeros(n)
        at = np.unravel_index(listed, self.grid.shape)
        for axis in self.grid.axes:
            for upper in (0, 1):
                rows = np.flatnonzero(self.cut.beside[:, 2 * axis + upper] < 0)
                if rows.size:
                    layer = self.beyond(name, field, axis, upper)
                    layer = layer.T if self.grid.is_slab else layer
                    others = tuple(at[a][rows] for a in range(3) if a != axis)
                    entering[rows, 2 * axis + upper] = layer[others]
        gain[self.expelled] = dt * self.brought.gain
        if self.brought.cells.size:
            dye[self.expelled] = dt * self.brought.dye[name]
        local = dt * self.brought.rate.reshape(-1)[listed] - gain
        cells = self.cut._replace(out=dt * self.cut.out)
        return pass_on(field, volume, cells, entering, gain, dye, local, bounds)


def order_along(axis: int, grid: Grid) -> Three:
    """The axes of a field with `axis` as the second one, and a slab's depth as the first."""
    if grid.is_slab:
        return 2, axis, 1 - axis
    return ((1, 0, 2), (0, 1, 2), (0, 2, 1))[axis]
