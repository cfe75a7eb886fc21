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

A closed region of fluid keeps its volume, but that of the cells around a moving body wavers a
little on any grid: there all volumes at the end are scaled alike, by 1e-5 to 1e-3.

Method: docs/method/leak-proof.md.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flowborne.coupling.cut import Departure
from flowborne.coupling.fractions import Geometry
from flowborne.coupling.operators import beyond_sides
from flowborne.coupling.world import World
from flowborne.fluid.boundary import Boundaries
from flowborne.fluid.control_volumes import NONE
from flowborne.fluid.ghosts import impose_sides, plane, planes
from flowborne.fluid.grid import Grid
from flowborne.fluid.projection import PressureGradient
from flowborne.kernels.arrays import PERIODIC, PRESCRIBED, Array, Faces, Integers
from flowborne.kernels.control_volumes import neighbour
from flowborne.kernels.dye import face_of
from flowborne.kernels.faces import mean_flux
from flowborne.kernels.projection import net_out
from flowborne.solvers.pressure import PressureSystem

TOLERANCE = 1e-9
"""Relative residual at which the solve ends, of hypothetical steps too: what is left of it stays in
the volumes until the next step, and the smallest of them must not feel it."""

LEFT = 1e-10
"""Parts of a whole cell that may be left of the volume of all cells (the root of the sum of their
squares), where that is reached first."""

MOST = 2.0
"""Factor on the volumes of a closed region beyond which it is a pocket that bodies crush, and is
left to them. One that they open holds nothing until it is reached."""

FILLED = 1e-300
"""Part of a whole cell that is left where a body fills it and rounding leaves exactly nothing: one
of volume 0 counts as never filled with fluid, and would not pass on what flows into it."""


def leak_proof_flux(
    world: World, departure: Departure, after: Geometry, dt: float
) -> tuple[Faces, Array]:
    """Volume fluxes through all faces over a step, m^3/s, and the volumes that they lead to, m^3.

    world      keeps the matrix while bodies stand
    departure  the start of the step
    after      the cut grid at its end
    """
    state, before, cells = departure.state, departure.cut, departure.volumes.cells
    grid, sides = departure.fluid.grid, departure.fluid.boundaries
    flux, weights = grid.zeros_faces(), grid.zeros_faces()
    for axis in grid.axes:
        ends = before.open[axis], after.open[axis]
        moving = state.velocity[axis], state.velocity_change[axis]
        mean_flux(flux[axis], weights[axis], *moving, *ends, grid.face_area, stiffness(grid))
    dipoles = sides.dipoles(grid)
    places = [] if dipoles is None else dipoles.places
    uncut = [weights[p.axis][p.layer] == stiffness(grid) for p in places]
    drive_sides(flux, weights, grid, sides, world.time + 0.5 * dt)
    swept = swept_cells(before, after, cells, grid, sides)
    start, end = swept.set_aside(flux, weights, cells, after.volume)
    if before is not after or world.still is None or world.still[0] is not after:
        if dipoles is not None:
            through = [weights[p.axis][p.layer] > 0.0 for p in places]  # not of cells set aside
            dipoles = dipoles.on([a & b for a, b in zip(uncut, through, strict=True)])
        gradient = PressureGradient(weights, 2.0 * stiffness(grid), dipoles, grid, sides)
        beyond = beyond_sides(dipoles, gradient.whole)
        system = PressureSystem(weights, sides.periodic(), beyond=beyond)
        world.still = (after, gradient, system) if before is after else None
    else:
        _, gradient, system = world.still
    rhs, net = volume_rates(system, start, end, departure.rate, dt), np.empty(grid.shape)
    net_out(plane(net, grid), *planes(flux, grid))
    rhs += net
    left = LEFT * grid.cell_volume / dt
    solution = system.solve(-rhs, None, tolerance=TOLERANCE, absolute=left)
    gradient.subtract(flux, solution.pressure, 1.0)
    net_out(plane(net, grid), *planes(flux, grid))
    later = start + dt * (departure.rate - net)
    swept.put_back(flux, later, end, dt)
    later[(later == 0.0) & (cells != 0.0)] = FILLED * grid.cell_volume
    return flux, later


def stiffness(grid: Grid) -> float:
    """Weight of a wholly open face, (a A)^2 / (a V): of unit density."""
    return grid.face_area**2 / grid.cell_volume


def drive_sides(flux: Faces, weights: Faces, grid: Grid, sides: Boundaries, time: float) -> None:
    """Set what the sides of the domain let through, and the weights there, in place.

    Half a control volume belongs to a face on a side; one whose flux is prescribed has no weight.
    """
    impose_sides(flux, grid, sides, time)
    for place, side in sides.around(grid):
        through, weight = (field[place.axis][place.layer] for field in (flux, weights))
        if side.normal == PRESCRIBED:
            through *= weight * (grid.face_area / stiffness(grid))
        if side.normal != PERIODIC:
            weight *= 2.0 * side.pressure_weight(place)


def volume_rates(
    system: PressureSystem, cells: Array, later: Array, rate: Array, dt: float
) -> Array:
    """(nx, ny, nz) what the volume of each cell grows by less what is brought into it, m^3/s; sums
    to 0 over every closed region."""
    target = later.copy()
    if system.regions:
        label = system.closed_regions()
        inside = label >= 0
        number = label[inside]
        held = np.bincount(number, cells[inside] + dt * rate[inside], system.regions)
        wanted = np.bincount(number, later[inside], system.regions)
        factor = np.divide(held, wanted, out=np.ones(system.regions), where=wanted > 0.0)
        factor[factor > MOST] = 1.0
        target[inside] *= factor[number]
    return (target - cells) / dt - rate


LEAST = 1e-3
"""Part of a face by which a body closes one side of a cell more than the other, if it has one."""

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
