"""Steady flow past a fixed sphere: B7."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from flowborne import Grid, World
from flowborne.boundaries import Boundaries, BoundaryInflow, BoundaryOpen
from flowborne.validation.case import Case, Finding, GridSeries, Tier, near
from flowborne.validation.fluid_cases import Uniform
from flowborne.validation.reference import reference
from flowborne.validation.worlds import Vector, mjcf, whole_steps
from flowborne.worlds import advance, make_world, set_velocity, start_from, velocity_at

UPSTREAM, DOWNSTREAM, ASIDE = 6, 16, 5
"""Diameters from the sphere's centre to the sides of the box; those aside slip."""

GRIDS = {True: (4,), False: (6, 8, 12)}
"""Cells across D, by quick."""

FIRST, NEXT = {True: 6.0, False: 16.0}, 6.0
"""Times D/U that the flow is given to become steady: on the first grid, by quick, from the
undisturbed one, and on the others from that of the coarser grid."""

CFL = 1.0
"""Cells that the oncoming flow crosses in a step."""

STREAM = Uniform((1.0, 0.0, 0.0))
"""U = 1 m/s past a sphere of D = 1 m in a fluid of 1 kg/m^3."""

BETWEEN: Vector = (0.0, np.sqrt(0.5), np.sqrt(0.5))
"""Between y and z, away from the planes of symmetry."""


def quarter(cells: int, reynolds: float) -> World:
    """A quarter of the box, between two planes about which the flow is symmetric."""
    counts = (UPSTREAM + DOWNSTREAM) * cells, ASIDE * cells, ASIDE * cells
    grid = Grid(counts, 1.0 / cells, (-float(UPSTREAM), 0.0, 0.0))
    sphere = '<body name="sphere"><geom type="sphere" size="0.5"/></body>'
    return make_world(
        mjcf(sphere),
        grid,
        viscosity=1.0 / reynolds,
        boundaries=Boundaries(BoundaryInflow(STREAM), BoundaryOpen()),
        tolerance=1e-7,
    )


def steady(world: World, duration: float) -> tuple[float, float]:
    """Drag coefficient after some time D/U, and its change over the last of these."""
    fluid, _ = world.flow()
    steps, dt = whole_steps(duration, CFL * fluid.grid.spacing)
    tail = round(1.0 / dt)
    before = drag(world, dt, steps - tail)
    after = drag(world, dt, tail)
    return after, abs(after - before)


def drag(world: World, dt: float, steps: int) -> float:
    """Cd = F / (rho U^2 / 2  pi D^2 / 4) after some steps; the quarter feels a quarter of F."""
    report = advance(world, dt, steps)
    force = (report.pressure_wrench + report.viscous_wrench)[1, 0]
    return float(4.0 * force * 8.0 / np.pi)


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
    """Angle from the front at which the flow along a body of D = 1 m turns round, degrees; 180
    where it does not.

    Found at one and at two cells from the body and continued to its side.

    aside  across the stream: the plane in which it is looked for
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
    grids = GRIDS[quick]
    findings = []
    for reynolds in (100, 150):
        rows, lines = [], []
        coarser = None
        for n in grids:
            world = quarter(n, reynolds)
            if coarser is None:
                set_velocity(world, STREAM)
            else:
                start_from(coarser, world)
            coefficient, change = steady(world, NEXT if coarser else FIRST[quick])
            rows.append((coefficient, recirculation(world), separation(world, BETWEEN)))
            lines.append(f"{n:>6g} cells across D: Cd changes by {change:.2g} in the last D/U")
            coarser = world
        drags, lengths, angles = zip(*rows, strict=True)
        exact = float(reference("B7", f"Cd({reynolds})"))
        series = series_of(grids, drags, exact)
        title = f"Cd at Re {reynolds}"
        findings.append(near(title, drags[-1], exact, relative=0.03, falling=series, lines=lines))
        if reynolds == 100:
            findings += bubble(grids, lengths, angles)
    return findings


def bubble(
    grids: tuple[int, ...], lengths: tuple[float, ...], angles: tuple[float, ...]
) -> list[Finding]:
    """The findings about the bubble at Re 100."""
    length = float(reference("B7", "L/D(100)"))
    angle = float(reference("B7", "separation angle").removesuffix(" deg"))
    long, turned = series_of(grids, lengths, length), series_of(grids, angles, angle)
    low, high = 0.85, 0.90
    inside = low <= lengths[-1] <= high
    return [
        Finding("L/D at Re 100", lengths[-1], length, f"[{low:g}, {high:g}]", inside, long),
        near("separation angle at Re 100", angles[-1], angle, absolute=2.0, series=turned),
    ]


def series_of(grids: Sequence[int], values: Sequence[float], exact: float) -> GridSeries:
    """Values from grid to grid with their errors."""
    return GridSeries("cells across D", grids, values, [abs(v - exact) for v in values])


CASES = (Case("B7", sphere, full=Tier.HALF_HOUR, coarse=True),)
