"""Momentum carried in flux form on moving control volumes: kept exactly, like uniform flow.

With the volume fluxes q of a leak-proof field through the faces of the cells, V_c^{n+1} - V_c^n =
-dt sum q, the sides of a control volume let through the means of its two cells' fluxes, and

    V_f^{n+1} u_f^{n+1} = V_f^n u_f^n - dt sum F u_side

keeps sum V_f u_f and a uniform flow to rounding (Verstappen and Veldman 2003; Droege and
Verstappen 2005). Values at the sides are of third order, held between their neighbours; beside
bodies they are the means of both, which neither gain nor lose energy. Two stages (Heun); what else
the flow is given in a step goes along in the values, away from bodies, and not in the amounts, so
that a steady flow stays as it is. A step of a Courant number above COURANT is done in substeps with
one carrying field.

A cut control volume gets momentum through sides whose values are off by a fraction of a cell's
difference. That makes eddies of two cells beside bodies that the fluid slips along, which values of
third order damp, but the means near cut faces do not. There the circulation around the edges of the
grid evens out as fast (`kernels.eddies`). Viscous fluid has none of it: it would act on boundary
layers.

Method: docs/method/fluid.md.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cached_property, lru_cache
from math import prod

import numpy as np

from flowborne.fluid.boundary import Boundaries
from flowborne.fluid.control_volumes import NONE, NOTHING, ControlVolumes
from flowborne.fluid.ghosts import join_ends, packed_sides, plane, planes
from flowborne.fluid.grid import Grid
from flowborne.kernels.arrays import Array, FaceGrid, Faces, Integers, Marks, Three
from flowborne.kernels.carry import Exchange, Inlets, Scratch, Volumes, carry
from flowborne.kernels.control_volumes import Transfers
from flowborne.kernels.eddies import exchange, exchanges_near
from flowborne.kernels.flux import GHOSTS, Fluxes, Padded, largest_crossing
from flowborne.kernels.lists import merged

COURANT = 0.8
"""Cells that the flow may cross in a substep, the axes added up: Heun's method with values of third
order lets noise grow from 0.9 on."""

SUBSTEPS = 300
"""Most substeps: a flow that asks for more has broken down, and its step will say so."""

SLACK = 1e-9
"""How much more than a whole number of parts is rounding, and needs no further part."""

EXTRAPOLATION_COURANT = 2.0
"""Cells that the flow crosses, the axes added up, while what the last step gave it goes along. A
faster flow has left the place where pressure and forces gave it, and it would grow from step to
step: noise as fine as the grid."""

UPWIND_DAMPING = 4.0 / 3.0
"""What a third-order upwind value takes of a wave of two cells while the flow crosses a cell."""


def parts_for(amount: float) -> int:
    """Fewest equal parts of which none is greater than 1; one of what is not a finite number."""
    return max(1, int(np.ceil(amount - SLACK))) if np.isfinite(amount) else 1


NO_INLETS = Inlets(np.zeros(0, np.int64), np.zeros(0), np.zeros(0), np.zeros(0))


@dataclass(frozen=True)
class Transport:
    """What carries the momentum through a step.

    flux    Faces, volume per time through each face of the leak-proof field, m^3/s
    before  control volumes at the start,
    after   and at the end of the step
    dt      s
    time    s, at the start
    """

    flux: Faces
    before: ControlVolumes
    after: ControlVolumes
    dt: float
    time: float

    @cached_property
    def crossing(self) -> float:
        """Largest volume per time that crosses a cell, the axes added up, m^3/s."""
        return float(largest_crossing(*self.flux))

    def courant(self, grid: Grid) -> float:
        """Largest part of a whole cell that crosses its faces in the step, the axes added up."""
        return self.dt * self.crossing / grid.cell_volume

    def substeps(self, grid: Grid) -> int:
        """In how many the step is done; in one where a flux is not a finite number."""
        return min(parts_for(self.courant(grid) / COURANT), SUBSTEPS)

    def extrapolated(self, grid: Grid) -> float:
        """Part of the step in which what the last one gave goes along, see
        EXTRAPOLATION_COURANT."""
        return EXTRAPOLATION_COURANT / max(self.courant(grid), EXTRAPOLATION_COURANT)


@dataclass(frozen=True)
class Carried:
    """One component after a step.

    velocity  on its faces, m/s
    crossed   volume times velocity that came in through the sides of the domain, m^4/s
    held      the same that inflows gave to what was carried to them on the way
    drained   (n,) the same that left at each inlet with the fluid's own velocity
    """

    velocity: Array
    crossed: float
    held: float
    drained: Array


@lru_cache(maxsize=64)
def neighbours(count: int, periodic: bool) -> tuple[Integers, Array]:
    """(2, n + 1, 2) which two cells' or faces' fluxes make those through the sides of the n control
    volumes of a component, and how much of each: across other axes, and across its own.

    count  n, one more than the cells along the component's axis
    """
    at = np.arange(count + 1)[:, None] + np.array([-1, 0])
    cells, faces, part = at.copy(), at.copy(), np.full((2, count + 1, 2), 0.5)
    if periodic:
        cells %= count - 1
        faces[0], faces[-1] = (count - 2, count - 1), (0, 1)
    else:
        part[0, 0, 0], part[0, count - 1, 1] = 0.0, 0.0
        cells, faces = cells.clip(0, count - 2), faces.clip(0, count - 1)
    return np.stack([cells, faces]), part


def carry_component(
    velocity: Array,
    along: Array | None,
    component: int,
    transport: Transport,
    inlets: Inlets,
    grid: Grid,
    sides: Boundaries,
) -> Carried:
    """One component a step later.

    velocity  on its faces, m/s
    along     what else it is given in the step, m/s^2; beside bodies it is set to 0; None for
              nothing
    """
    count, faces = transport.substeps(grid), sides.faces(component, grid)
    dt = transport.dt / count
    times = [transport.time + n * dt for n in range(count + 1)]
    table = packed_sides(component, grid, sides, times, transport.flux)
    ring = sides.periodic()[component]
    means = neighbours(int(faces.shape[faces.component]), ring)
    flux = Fluxes(planes(transport.flux, grid), faces.component, *means)
    volumes, given = volumes_between(transport, faces, component, grid)
    exchange, out = Exchange(flux, table, inlets, given), np.empty(velocity.shape)
    rising = 0.0 if along is None else transport.extrapolated(grid)
    more = plane(velocity if along is None else along, grid)
    fields = plane(out, grid), plane(velocity, grid), more
    with borrowed(grid, faces.shape) as scratch:
        crossed, held, drained = carry(*fields, rising, volumes, exchange, scratch, dt)
    return Carried(out, crossed, held, drained)


def volumes_between(
    transport: Transport, faces: FaceGrid, component: int, grid: Grid
) -> tuple[Volumes, Transfers]:
    """The control volumes of a component in a step, and what they pass on; those that stay keep
    both."""
    before, after, dt = transport.before, transport.after, transport.dt
    known = before.staying.get(component) if before is after else None
    if known is None or known[0] != dt:
        volumes = Volumes(
            plane(before.cells, grid),
            plane(before.moving[component], grid),
            plane(after.moving[component], grid),
            merged(before.cut[component], after.cut[component])[0],
            before.closed[component],
            after.closed[component],
            faces,
            NOTHING * grid.cell_volume,
        )
        given = passed_on(before.transfers[component], after.transfers[component], dt)
        known = dt, volumes, given
        if before is after:
            before.staying[component] = known
    return known[1:]


_spare: dict[Three, list[tuple[Array, Marks, dict[Three, Scratch]]]] = {}


@contextmanager
def borrowed(grid: Grid, shape: Three) -> Iterator[Scratch]:
    """Scratch for a component of this shape in the order of the kernels' axes, in memory that is
    kept for the next one."""
    store, deep = _spare.setdefault(grid.shape, []), 2 * GHOSTS
    try:
        memory, bits, made = store.pop()
    except IndexError:
        most = prod(n + 1 + deep if axis in grid.axes else n for axis, n in enumerate(grid.shape))
        memory, bits, made = np.zeros((7, most)), np.zeros(most, np.uint8), {}
    if shape not in made:
        wide = [n + deep * (axis > 0 or not grid.is_slab) for axis, n in enumerate(shape)]
        padded = Padded(memory[0, : prod(wide)].reshape(wide), bits[: prod(wide)].reshape(wide))
        parts = (flat[: prod(shape)].reshape(shape) for flat in memory[1:])
        made[shape] = Scratch(padded, *parts)
    yield made[shape]
    store.append((memory, bits, made))


def passed_on(before: Transfers, after: Transfers, dt: float) -> Transfers:
    """What transfers at the end of a step give more than those at its start, per time, m^3/s."""
    return Transfers(
        np.concatenate([before.givers, after.givers]),
        np.concatenate([before.takers, after.takers]),
        np.concatenate([-before.volume, after.volume]) / dt,
    )


def damp_eddies(velocity: Faces, transport: Transport, grid: Grid, sides: Boundaries) -> None:
    """Even out the circulation near faces cut at the end of a step, in place."""
    fields, volumes = planes(velocity, grid), planes(transport.after.moving, grid)
    cut, wraps = transport.after.cut, sides.faces(0, grid).wraps
    if grid.is_slab:
        cut = NONE, *cut[:2]
    rate, found = UPWIND_DAMPING * transport.dt / grid.spacing, []
    for axis in range(1 if grid.is_slab else 3):
        a, b = (axis + 1) % 3, (axis + 2) % 3
        flow, held = (fields[a], fields[b]), (volumes[a], volumes[b])
        edges = exchanges_near(flow, held, (cut[a], cut[b]), axis, wraps, GHOSTS, rate)
        found.append((flow, held, edges))
    for (u, v), held, edges in found:
        exchange(u, v, held, *edges)
    join_ends(velocity, grid, sides)
