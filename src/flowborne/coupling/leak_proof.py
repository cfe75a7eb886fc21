"""The leak-proof field (paper, section 6, item 4): it carries the fluid past moving bodies.

The bodies go from x^n to x^{n+1} in a step, and what they leave or take up of each cell flows
through its faces:

    sum over the faces of a cell of q  =  -(V^{n+1} - V^n) / dt + sources

One Poisson solve on the mean open parts of both ends makes the fluxes q = a A u of the velocity
half a step on do that, exactly where the paper projects with the bodies' effective velocity
(x^{n+1} - x^n) / dt.

A cell that a thin body passes over in a step holds fluid before it at first, at last behind. On the
mean of both ends it joins the two sides of the body, and fluid would flow through. So it is set
aside while the field is solved for: what it held goes to the cell before the body, and what it
holds at last comes from that behind.

Away from what moves the velocity fills whole cells already, so the solve takes place in a band
(`band`): what flows through its rim is kept. Outside cells are whole again, whatever pressures left
of them. That would be missing from the amount of dyes: with dye each of these cells passes it on to
the next one, towards the band. In trials pressures leave more, which shifts what they compare:
there the band is the whole grid. A closed region of fluid, such as the band, keeps its volume, but
that of the cells around a moving body varies a little on any grid: there the volumes of cut cells
at the end are scaled, the more the more they are closed, by 1e-5 to 1e-2.

In trials bodies stand for most steps. Then volumes stay, and so does the field of two such steps,
which their pressures have solved for. In runs what pressures left would be missing from the amounts
of dyes, which hold to rounding.

Method: docs/method/leak-proof.md.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np

from flowborne.coupling.band import Band, Projection, band_around
from flowborne.coupling.cut import Departure
from flowborne.coupling.fractions import Geometry
from flowborne.coupling.operators import beyond_sides
from flowborne.coupling.world import World
from flowborne.fluid.boundary import Boundaries
from flowborne.fluid.control_volumes import NONE
from flowborne.fluid.ghosts import join_ends, plane, planes
from flowborne.fluid.grid import Grid
from flowborne.fluid.projection import PressureGradient
from flowborne.kernels.arrays import LEAST, Array, Faces, Integers, Marks
from flowborne.kernels.control_volumes import neighbour
from flowborne.kernels.dye import face_of
from flowborne.kernels.faces import mean_flux
from flowborne.kernels.projection import Volumes, mark_unsettled, net_out
from flowborne.solvers.pressure import PressureSystem

TOLERANCE = 1e-9
"""Relative residual at which the solve ends, of hypothetical steps too: what is left of it stays in
the volumes until the next step, and the smallest of them must not feel it."""

LEFT = 1e-10
"""Parts of a whole cell that may be left of the volume of all cells (the root of the sum of their
squares), where that is reached first."""

FINER = 1e-2
"""Factor on both in a band. Cells that leave it become whole, so a uniform flow is off by what was
left in them; and weights of whole cells should be even to `kernels.even.ROUNDING`."""

SETTLED = 10.0
"""Part of a whole cell by which its volume may be off before the band takes it in, relative to the
tolerance of the pressure: what that left is no reason to correct it."""

SCALED = 2e-2
"""Most by which the volume of a cell that is nearly closed may be scaled to balance a closed
region; that of a half open one by half as much. 1.2e-2 is needed beside a fish, 1e-3 beside a
block. Where more is missing, what moves displaces fluid far away as well."""

MOST = 2.0
"""Factor on the volumes of a closed region beyond which it is a pocket that bodies crush, and is
left to them. One that they open holds nothing until it is reached."""

FILLED = 1e-300
"""Part of a whole cell that is left where a body fills it and rounding leaves exactly nothing: one
of volume 0 counts as never filled with fluid, and would not pass on what flows into it."""


def leak_proof_flux(
    world: World, departure: Departure, after: Geometry, dt: float
) -> tuple[Faces, Array]:
    """Volume fluxes through all faces over a step, m^3/s, and the volumes that they lead to, m^3:
    those of the start where bodies stand in a trial and leave them so to SETTLED.

    world      keeps the matrix while bodies stand
    departure  the start of the step
    after      the cut grid at its end
    """
    state, before, cells = departure.state, departure.cut, departure.volumes.cells
    fluid = departure.fluid
    grid, sides = fluid.grid, fluid.boundaries
    flux, weights = grid.empty_faces(), grid.empty_faces()
    for axis in grid.axes:
        ends = before.open[axis], after.open[axis]
        moving = state.velocity[axis], state.velocity_change[axis]
        mean_flux(flux[axis], weights[axis], *moving, *ends, grid.face_area, stiffness(grid))
    dipoles = sides.dipoles(grid)
    places = [] if dipoles is None else dipoles.places
    uncut = [weights[p.axis][p.layer] == stiffness(grid) for p in places]
    drive_sides(flux, weights, grid, sides, world.time + 0.5 * dt)
    slack = SETTLED * fluid.tolerance * grid.cell_volume
    stands = world.setup.trial and before is after
    same = cells, departure.rate, before.volume, cells
    if stands and not unsettled(same, flux, grid, dt, slack, -np.inf).any():
        return flux, cells
    swept = swept_cells(before, after, cells, grid, sides)
    start, end = swept.set_aside(flux, weights, cells, after.volume)
    volumes, band, later = (start, departure.rate, before.volume, end), None, None
    if not world.setup.trial:
        band = band_around(unsettled(volumes, flux, grid, dt, slack, grid.cell_volume), grid, sides)
    if band is not None:
        if state.scalars:
            band.fill_around(flux, volumes, dt, grid)
        own, box = band.own(flux), band.cells
        inside = partial(PressureGradient, band.inner(weights), 0.0, None, band.grid, Boundaries())
        held = start[box] + dt * departure.rate[box]
        projection = kept(world, before, after, band, inside)
        found = corrected(own, held, end[box], projection, dt, True)
        if found is not None:
            later = end.copy()
            later[box] = found
            for axis in grid.axes:
                flux[axis][band.faces(axis)] = own[axis]
    if later is None:
        if dipoles is not None:
            through = [weights[p.axis][p.layer] > 0.0 for p in places]  # not of cells set aside
            dipoles = dipoles.on([a & b for a, b in zip(uncut, through, strict=True)])
        whole = partial(PressureGradient, weights, 2.0 * stiffness(grid), dipoles, grid, sides)
        projection = kept(world, before, after, None, whole)
        later = corrected(flux, start + dt * departure.rate, end, projection, dt, False)
    assert later is not None
    if stands and not unsettled(same, flux, grid, dt, slack, -np.inf).any():
        return flux, cells
    swept.put_back(flux, later, end, dt)
    later[(later == 0.0) & (cells != 0.0)] = FILLED * grid.cell_volume
    return flux, later


def unsettled(
    volumes: Volumes, flux: Faces, grid: Grid, dt: float, slack: float, cut: float
) -> Marks:
    """(nx, ny, nz) which cells have to be corrected: that bodies cut at either end of the step, or
    that the fluxes do not fill.

    volumes  see `mark_unsettled`
    slack    by which the volume of a cell may be off, m^3
    cut      volume below which bodies cut a cell, m^3
    """
    marks = np.empty(grid.shape, np.uint8)
    start, rate, before, end = (plane(v, grid) for v in volumes)
    given = plane(marks, grid), (start, rate, before, end), planes(flux, grid)
    mark_unsettled(*given, dt, cut, slack)
    return marks


def kept(
    world: World,
    before: Geometry,
    after: Geometry,
    band: Band | None,
    gradient: Callable[[], PressureGradient],
) -> Projection:
    """The projection in a band or, without one, the whole grid: that of the last step while bodies
    stand."""
    still = world.still
    if still is None or still[0] is not after or still[1] != band:
        made = gradient()
        beyond = beyond_sides(made.dipoles, made.whole)
        system = PressureSystem(made.rate, made.boundaries.periodic(), beyond=beyond)
        still = after, band, (made, system)
    world.still = still if before is after else None
    return still[2]


def corrected(
    flux: Faces, held: Array, wanted: Array, projection: Projection, dt: float, in_band: bool
) -> Array | None:
    """Correct fluxes, in place, so that they lead to the volumes that are wanted, and give those
    that they lead to; None, and no change, where a band cannot be balanced.

    held     volumes at the start and what is brought in, m^3
    in_band  whether these are of a part of the grid
    """
    gradient, system = projection
    grid = gradient.grid
    reached = led_to(flux, held, grid, dt)
    target = balanced(system, reached, wanted, grid, alike=not in_band)
    if target is None:
        return None
    finer = FINER if in_band else 1.0
    left, missing = finer * LEFT * grid.cell_volume / dt, (reached - target) / dt
    solution = system.solve(missing, None, tolerance=finer * TOLERANCE, absolute=left)
    gradient.subtract(flux, solution.pressure, 1.0)
    return led_to(flux, held, grid, dt)


def led_to(flux: Faces, held: Array, grid: Grid, dt: float) -> Array:
    """Volumes of cells after fluxes have flowed for a time, m^3."""
    net = np.empty(grid.shape)
    net_out(plane(net, grid), *planes(flux, grid))
    return held - dt * net


def stiffness(grid: Grid) -> float:
    """Weight of a wholly open face, (a A)^2 / (a V): of unit density."""
    return grid.face_area**2 / grid.cell_volume


def drive_sides(flux: Faces, weights: Faces, grid: Grid, sides: Boundaries, time: float) -> None:
    """Set what the sides of the domain let through, and the weights there, in place.

    Half a control volume belongs to a face on a side; one whose flux is prescribed has no weight.
    """
    for place, across in sides.across(grid, time):
        weight = weights[place.axis][place.layer]
        flux[place.axis][place.layer] = across * (weight * (grid.face_area / stiffness(grid)))
    join_ends(flux, grid, sides)
    for place, part in sides.pressure_weights(grid):
        weights[place.axis][place.layer] *= 2.0 * part


def balanced(
    system: PressureSystem, reached: Array, wanted: Array, grid: Grid, alike: bool
) -> Array | None:
    """(nx, ny, nz) volumes at the end, whose sum over every closed region is that of the volumes
    reached: those that are wanted, V, with a part s (1 - V / h^3) more, of at most |s| = SCALED.

    alike  whether a region that this does not balance has all of them scaled by one factor; else
           None is given
    """
    if not system.regions:
        return wanted
    label, count = system.closed_regions(), system.regions
    inside = label >= 0
    number, volume, target = label[inside], wanted[inside], wanted.copy()
    give = volume * np.maximum(1.0 - volume / grid.cell_volume, 0.0)
    there, total, most = (np.bincount(number, v, count) for v in (reached[inside], volume, give))
    astray = np.abs(there - total) > SCALED * most
    if astray.any() and not alike:
        return None
    part = np.where(astray, total, most)
    scaled = np.divide(there - total, part, out=np.zeros(count), where=part > 0.0)
    scaled[scaled > MOST - 1.0] = 0.0
    target[inside] += scaled[number] * np.where(astray[number], volume, give)
    return target


TURNED = -0.5
"""Cosine between the ways into the body at both ends below which it has passed over."""


@dataclass(frozen=True)
class Swept:
    """The cells that a body passes over.

    cells           (n,) flat indices
    held, holds     (n,) volumes at the start and at the end of the step, m^3
    ahead, behind   (n,) cells that take the one and give the other
    leaves, enters  (n,) through which face: 2 axis for the lower, 2 axis + 1 for the upper one
    """

    cells: Integers
    held: Array
    holds: Array
    ahead: Integers
    behind: Integers
    leaves: Integers
    enters: Integers

    def set_aside(
        self, flux: Faces, weights: Faces, before: Array, after: Array
    ) -> tuple[Array, Array]:
        """Let nothing through the faces of these cells, in place, and give the volumes at both ends
        of the step with theirs at the cells ahead and behind."""
        if self.cells.size == 0:
            return before, after
        shape = np.array(before.shape)
        for cell in self.cells:
            for way in range(6):
                face = face_of(shape, way // 2, cell, way % 2)
                for field in (flux, weights):
                    field[way // 2].reshape(-1)[face] = 0.0
        start, end = before.copy(), after.copy()
        np.add.at(start.reshape(-1), self.ahead, self.held)
        np.add.at(end.reshape(-1), self.behind, self.holds)
        start.reshape(-1)[self.cells] = end.reshape(-1)[self.cells] = 0.0
        return start, end

    def put_back(self, flux: Faces, volumes: Array, wanted: Array, dt: float) -> None:
        """Add what flows to and from these cells to the fluxes, m^3/s, and give them their part of
        the volumes that are reached, in place. A pocket beside them may not reach what it should.

        wanted  volumes that `set_aside` gave for the end of the step
        """
        if self.cells.size == 0:
            return
        shape = np.array(volumes.shape)
        reached, asked = (field.reshape(-1)[self.behind] for field in (volumes, wanted))
        holds = self.holds * np.divide(reached, asked, out=np.zeros(asked.size), where=asked > 0.0)
        for volume, ways, sign in ((self.held, self.leaves, 1.0), (holds, self.enters, -1.0)):
            for cell, part, way in zip(self.cells, volume, ways, strict=True):
                face = face_of(shape, way // 2, cell, way % 2)
                flux[way // 2].reshape(-1)[face] += sign * (2 * (way % 2) - 1) * part / dt
        np.subtract.at(volumes.reshape(-1), self.behind, holds)
        volumes.reshape(-1)[self.cells] += holds


NOTHING_SWEPT = Swept(NONE, np.zeros(0), np.zeros(0), NONE, NONE, NONE, NONE)


def swept_cells(
    before: Geometry, after: Geometry, cells: Array, grid: Grid, sides: Boundaries
) -> Swept:
    """The cells that are on the other side of a body at the end of a step.

    cells  (nx, ny, nz) volumes at the start, m^3
    """
    if before is after:  # bodies that stand still
        return NOTHING_SWEPT
    (keys, into), (later, into_later) = (ways_in(cut, grid, sides) for cut in (before, after))
    _, first, second = np.intersect1d(keys, later, assume_unique=True, return_indices=True)
    one, two = into[first], into_later[second]
    sizes = np.linalg.norm(one, axis=1), np.linalg.norm(two, axis=1)
    passed = (one * two).sum(axis=1) < TURNED * sizes[0] * sizes[1]
    passed &= np.minimum(*sizes) > LEAST
    if not passed.any():
        return NOTHING_SWEPT
    found, place = np.unique(keys[first][passed] % cells.size, return_index=True)
    leaves, ahead = way_out(found, one[passed][place], before.open, grid, sides)
    enters, behind = way_out(found, two[passed][place], after.open, grid, sides)
    kept = np.ones(found.size, bool)
    for beside in (ahead, behind):
        kept &= (beside >= 0) & ~np.isin(beside, found)
    found = found[kept]
    held, holds = cells.reshape(-1)[found], after.volume.reshape(-1)[found]
    return Swept(found, held, holds, ahead[kept], behind[kept], leaves[kept], enters[kept])


def ways_in(cut: Geometry, grid: Grid, sides: Boundaries) -> tuple[Integers, Array]:
    """Cells that bodies close in part, as cell + body x number of cells, ascending; and (n, 3) how
    much more of their faces on one side than on the other, a vector into the body. It has no part
    along an axis across a side of the domain that the cell lies at."""
    count = int(np.prod(grid.shape))
    keys, row = np.unique(cut.rows[0] + cut.owner * count, return_inverse=True)
    into = np.zeros((keys.size, 3))
    np.add.at(into, row, cut.area / grid.face_area)
    at = np.unravel_index(keys % count, grid.shape)
    for axis in grid.axes:
        if not sides.periodic()[axis]:
            into[(at[axis] == 0) | (at[axis] == grid.shape[axis] - 1), axis] = 0.0
    return keys, into


def way_out(
    cells: Integers, into: Array, opened: Faces, grid: Grid, sides: Boundaries
) -> tuple[Integers, Integers]:
    """(n,) the face of each cell that leads away from the body, and the cell beyond; -1 where that
    face is closed or there is none."""
    shape = np.array(grid.shape)
    wraps = shape * np.array(sides.periodic())
    axes = np.abs(into).argmax(axis=1) if cells.size else np.zeros(0, np.int64)
    ways = 2 * axes + (into[np.arange(cells.size), axes] < 0.0)
    beyond = np.full(cells.size, -1)
    for n, (cell, way) in enumerate(zip(cells, ways, strict=True)):
        if opened[way // 2].reshape(-1)[face_of(shape, way // 2, cell, way % 2)] > 0.0:
            beyond[n] = neighbour(shape, wraps, cell, way)
    return ways, beyond
