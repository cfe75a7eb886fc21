"""Flow past a fixed body in open water: a cylinder in B4, B5, B6 and V9, a sphere in B7.

B4 and B7 are steady; in B5, B6 and V9 the cylinder sheds vortices. V9's is held; of the moved one
the list names curves and has none.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

import numpy as np

from flowborne import Grid, StepReport, World
from flowborne.worlds import advance, make_world, velocity_at
from flowborne_validation.case import Case, Tier, confirmed, reference, table
from flowborne_validation.findings import (
    Curve,
    Details,
    Finding,
    Grids,
    Plot,
    falling,
    near,
    within,
)
from flowborne_validation.shedding import CFL, STREAM, UNBOUNDED, backflow, cylinder, judged, shed
from flowborne_validation.worlds import (
    Place,
    Vector,
    force_on,
    mjcf,
    over_places,
    through_flow,
    whole_steps,
)

OPEN_GRIDS = {True: (4,), False: (8, 16, 24, 32)}
"""Cells across D of B5, B6 and V9, by quick."""

ONCE = (24, 32)
"""Grids of them and of B4 with one place in the cell, of which each takes half an hour."""

BACK: Vector = (0.5, 0.0, 0.0)
LONGEST = 5.5
"""The cylinder's back, and the longest backflow behind it that is measured, m."""

UPSTREAM, DOWNSTREAM, ASIDE = 6, 16, 5
"""Diameters from the sphere's centre to the sides of its box; the lateral ones slip."""

BETWEEN: Vector = (0.0, np.sqrt(0.5), np.sqrt(0.5))
"""Between y and z, away from the planes of symmetry."""


def across(cells: Sequence[int]) -> Grids:
    return Grids("cells across D", cells)


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


def steady_cylinder(quick: bool) -> list[Finding]:
    """B4: drag, length of the backflow and the angle at which the flow leaves the cylinder."""
    grids = (4, 8) if quick else (8, 16, 24, 32)

    def measure(world: World, first: bool) -> tuple[Sequence[float], str]:
        drag, text = steady_drag(
            world, 60.0 if first else 15.0, lambda report: UNBOUNDED.coefficients(report)[0]
        )
        angle = 180.0 - separation(world, (0.0, 1.0, 0.0))
        return (drag, backflow(world, BACK, LONGEST), angle), text

    build = partial(open_water, viscosity=1.0 / 40.0)
    (drags, lengths, angles), lines = over_places(grids, build, STREAM, measure, ONCE)
    return [
        judged("B4", "Cd", grids, drags, (1.48, 1.62), lines=lines),
        judged("B4", "bubble length L/D", grids, lengths, (2.13, 2.35)),
        judged("B4", "separation angle deg", grids, angles, (52.7, 54.2)),
    ]


def shed_in_the_open(
    reynolds: float, strouhal: float, grids: Sequence[int], quick: bool
) -> tuple[list[Any], list[str]]:
    """What `shed` measures at a Reynolds number."""
    return shed(partial(open_water, viscosity=1.0 / reynolds), strouhal, grids, quick, ONCE)


def shedding_at_100(quick: bool) -> list[Finding]:
    """B5: mean drag, amplitude of the lift and frequency at Re 100."""
    grids = OPEN_GRIDS[quick]
    (drag, lift, strouhal), lines = shed_in_the_open(100.0, 0.165, grids, quick)
    return [
        falling(judged("B5", "Cd mean", grids, drag, (1.31, 1.39), lines=lines)),
        falling(judged("B5", "Cl amplitude", grids, lift, (0.30, 0.345))),
        falling(judged("B5", "St", grids, strouhal, (0.160, 0.170))),
    ]


def shedding_at_200(quick: bool) -> list[Finding]:
    """B6: mean drag, amplitude of the lift and frequency at Re 200, and unless quick the frequency
    at Re 250 to 500."""
    grids = OPEN_GRIDS[quick]
    (drag, lift, strouhal), lines = shed_in_the_open(200.0, 0.197, grids, quick)
    return [
        judged("B6", "Cd mean", grids, drag, (1.17, 1.41), lines=lines),
        judged("B6", "Cl amplitude", grids, lift, (0.50, 0.70)),
        judged("B6", "St", grids, strouhal, (0.190, 0.203)),
        *([] if quick else frequencies()),
    ]


def frequencies() -> list[Finding]:
    """Frequency over the Reynolds number, against Gerris's."""
    known, grids = table("B6", "St(Re) Gerris 250..500"), (8, 16)
    found = {re: shed_in_the_open(re, st, grids, False)[0][2] for re, st in known.items()}
    curves = (
        Curve("Gerris", list(known), list(known.values()), True),
        Curve("flowborne", list(known), [float(np.mean(st[-1])) for st in found.values()]),
    )
    plots = {min(known): Plot("Reynolds number", "Strouhal number", curves)}
    return [
        near(f"St at Re {re:g}", st, known[re], across(grids), relative=0.03, plot=plots.get(re))
        for re, st in found.items()
    ]


def held_at_185(quick: bool) -> list[Finding]:
    """V9: the figures of the cylinder while it is held."""
    held, grids = "fixed cylinder Re=185", OPEN_GRIDS[quick]
    (drag, lift, strouhal), lines = shed_in_the_open(185.0, 0.195, grids, quick)
    measured = drag, [np.sqrt(0.5) * np.array(values) for values in lift], strouhal
    findings: list[Finding] = []
    for (name, exact), values in zip(reference("V9", held).items(), measured, strict=True):
        details = Details(confirmed=confirmed("V9", held), lines=[] if findings else lines)
        title, on = f"{name}, held", across(grids)
        findings.append(near(title, values, exact, on, relative=0.05, **details))
    return findings


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


def of_sphere(report: StepReport) -> float:
    """Cd = F / (rho U^2 / 2  pi D^2 / 4); the quarter has a quarter of F."""
    return float(4.0 * force_on(report)[0] * 8.0 / np.pi)


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


def sphere(quick: bool) -> list[Finding]:
    """B7: drag at Re 100 and 150, and the bubble behind the sphere at Re 100."""
    # on 12 cells a place takes a quarter of an hour
    grids, once = ((4,), ()) if quick else ((6, 8, 12), (12,))
    findings = []
    for reynolds in (100, 150):

        def measure(world: World, first: bool) -> tuple[Sequence[float], str]:
            drag, text = steady_drag(world, 16.0 if first else 6.0, of_sphere)
            return (drag, recirculation(world), separation(world, BETWEEN)), text

        build = partial(quarter, reynolds=reynolds)
        (drags, lengths, angles), lines = over_places(grids, build, STREAM, measure, once)
        exact = float(reference("B7", f"Cd({reynolds})"))
        title, on = f"Cd at Re {reynolds}", across(grids)
        findings.append(falling(near(title, drags, exact, on, relative=0.03, lines=lines)))
        if reynolds == 100:
            length = float(reference("B7", "L/D(100)"))
            angle = float(reference("B7", "separation angle").removesuffix(" deg"))
            findings += [
                within("L/D at Re 100", lengths, length, (0.85, 0.90), on),
                near("separation angle at Re 100", angles, angle, on, absolute=2.0),
            ]
    return findings


CASES = (
    Case("B4", steady_cylinder, Tier.HALF_HOUR, coarse=True),
    Case("B5", shedding_at_100, Tier.HALF_HOUR, coarse=True),
    Case("B6", shedding_at_200, Tier.HALF_HOUR, coarse=True),
    Case("V9", held_at_185, Tier.HALF_HOUR, coarse=True),
    Case("B7", sphere, full=Tier.HALF_HOUR, coarse=True),
)
