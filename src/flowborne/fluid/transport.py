"""Momentum carried in flux form on moving control volumes: kept exactly, like uniform flow.

With the volume fluxes q of a leak-proof field through the faces of the cells, V_c^{n+1} - V_c^n =
-dt sum q, the sides of a control volume let through the means of its two cells' fluxes, and

    V_f^{n+1} u_f^{n+1} = V_f^n u_f^n - dt sum F u_side

keeps sum V_f u_f and a uniform flow to rounding (Verstappen and Veldman 2003; Droege and
Verstappen 2005). Values at the sides are of third order, held between their neighbours; beside
bodies they are the means of both, which neither gain nor lose energy. Two stages (Heun); what
pressure and friction did to the flow in the last step goes along in the values, not in the
amounts, so that a steady flow stays as it is. A step of a Courant number above COURANT is done in
substeps with one carrying field.
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
    parts,
    wrapping,
)
from flowborne.fluid.ghosts import Scalar, edge, pad_deep, wrap_deep
from flowborne.fluid.grid import Array, Faces, Grid
from flowborne.kernels.arrays import Integers, Marks
from flowborne.kernels.control_volumes import fill_empty, follow_hosts, join_guests, level
from flowborne.kernels.flux import CUT, GHOSTS, UPSTREAM, advance, net_flux

COURANT = 0.8
"""Cells that the flow may cross in a substep, the axes added up: Heun's method with values of third
order lets noise grow from 0.9 on."""

SUBSTEPS = 100
"""Most substeps: a flow that asks for more has broken down, and its step will say so."""

SMALL, TINY = 0.2, 0.05
"""Parts of a cell below which control volumes begin to be mixed with their neighbours, and are
wholly mixed."""


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

    flux       Faces, volume per time through each face of the leak-proof field, m^3/s
    before     control volumes at the start,
    after      and at the end of the step
    dt         s
    time       s, at the start
    viscosity  kinematic; where it holds small control volumes they are mixed less, m^2/s
    """

    flux: Faces
    before: ControlVolumes
    after: ControlVolumes
    dt: float
    time: float
    viscosity: float = 0.0

    @cached_property
    def crossing(self) -> float:
        """Largest volume per time that crosses a cell, the axes added up, m^3/s."""
        rates = np.zeros(self.before.cells.shape)
        for axis, flux in enumerate(self.flux):
            q = np.abs(flux)
            rates += np.maximum(q[edge(axis, slice(None, -1))], q[edge(axis, slice(1, None))])
        return float(rates.max())

    def courant(self, grid: Grid) -> float:
        """Largest part of a whole cell that crosses its faces in the step, the axes added up."""
        return self.dt * self.crossing / grid.cell_volume


@dataclass(frozen=True)
class Carried:
    """One component after a step.

    velocity  on its faces, m/s
    crossed   volume times velocity that came in through the sides of the domain, m^4/s
    drained   (n,) the same that left at each inlet with the fluid's own velocity
    """

    velocity: Array
    crossed: float
    drained: Array


def side_fluxes(flux: Faces, component: int, grid: Grid, sides: Boundaries) -> Faces:
    """Volume per time through the lower sides of the control volumes of a component, and the upper
    one of the last, across each axis: means of those of its two cells; m^3/s."""
    through = []
    for axis in range(3):
        q, periodic = flux[axis], sides.periodic()[component]
        ends = [(int(a == component), int(a == component)) for a in range(3)]
        if axis == component:
            mean = 0.5 * (q[edge(axis, slice(1, None))] + q[edge(axis, slice(None, -1))])
            wide = np.pad(mean, ends, mode="wrap" if periodic else "constant")
            if not periodic:
                wide[edge(axis, 0)] = q[edge(axis, 0)]
                wide[edge(axis, -1)] = q[edge(axis, -1)]
            through.append(wide)
            continue
        wide = np.pad(q, ends, mode="wrap" if periodic else "constant")
        below, above = edge(component, slice(None, -1)), edge(component, slice(1, None))
        through.append(0.5 * (wide[below] + wide[above]))
    return through[0], through[1], through[2]


def plane(values: NDArray[Scalar], grid: Grid) -> NDArray[Scalar]:
    """A field of a slab as one of a room that is one layer thick along its first axis."""
    if not grid.is_slab:
        return values
    return values.reshape(1, *values.shape[:2])


def marks_of(listed: Integers, component: int, grid: Grid, sides: Boundaries) -> Marks:
    """Padded marks of the control volumes: CLEAR where no cut one is among the next two along an
    axis, UPSTREAM on an open side of the domain, where means would draw in ever more, else CUT."""
    shape = grid.face_shape(component)
    whole = np.ones(shape, np.uint8)
    whole.reshape(-1)[listed] = 0
    if sides.periodic()[component]:
        whole[edge(component, -1)] = whole[edge(component, 0)]
    depth = [GHOSTS * (axis in grid.axes) for axis in range(3)]
    inner = [slice(d, d + n) for d, n in zip(depth, shape, strict=True)]
    padded = np.pad(whole, [(d, d) for d in depth], constant_values=1)
    wrapped = [axis for axis in grid.axes if sides.periodic()[axis]]
    for axis in wrapped:
        wrap_deep(padded, axis, grid.shape[axis])
    if listed.size:
        clear = whole.copy()
        for axis in grid.axes:
            for shift in range(2 * GHOSTS + 1):
                beside = list(inner)
                beside[axis] = slice(shift, shift + shape[axis])
                clear &= padded[tuple(beside)]
        padded[tuple(inner)] = clear
    for axis in grid.axes:
        if axis in wrapped:
            wrap_deep(padded, axis, grid.shape[axis])
            continue
        for end, side in enumerate(sides.pair(axis)):
            padded[edge(axis, slice(-GHOSTS, None) if end else slice(GHOSTS))] = CUT
            if axis == component:
                at = -1 - GHOSTS if end else GHOSTS
                padded[edge(axis, at)] = UPSTREAM if side.kind == "open" else CUT
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
    along     what pressure and friction do to it, m/s^2; None for nothing
    """
    count = min(max(1, int(np.ceil(transport.courant(grid) / COURANT))), SUBSTEPS)
    dt = transport.dt / count
    start, end = transport.before.volume[component], transport.after.volume[component]
    through = side_fluxes(transport.flux, component, grid, sides)
    listed = parts(start, end, component, grid, sides)
    flow = Flow(component, transport, through, listed, inlets, grid, sides)
    u = flow.mean(velocity, transport.before)
    flow.fill(u, start)
    crossed, drained = 0.0, np.zeros(inlets.index.size)
    for s in range(count):
        early, late = s / count, (s + 1) / count
        low, high = start + early * (end - start), start + late * (end - start)
        first, came, left = flow.out(values(u, along, s * dt), transport.time + s * dt)
        middle = flow.mean(flow.after(u, low, high, first, dt), transport.after)
        later = values(middle, along, (s + 1) * dt)
        second, went, gone = flow.out(later, transport.time + (s + 1) * dt)
        arrived = flow.after(u, low, high, 0.5 * (first + second), dt)
        u = flow.mean(arrived, transport.after)
        crossed += 0.5 * dt * (came + went)
        drained += 0.5 * dt * (left + gone)
    return Carried(arrived, crossed, drained)


def values(u: Array, along: Array | None, time: float) -> Array:
    """Velocity with what it has been given in `time` (s)."""
    return u if along is None or time == 0.0 else u + time * along


class Flow:
    """One component's sides and lists, the same for every stage of a step."""

    def __init__(
        self,
        component: int,
        transport: Transport,
        through: Faces,
        listed: Integers,
        inlets: Inlets,
        grid: Grid,
        sides: Boundaries,
    ) -> None:
        self.component, self.grid, self.sides = component, grid, sides
        self.through, self.listed, self.inlets = through, listed, inlets
        self.marks = marks_of(listed, component, grid, sides)
        self.guests = transport.after.guests[component]
        self.hosts = transport.after.hosts[component]
        self.shares = transport.after.shares[component]
        alone = self.shares == 1.0
        self.whole, self.their_hosts = self.guests[alone], self.hosts[alone]
        self.wraps = wrapping(component, grid, sides)
        self.shape = np.array(grid.face_shape(component))
        self.nothing = NOTHING * grid.cell_volume
        # friction 2 mu A / d over the depth d = V / A of a small control volume, dt / m times
        self.held = 2.0 * transport.viscosity * transport.dt * grid.face_area**2

    def fill(self, u: Array, volume: Array) -> None:
        """Give control volumes that hold nothing yet the velocity around them, in place."""
        if self.listed.size:
            fill_empty(u, volume, self.listed, self.nothing, self.shape, self.wraps)
            self.join(u)

    def mean(self, u: Array, volumes: ControlVolumes) -> Array:
        """Velocity of whole control volumes, guests with what goes with their hosts."""
        mean = volumes.mean_velocity(u, self.component)
        self.join(mean)
        return mean

    def join(self, u: Array) -> None:
        """Make the last faces along a periodic axis the first ones, in place."""
        if self.wraps[self.component] > 0:
            u[edge(self.component, -1)] = u[edge(self.component, 0)]

    def out(self, u: Array, time: float) -> tuple[Array, float, Array]:
        """Net amount that leaves each control volume per time, what comes in through the sides, and
        what leaves at the inlets with the fluid's own velocity."""
        padded = pad_deep(u, self.component, self.grid, self.sides, time)
        net = np.empty(u.shape)
        net_flux(
            plane(net, self.grid),
            plane(padded, self.grid),
            plane(self.marks, self.grid),
            *across(self.through, self.grid),
        )
        left = self.inlets.loss * u.reshape(-1)[self.inlets.index]
        net.reshape(-1)[self.inlets.index] += left - self.inlets.gain * self.inlets.velocity
        return net, self.came_in(padded), left

    def came_in(self, padded: Array) -> float:
        """What comes in through the sides of the domain per time."""
        total = 0.0
        inner = [slice(GHOSTS, -GHOSTS) if a in self.grid.axes else slice(None) for a in range(3)]
        own = edge(self.component, slice(None, -1 if self.wraps[self.component] > 0 else None))
        if self.wraps[self.component] > 0:  # the last faces are the first ones
            inner[self.component] = slice(GHOSTS, -GHOSTS - 1)
        for axis in self.grid.axes:
            if self.sides.periodic()[axis]:
                continue
            for end, sign in ((0, 1.0), (-1, -1.0)):
                near, far = list(inner), list(inner)
                near[axis] = slice(GHOSTS, GHOSTS + 1) if end == 0 else slice(-3, -2)
                far[axis] = slice(1, 2) if end == 0 else slice(-2, -1)
                mean = 0.5 * (padded[tuple(near)] + padded[tuple(far)])
                through = self.through[axis][
                    edge(axis, slice(0, 1) if end == 0 else slice(-1, None))
                ]
                total += sign * float(np.vdot(through[own], mean))
        return total

    def after(self, u: Array, low: Array, high: Array, net: Array, dt: float) -> Array:
        """Velocity after a stage: of the volumes `low` before it and `high` after it."""
        later, merged = np.empty(u.shape), high
        advance(later, u, low, net, dt, high, self.nothing)
        if self.guests.size:
            merged = high.copy()
            join_guests(later, merged, self.guests, self.hosts, self.shares, self.nothing)
        if self.listed.size:
            self.level(later, merged)
            follow_hosts(later, self.whole, self.their_hosts)
            fill_empty(later, high, self.listed, self.nothing, self.shape, self.wraps)
        self.join(later)
        return later

    def level(self, u: Array, volume: Array) -> None:
        """Mix small control volumes with their neighbours, in place."""
        cell = self.grid.cell_volume
        limits = TINY * cell, SMALL * cell, self.held, self.nothing
        level(u, volume, self.listed, *limits, self.shape, self.wraps)


def across(through: Faces, grid: Grid) -> Faces:
    """Fluxes in the order of the kernel's axes; of a slab none across its first."""
    x, y, z = (np.ascontiguousarray(t) for t in through)
    if not grid.is_slab:
        return x, y, z
    none = np.zeros((2, *x.shape[:2]))
    return none, x.reshape(1, *x.shape[:2]), y.reshape(1, *y.shape[:2])
