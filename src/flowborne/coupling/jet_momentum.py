"""What a mouth lets through brings its momentum into the flow, or takes it out, on any grid.

A jet leaves the skin with the velocity w and spreads within half a radius, a flow into a mouth
converges as fast: on a grid with a few cells to the radius interpolation between faces misses a
fifth to two thirds of their momentum. So in a box around the mouth advection is held to

    sum m' u*  =  sum m u  -  dt sum rho F u  +  dt rho Q (v_b + w)

with the volume F that flows out of the box per time, and what is missing is given to the faces
before the mouth. Mouths whose boxes meet share one.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flowborne.coupling.fractions import Geometry
from flowborne.coupling.mouths import Jet, block, covered, distance_at, jet_force
from flowborne.fluid.grid import Array, Faces, Grid

MARGIN = 2.0
"""Cells from the rim of a mouth to the sides of its box."""

BEFORE = 2.0
"""Cells before the skin to which faces are given what is missing."""

Range = tuple[int, int]


@dataclass(frozen=True)
class Due:
    """The momentum that a box is to hold after advection.

    jets      of the mouths in the box
    cells     first cell and the one behind the last, along each axis
    momentum  (3,) of the faces of these cells, N s
    """

    jets: tuple[Jet, ...]
    cells: tuple[Range, Range, Range]
    momentum: Array

    def faces(self, axis: int) -> tuple[slice, ...]:
        """The faces across `axis`."""
        return tuple(slice(low, high + (a == axis)) for a, (low, high) in enumerate(self.cells))


def momentum_due(
    velocity: Faces,
    opened: Faces,
    mass: Faces,
    jets: tuple[Jet, ...],
    grid: Grid,
    density: float,
    dt: float,
) -> list[Due]:
    """What the boxes around the mouths that let something through are to hold a step later.

    Boxes that meet a side of the domain are left out: there the sides say what comes in.

    velocity  Faces that advection is to carry, m/s
    opened    open fraction of each face
    mass      of each face, kg
    """
    due = []
    for own, cells in boxes(tuple(jet for jet in jets if jet.rate != 0.0), grid):
        held = Due(own, cells, dt * jet_force(own, density))
        for axis in grid.axes:
            at = held.faces(axis)
            held.momentum[axis] += float(np.vdot(mass[axis][at], velocity[axis][at]))
            held.momentum[axis] -= dt * density * flow_out(velocity, opened, held, axis, grid)
        due.append(held)
    return due


def boxes(
    jets: tuple[Jet, ...], grid: Grid
) -> list[tuple[tuple[Jet, ...], tuple[Range, Range, Range]]]:
    """The mouths by the boxes around them, as ranges of cells; those that meet a side left out."""
    groups: list[tuple[tuple[Jet, ...], Array]] = []
    for jet in jets:
        reach = jet.mouth.radius / grid.spacing + MARGIN
        place = (jet.centre - np.array(grid.origin)) / grid.spacing
        box = np.floor([place - reach, place + reach + 1.0]).astype(int)
        if grid.is_slab:
            box[:, 2] = 0, 1
        together: tuple[Jet, ...] = (jet,)
        while meeting := [
            g for g in groups if (g[1][0] <= box[1]).all() & (g[1][1] >= box[0]).all()
        ]:
            for group in meeting:
                groups.remove(group)
                together += group[0]
                box = np.array([np.minimum(box[0], group[1][0]), np.maximum(box[1], group[1][1])])
        groups.append((together, box))
    inside = []
    for together, box in groups:
        x, y, z = ((int(low), int(high)) for low, high in box.T)
        if all(box[0, a] > 1 and box[1, a] < grid.shape[a] - 1 for a in grid.axes):
            inside.append((together, (x, y, z)))
    return inside


def flow_out(velocity: Faces, opened: Faces, held: Due, component: int, grid: Grid) -> float:
    """Momentum by density and time that the flow carries out of a box, m^4/s^2.

    The cells of the faces across `component`, the momentum's axis, are staggered: what flows
    through the box's sides is the mean of what flows through the faces at both of their ends.
    """
    total = 0.0
    for axis in grid.axes:
        for end, sign in enumerate((-1.0, 1.0)):
            carried, through = list(held.faces(component)), list(held.faces(component))
            edge = held.cells[axis][end]
            if axis == component:
                carried[axis] = through[axis] = slice(edge - 1 + end, edge + 1 + end)
            else:
                low, high = held.cells[component]
                carried[axis] = slice(edge - 1, edge + 1)
                through[axis], through[component] = slice(edge, edge + 1), slice(low - 1, high + 1)
            value = mean(velocity[component][tuple(carried)], axis)
            flux = opened[axis][tuple(through)] * velocity[axis][tuple(through)]
            total += sign * float(np.vdot(mean(flux, component), value))
    return grid.face_area * total


def mean(values: Array, axis: int) -> Array:
    """Mean of each two neighbours along `axis`."""
    return 0.5 * (np.delete(values, -1, axis) + np.delete(values, 0, axis))


def give_missing(
    due: list[Due], velocity: Faces, ahead: Faces, mass: Faces, cut: Geometry, grid: Grid
) -> None:
    """Hold a velocity to what is due, in place.

    velocity  Faces after advection, m/s
    ahead     Faces, what was carried along and taken off again, m/s
    mass      of each face after the step, kg
    """
    for held in due:
        for axis in grid.axes:
            at = held.faces(axis)
            places = block(grid.face_coordinates(axis), at)
            near = distance_at(places, cut, grid) < BEFORE * grid.spacing
            share = np.zeros(len(places))
            for jet in held.jets:
                before = (places - jet.centre) @ jet.along > -grid.spacing
                share += near * before * covered(places, jet.mouth, jet.centre, jet.along, grid)
            own, weight = mass[axis][at], share.reshape(velocity[axis][at].shape)
            total = float(np.vdot(own, weight))
            if total > 0.0:
                now = float(np.vdot(own, velocity[axis][at] + ahead[axis][at]))
                velocity[axis][at] += (held.momentum[axis] - now) / total * weight
