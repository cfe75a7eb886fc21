"""Flow past a fixed body in open water: a cylinder in B4, B5, B6 and V9, a sphere in B7.

B4 and B7 are steady; in B5, B6 and V9 the cylinder sheds vortices. V9's is held; of the moved one
the list names curves and has none.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from flowborne import Grid, StepReport, World
from flowborne.worlds import advance, make_world, velocity_at
from flowborne_validation.case import reference, table
from flowborne_validation.findings import Curve, Figure, Figures, Plot, named
from flowborne_validation.shedding import CFL, STREAM, UNBOUNDED, backflow, cylinder, shed
from flowborne_validation.worlds import (
    Place,
    Vector,
    force_on,
    mjcf,
    over_places,
    through_flow,
    whole_steps,
)

ONCE = (24, 32)
"""Cells across D of B4, B5, B6 and V9 with one place in the cell; each takes half an hour."""

BACK: Vector = (0.5, 0.0, 0.0)
LONGEST = 5.5
"""The cylinder's back, and the longest backflow behind it that is measured, m."""

UPSTREAM, DOWNSTREAM, ASIDE = 6, 16, 5
"""Diameters from the sphere's centre to the sides of its box; the lateral ones slip."""

BETWEEN: Vector = (0.0, np.sqrt(0.5), np.sqrt(0.5))
"""Between y and z, away from the planes of symmetry."""


def open_water(cells: int, place: Place, viscosity: float) -> World:
    """The cylinder at the origin, in a place of its cell, and the stream that enters the domain.
    The domain reaches 20 D upstream and 30 D downstream and to each side, which slips; half as wide
    it would raise the drag at Re 100 by 0.8 %."""
    lower = -20.0 - place[0] / cells, -30.0 - place[1] / cells
    grid = Grid.slab(50 * cells, 60 * cells, 1.0 / cells, lower)
    return make_world(
        cylinder(1.0, 0.0, 0.0),
        grid,
        viscosity=viscosity,
        boundaries=through_flow(STREAM),
        tolerance=1e-7,
    )


def steady_cylinder(grids: Sequence[int]) -> Figures:
    """B4: drag, length of the backflow and the angle at which the flow leaves the cylinder."""

    def measure(world: World, first: bool) -> tuple[Sequence[float], str]:
        drag, text = steady_drag(
            world, 60.0 if first else 15.0, lambda report: UNBOUNDED.coefficients(report)[0]
        )
        angle = 180.0 - separation(world, (0.0, 1.0, 0.0))
        return (drag, backflow(world, BACK, LONGEST), angle), text

    build = partial(open_water, viscosity=1.0 / 40.0)
    found, lines = over_places(grids, build, STREAM, measure, ONCE)
    return named(("Cd", "bubble length L/D", "separation angle deg"), found, grids, lines)


def shed_in_the_open(
    reynolds: float, strouhal: float, grids: Sequence[int], periods: int
) -> tuple[list[Any], list[str]]:
    """What `shed` measures at a Reynolds number."""
    return shed(partial(open_water, viscosity=1.0 / reynolds), strouhal, grids, periods, ONCE)


def shedding_cylinder(
    reynolds: float, strouhal: float, grids: Sequence[int], periods: int
) -> Figures:
    """B5 and B6: mean drag, amplitude of the lift and frequency."""
    found, lines = shed_in_the_open(reynolds, strouhal, grids, periods)
    return named(("Cd mean", "Cl amplitude", "St"), found, grids, lines)


def frequencies(grids: Sequence[int], periods: int) -> Figures:
    """B6: frequency over the Reynolds number, against Gerris's."""
    known = table("B6", "St(Re) Gerris 250..500")
    found = {re: shed_in_the_open(re, st, grids, periods)[0][2] for re, st in known.items()}
    curves = (
        Curve("Gerris", list(known), list(known.values()), True),
        Curve("flowborne", list(known), [float(np.mean(st[-1])) for st in found.values()]),
    )
    plots = {min(known): Plot("Reynolds number", "Strouhal number", curves)}
    return {
        f"St at Re {re:g}": Figure(st, grids, known[re], plot=plots.get(re))
        for re, st in found.items()
    }


def held_at_185(grids: Sequence[int], periods: int) -> Figures:
    """V9: the figures of the cylinder while it is held."""
    (drag, lift, strouhal), lines = shed_in_the_open(185.0, 0.195, grids, periods)
    exact = reference("V9", "fixed cylinder Re=185")
    measured = drag, [np.sqrt(0.5) * np.array(values) for values in lift], strouhal
    found = named([f"{name}, held" for name in exact], measured, grids, lines)
    return {
        name: replace(figure, reference=known)
        for (name, figure), known in zip(found.items(), exact.values(), strict=True)
    }


def quarter(cells: int, place: Place, reynolds: float) -> World:
    """A quarter of the sphere's box, between two planes about which the flow is symmetric. The
    sphere has its place in a cell along the stream; across it is on planes of nodes."""
    counts = (UPSTREAM + DOWNSTREAM) * cells, ASIDE * cells, ASIDE * cells
    grid = Grid(counts, 1.0 / cells, (-UPSTREAM - place[0] / cells, 0.0, 0.0))
    sphere = '<body name="sphere"><geom type="sphere" size="0.5"/></body>'
    return make_world(
        mjcf(sphere),
        grid,
        viscosity=1.0 / reynolds,
        boundaries=through_flow(STREAM),
        tolerance=1e-7,
    )


def steady_drag(
    world: World, duration: float, coefficient: Callable[[StepReport], float]
) -> tuple[float, str]:
    """Drag coefficient after some times D/U, and its change over the last one in words."""
    steps, dt = whole_steps(duration, CFL * world.flow()[0].grid.spacing)
    tail = round(1.0 / dt)
    before, after = (coefficient(advance(world, dt, n)) for n in (steps - tail, tail))
    return after, f"Cd changes by {after - before:.2g} in the last D/U"


def recirculation(world: World) -> float:
    """Length of the backflow behind the sphere along its axis, m; 0 where there is none."""
    fluid, state = world.flow()
    u = state.velocity[0]
    # the flow is even about the axis: a parabola through the rows at h/2 and 3h/2
    row = (9.0 * u[:, 0, 0] - u[:, 1, 1]) / 8.0
    x = fluid.grid.face_coordinates(0)[0]
    start = int(np.searchsorted(x, 0.5 + fluid.grid.spacing))
    if row[start] > 0.0:
        return 0.0
    i = start + int(np.argmax(row[start:] > 0.0))
    return float(x[i] - fluid.grid.spacing * row[i] / (row[i] - row[i - 1]) - 0.5)


def separation(world: World, aside: Vector) -> float:
    """Angle from the front at which the flow along a body of D = 1 m reverses, degrees; 180 if it
    does not.

    Extrapolated to the body from one and two cells away.

    aside  direction across the stream that spans the plane of the angle
    """
    h = world.flow()[0].grid.spacing
    angles = np.radians(np.arange(95.0, 175.0, 0.25))
    outward = np.outer(-np.cos(angles), STREAM.velocity) + np.outer(np.sin(angles), aside)
    along = np.outer(np.sin(angles), STREAM.velocity) + np.outer(np.cos(angles), aside)
    turns = []
    for away in (h, 2.0 * h):
        backward = (velocity_at(world, (0.5 + away) * outward) * along).sum(axis=1) < 0.0
        if not backward.any():
            return 180.0
        turns.append(float(np.degrees(angles[int(np.argmax(backward))])))
    return 2.0 * turns[0] - turns[1]


def sphere(grids: Sequence[int], once: Sequence[int]) -> Figures:
    """B7: drag at Re 100 and 150, and the bubble behind the sphere at Re 100."""

    def measure(world: World, first: bool) -> tuple[Sequence[float], str]:
        # Cd = F / (rho U^2 / 2  pi D^2 / 4); the quarter has a quarter of F
        drag, text = steady_drag(
            world, 16.0 if first else 6.0, lambda report: 32.0 * force_on(report)[0] / np.pi
        )
        return (drag, recirculation(world), separation(world, BETWEEN)), text

    found: dict[str, Figure] = {}
    for reynolds in (100, 150):
        build = partial(quarter, reynolds=reynolds)
        (drags, lengths, angles), lines = over_places(grids, build, STREAM, measure, once)
        exact = float(reference("B7", f"Cd({reynolds})"))
        found[f"Cd at Re {reynolds}"] = Figure(drags, grids, exact, lines=lines)
        if reynolds == 100:
            angle = float(reference("B7", "separation angle").removesuffix(" deg"))
            found["L/D at Re 100"] = Figure(lengths, grids)
            found["separation angle at Re 100"] = Figure(angles, grids, angle)
    return found
