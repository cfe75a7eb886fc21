"""Momentum carried in flux form on moving control volumes: kept exactly, like uniform flow.

With the volume fluxes q of a leak-proof field through the faces of the cells, V_c^{n+1} - V_c^n =
-dt sum q, the sides of a control volume let through the means of its two cells' fluxes, and

    V_f^{n+1} u_f^{n+1} = V_f^n u_f^n - dt sum F u_side

keeps sum V_f u_f and a uniform flow to rounding (Verstappen and Veldman 2003; Droege and
Verstappen 2005). Values at the sides are of third order, held between their neighbours; beside
bodies they are the means of both, which neither gain nor lose energy. Two stages (Heun); what else
the flow is given in a step goes along in the values, away from bodies, and not in the amounts, so
that a steady flow stays as it is. A step of a Courant number above COURANT is done in substeps with
one carrying field; control volumes too small for what flows through them there are `fleeting`.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from flowborne.fluid.boundary import Boundaries
from flowborne.fluid.control_volumes import (
    NOTHING,
    ControlVolumes,
    Transfers,
    means,
    parts,
    wrapping,
)
from flowborne.fluid.crossing import crossings
from flowborne.fluid.fleeting import (
    CROSSED,
    Fleeting,
    beyond_sides,
    left_or_taken_up,
    side_rates,
)
from flowborne.fluid.ghosts import Scalar, edge, fill_ghosts
from flowborne.fluid.grid import Array, Faces, Grid
from flowborne.fluid.sides.side import Layers
from flowborne.kernels.arrays import Integers, Marks
from flowborne.kernels.control_volumes import (
    fill_empty,
    join_small,
    level,
    mark_cut,
)
from flowborne.kernels.face_masses import add_transfers
from flowborne.kernels.flux import (
    CLEAR,
    CUT,
    GHOSTS,
    UPSTREAM,
    fade,
    largest_crossing,
    pad_field,
    stage,
)

COURANT = 0.8
"""Cells that the flow may cross in a substep, the axes added up: Heun's method with values of third
order lets noise grow from 0.9 on."""

SUBSTEPS = 300
"""Most substeps: a flow that asks for more has broken down, and its step will say so."""

LASTING = (2.0, 4.0)
"""Cells that the flow crosses in a step, the axes added up, up to which what the last step gave it
goes along, and from which on nothing does. Pressure and forces gave it at a place that a faster
flow leaves behind, and it would grow from step to step: noise as fine as the grid."""

MIXED = (2.0, 3.0)
"""Times what a control volume holds that leaves it in a substep, from which on it is mixed with
the largest one beside it, and from which on wholly. Where c times it leaves, Heun's method keeps
1 - c + c^2/2 of what it had, more than all from c = 2 on; (3 - c) times that is less than all."""


@dataclass(frozen=True)
class Inlets:
    """What comes into the control volumes of one component from within, and goes there.

    index     (n,) flat, each once
    gain      (n,) m^3/s that come in with
    velocity  (n,) m/s
    loss      (n,) m^3/s that leave with the velocity of the fluid there; negative come in with it
    """

    index: Integers
    gain: Array
    velocity: Array
    loss: Array


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
        courant = self.courant(grid)
        if not np.isfinite(courant):
            return 1
        return min(max(1, int(np.ceil(courant / COURANT))), SUBSTEPS)

    def lasting(self, grid: Grid) -> Array | None:
        """(nx, ny, nz) share of what the last step gave the flow that goes along with it, see
        LASTING; None where all of it does."""
        if self.courant(grid) <= LASTING[0]:
            return None
        share = np.empty(grid.shape)
        least, most = (cells * grid.cell_volume / self.dt for cells in LASTING)
        fade(share, *self.flux, least, most)
        return share


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


def beside_faces(cells: Array, axis: int, sides: Boundaries) -> Array:
    """A field of the cells on the faces across an axis: the mean of both cells, or the one there
    is."""
    found = means(cells, axis, sides.periodic()[axis])
    if not sides.periodic()[axis]:
        found[edge(axis, 0)] *= 2.0
        found[edge(axis, -1)] *= 2.0
    return found


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


def plane(values: NDArray[Scalar], grid: Grid) -> NDArray[Scalar]:
    """A field of a slab as one of a room that is one layer thick along its first axis."""
    if not grid.is_slab:
        return values
    return values.reshape(1, *values.shape[:2])


def marks_of(listed: Integers, component: int, grid: Grid, sides: Boundaries) -> Marks:
    """Padded marks of the control volumes: CLEAR where no cut one is among the next two along an
    axis, UPSTREAM on a free side of the domain, where means would draw in ever more, else CUT."""
    depth = [GHOSTS * (axis in grid.axes) for axis in range(3)]
    shape = grid.face_shape(component)
    padded = np.full([n + 2 * d for n, d in zip(shape, depth, strict=True)], CLEAR, np.uint8)
    mark_cut(padded, listed, np.array(shape), wrapping(component, grid, sides))
    for place, side in sides.around(grid):
        layers = Layers(place, GHOSTS)
        if side.joined:
            if place.axis == component and not place.upper:  # the last faces are the first ones
                padded[edge(component, -1 - GHOSTS)] = padded[edge(component, GHOSTS)]
            side.fill(padded, layers, None)
            continue
        for n in range(GHOSTS):
            padded[layers.outside(n)] = CUT
        if place.axis == component:
            padded[layers.inside(0)] = UPSTREAM if side.free else CUT
    return padded


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
    count = transport.substeps(grid)
    dt = transport.dt / count
    flow = Flow(component, transport, inlets, grid, sides)
    if along is not None:
        along.reshape(-1)[flow.listed] = 0.0
        flow.join(along)
    u = velocity.copy()
    flow.fill(u)
    crossed, held, drained = 0.0, 0.0, np.zeros(inlets.index.size)
    for s in range(count):
        time = s * dt
        flow.begin(u, s / count, (s + 1) / count)
        middle, came, left = flow.stage(u, along, time, dt, 1.0)
        arrived, went, gone = flow.stage(middle, along, time + dt, dt, 0.5)
        if s < count - 1:
            u = arrived.copy()
            held += flow.hold(u, time + dt)
        crossed += 0.5 * dt * (came + went)
        drained += 0.5 * dt * (left + gone)
    return Carried(arrived, crossed, held, drained)


class Flow:
    """One component's sides, lists and scratch, the same for every stage of a step."""

    def __init__(
        self,
        component: int,
        transport: Transport,
        inlets: Inlets,
        grid: Grid,
        sides: Boundaries,
    ) -> None:
        self.component, self.grid, self.sides = component, grid, sides
        self.transport, self.inlets = transport, inlets
        before, after = transport.before, transport.after
        volumes = before.volume[component], after.volume[component]
        self.ends = before.moving[component], after.moving[component]
        self.listed = parts(*volumes, component, grid, sides)
        self.marks = marks_of(self.listed, component, grid, sides)
        self.closed = before.closed[component], after.closed[component]
        self.passed = passed_on(before.transfers[component], after.transfers[component])
        self.wraps = wrapping(component, grid, sides)
        shape = grid.face_shape(component)
        self.shape = np.array(shape)
        self.nothing = NOTHING * grid.cell_volume
        self.padded = np.empty([n + 2 * GHOSTS * (a in grid.axes) for a, n in enumerate(shape)])
        self.net = np.zeros(shape)
        periodic = sides.periodic()[component]
        self.place, self.share = neighbours(shape[component], periodic)
        self.crossings = crossings(transport.flux, volumes[0], self.marks, component, grid, sides)
        self.leaving = self.outflow()
        self.fleeting = self.find_fleeting()

    def outflow(self) -> Array:
        """(n,) volume per time that leaves each listed control volume through its sides, inlets
        and transfers, m^3/s."""
        rate = side_rates(
            self.transport.flux, self.listed, self.component, self.grid, self.place, self.share
        )
        total = np.maximum(rate, 0.0).sum(axis=1)
        if self.inlets.index.size:
            at = np.searchsorted(self.listed, self.inlets.index)
            known = at < self.listed.size
            known[known] = self.listed[at[known]] == self.inlets.index[known]
            np.add.at(total, at[known], np.maximum(self.inlets.loss[known], 0.0))
        givers, takers, change = self.passed
        rate = change / self.transport.dt
        for index, out in ((givers, rate), (takers, -rate)):
            at = np.searchsorted(self.listed, index)
            known = at < self.listed.size
            known[known] = self.listed[at[known]] == index[known]
            np.add.at(total, at[known], np.maximum(out[known], 0.0))
        return total

    def find_fleeting(self) -> Fleeting | None:
        """Those that may let through more in a substep than they hold; None without any."""
        transport, grid, component = self.transport, self.grid, self.component
        if transport.courant(grid) <= CROSSED:
            return None
        volumes = transport.before.volume[component], transport.after.volume[component]
        index = left_or_taken_up(self.listed, *volumes)
        rate = side_rates(transport.flux, index, component, grid, self.place, self.share)
        crossed = transport.dt * np.maximum(rate, 0.0).sum(axis=1) / grid.cell_volume
        index, rate = index[crossed > CROSSED], rate[crossed > CROSSED]
        if index.size == 0:
            return None
        beside = beyond_sides(index, self.marks, component, grid, self.sides)
        return Fleeting(index, beside, rate, self.nothing)

    def fill(self, u: Array) -> None:
        """Give control volumes that hold nothing yet the velocity around them, in place."""
        if self.listed.size:
            fill_empty(u, self.ends[0], self.listed, self.nothing, self.shape, self.wraps)
            self.closed[0].follow(u)
        self.join(u)

    def join(self, u: Array) -> None:
        """Make the last faces along a periodic axis the first ones, in place."""
        if self.wraps[self.component] > 0:
            u[edge(self.component, -1)] = u[edge(self.component, 0)]

    def hold(self, u: Array, time: float) -> float:
        """Give the faces of inflows across the component their own velocity after a part of the
        step, in place; gives volume times what that changes it by, m^4/s.

        Their ghosts hold what they do: left alone, they would grow away from those beside them, by
        exp(1) while the flow crosses a cell.
        """
        given, axis = 0.0, self.component
        for place, side in self.sides.around(self.grid):
            if side.supplies and place.axis == axis:
                before = u[place.layer].copy()
                side.impose(u, place, self.transport.time + time)
                given += float((self.high[place.layer] * (u[place.layer] - before)).sum())
        return given

    def begin(self, u: Array, early: float, late: float) -> None:
        """Begin a part of the step, from `early` to `late` of it, at the velocity u."""
        start, end = self.ends
        self.start = u
        self.low = start if early == 0.0 else start + early * (end - start)
        self.high = end if late == 1.0 else start + late * (end - start)
        if self.fleeting is not None:
            self.fleeting.choose(self.low, self.high, (late - early) * self.transport.dt)
        self.span = (late - early) * self.transport.dt

    def stage(
        self, u: Array, along: Array | None, time: float, dt: float, weight: float
    ) -> tuple[Array, float, Array]:
        """Velocity after a stage in which u is carried along, what came in through the sides per
        time, and what left at the inlets with the fluid's own velocity.

        time    s since the step began
        weight  of what this stage carries, beside the one before
        """
        grid, axis = self.grid, self.component
        given = (u, 0.0) if along is None else (along, time)
        pad_field(plane(self.padded, grid), plane(u, grid), plane(given[0], grid), given[1])
        fill_ghosts(self.padded, axis, grid, self.sides, self.transport.time + time)
        for crossing in self.crossings:
            crossing.draw_in(self.padded)
        later = np.empty(u.shape)
        fields = (self.start, self.low, self.high)
        start, low, high = (plane(field, grid) for field in fields)
        stage(
            plane(later, grid), plane(self.net, grid), weight, start, low, high, dt, self.nothing,
            plane(self.padded, grid), plane(self.marks, grid),
            planes(self.transport.flux, grid), axis + grid.is_slab, self.place, self.share,
        )  # fmt: skip
        left = self.exchange(later, dt, weight)
        self.pass_on(later, u, dt, weight)
        if self.fleeting is not None:
            inner = [slice(GHOSTS, -GHOSTS) if a in grid.axes else slice(None) for a in range(3)]
            self.fleeting.pass_on(later, self.net, self.padded[tuple(inner)], weight)
        self.settle(later)
        came_in = sum(crossing.came_in(self.padded) for crossing in self.crossings)
        return later, came_in, left

    def exchange(self, later: Array, dt: float, weight: float) -> Array:
        """Let through the inlets what a stage brings, in place; gives what leaves with the fluid's
        own velocity per time."""
        at, inlets = self.inlets.index, self.inlets
        if at.size == 0:
            return np.zeros(0)
        place = np.unravel_index(at, later.shape)
        inside = tuple(n + GHOSTS * (a in self.grid.axes) for a, n in enumerate(place))
        left = inlets.loss * self.padded[inside]
        more = left - inlets.gain * inlets.velocity
        self.net.reshape(-1)[at] += more
        volume = self.high.reshape(-1)[at]
        later.reshape(-1)[at] -= weight * dt * more / np.where(volume > self.nothing, volume, 1.0)
        return np.asarray(left)

    def pass_on(self, later: Array, u: Array, dt: float, weight: float) -> None:
        """Let control volumes give to others what their transfers change by, in place."""
        givers, takers, change = self.passed
        if givers.size == 0:
            return
        more, at = np.zeros(later.size), np.union1d(givers, takers)
        add_transfers(more, u, givers, takers, change / self.transport.dt)
        more = more[at]
        self.net.reshape(-1)[at] += more
        volume = self.high.reshape(-1)[at]
        later.reshape(-1)[at] -= weight * dt * more / np.where(volume > self.nothing, volume, 1.0)

    def settle(self, later: Array) -> None:
        """Give what closed faces got to their targets, and mix what is too small, in place."""
        if self.listed.size:
            closed = self.closed[1]
            lists = closed.index, closed.targets, closed.shares
            merged = self.high.copy()
            join_small(later, merged, *lists, self.nothing)
            level(
                later, merged, self.listed, self.span * self.leaving, *MIXED, self.nothing,
                self.shape, self.wraps,
            )  # fmt: skip
            fill_empty(later, self.high, self.listed, self.nothing, self.shape, self.wraps)
            closed.follow(later)
        self.join(later)


def passed_on(before: Transfers, after: Transfers) -> tuple[Integers, Integers, Array]:
    """Givers, takers and how much more they give at the end of a step than at its start, m^3."""
    return (
        np.concatenate([before.givers, after.givers]),
        np.concatenate([before.takers, after.takers]),
        np.concatenate([-before.volume, after.volume]),
    )


def planes(flux: Faces, grid: Grid) -> Faces:
    """Fluxes in the order of the kernel's axes; of a slab none across its first."""
    if not grid.is_slab:
        return flux
    x, y, _ = flux
    return np.zeros((2, *grid.shape[:2])), plane(x, grid), plane(y, grid)
