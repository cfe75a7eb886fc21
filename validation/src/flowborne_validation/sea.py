"""Small boxes in an endless sea: B8, a cylinder that sheds vortices in a stream; I11, bodies that
swim and are towed through still water in a window that follows them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from flowborne import Array, Grid, World, step
from flowborne.bodies import JointCommand
from flowborne.worlds import (
    Boundaries,
    BoundaryFar,
    follow_bodies,
    make_world,
    set_going,
    set_velocity,
)
from flowborne_validation.case import reference
from flowborne_validation.far_sides import EEL_CELL, WHOLE, box, eel_way, way_in
from flowborne_validation.findings import Figure, Figures, named
from flowborne_validation.shedding import CFL, STREAM, cylinder, shed
from flowborne_validation.worlds import ORIGIN, Place, force_on, mjcf

AHEAD = {12: 4.0, 8: 3.0}
"""Length of a box in D -> diameters ahead of the cylinder."""

PLACES = ((0.0, 0.0), (1 / 3, 2 / 3), (2 / 3, 1 / 3))
"""Places of the eel in a cell of the grid, by which its way in 4 s differs by 2 %."""

TOWED = mjcf(
    '<body name="cylinder"><joint type="slide" axis="1 0 0"/><joint type="slide" axis="0 1 0"/>'
    '<geom type="cylinder" size="0.5 1"/></body>'
)
UPSTREAM = -1.0, 0.0
"""m/s, at which the cylinder is towed."""


def around(cells: int, place: Place, length: int, width: int) -> Grid:
    """A box in D; the cylinder is at the origin, in a place of its cell."""
    x, y = -AHEAD[length] - place[0] / cells, -0.5 * width - place[1] / cells
    return box(cells, (x, y), (x + length, y + width))


def in_stream(cells: int, place: Place, length: int, width: int) -> World:
    """The held cylinder at Re 100 in a box in a sea that flows."""
    sides = Boundaries(*(BoundaryFar(velocity=(1.0, 0.0, 0.0)),) * 4)
    return make_world(
        cylinder(1.0, 0.0, 0.0),
        around(cells, place, length, width),
        viscosity=0.01,
        boundaries=sides,
        tolerance=1e-7,
    )


def cylinder_in_sea(grids: Sequence[int], periods: int, length: int, width: int) -> Figures:
    """B8: B5's figures in a small box. In the smaller one more error is accepted."""
    build = partial(in_stream, length=length, width=width)
    found, lines = shed(build, 0.165, grids, periods)
    names = ("Cd mean", "Cl amplitude", "St")
    return {
        f"{name} in {length} x {width} D": replace(figure, reference=float(reference("B5", name)))
        for name, figure in named(names, found, grids, lines).items()
    }


def towed(cells: int) -> World:
    """The cylinder that is towed through still water in a window that follows it."""
    sea, grid = Boundaries(*(BoundaryFar(),) * 4), around(cells, ORIGIN, 12, 8)
    world = make_world(TOWED, grid, viscosity=0.01, boundaries=sea, tolerance=1e-7)
    follow_bodies(world, [1], [0, 1])
    return world


def drag(world: World, velocity: Sequence[float], duration: float) -> float:
    """Drag coefficient in the mean over the last D/U of some, on a body that keeps a velocity."""
    command, dt = JointCommand.none(world.solid.v.size), 0.5 * CFL * world.flow()[0].grid.spacing
    dofs = np.arange(world.solid.v.size)
    command.set(dofs, np.asarray(velocity)[dofs], np.asarray(velocity)[dofs])
    world.solid.v[:] = np.asarray(velocity)[dofs]
    set_going(world)
    count, last = round(duration / dt), round(1.0 / dt)
    forces = [force_on(step(world, dt, command))[0] for _ in range(count)]
    return float(2.0 * np.mean(forces[-last:]))


def towed_over_held(cells: int) -> Figures:
    """I11: the same flow seen from the water and from the cylinder."""
    held = in_stream(cells, ORIGIN, 12, 8)
    set_velocity(held, STREAM)
    at_rest = drag(held, (0.0, 0.0), 5.0)
    title = "drag of a towed cylinder in a window over that of a held one in a stream, at 5 D/U"
    return {title: drag(towed(cells), UPSTREAM, 5.0) / at_rest}


def eel() -> Figures:
    """I11: the eel's mean way from PLACES in windows that follow it, against a domain that holds
    all of it."""
    windows = ((0.36, -0.09), (0.86, 0.81)), ((0.2, -0.25), (1.02, 0.95))
    large = ways(*WHOLE, "nothing")
    found = {}
    for low, high in windows:
        own = ways(low, high, "bodies")
        lines = [f"{name}: {way.mean():.4f} m, from {way.min():.4f} to {way.max():.4f} m"
                 for name, way in (("in the window", own), ("in the domain", large))]  # fmt: skip
        ratio = float(own.mean() / large.mean())
        found[way_in(low, high, "a window of ")] = Figure(ratio, lines=lines)
    return found


def ways(low: tuple[float, float], high: tuple[float, float], follow: str) -> Array:
    """(n,) the eel's way in 4 s from each of PLACES, m."""
    shifts = [(EEL_CELL * a, EEL_CELL * b) for a, b in PLACES]
    corners = [((low[0] + x, low[1] + y), (high[0] + x, high[1] + y)) for x, y in shifts]
    return np.array([eel_way(*both, seconds=4, follow=follow) for both in corners])
