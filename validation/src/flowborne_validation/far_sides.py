"""Bodies in small boxes with far sides: I10, set going, against endless fluid, and the eel's way.

Added mass takes one step from rest, as in I1 and I2.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from flowborne import Grid, Simulation, load_scene
from flowborne.worlds import Boundaries, BoundaryClosed, BoundaryFar
from flowborne_validation.added_mass import (
    SIDEWAYS,
    THIN,
    UP,
    ellipse,
    pushed,
    round_body,
    without_thickness,
)
from flowborne_validation.case import Case, Tier, reference
from flowborne_validation.findings import Finding, Grids, near
from flowborne_validation.worlds import Vector

ASIDE, FLAT = 0.3, 0.1
"""Radii by which a box lies beside the body, along every axis; width of the ellipse over length."""

FAR, CLOSED = BoundaryFar(), BoundaryClosed()
AROUND = Boundaries(FAR, FAR, FAR, FAR)
ROOM = Boundaries(FAR, FAR, FAR, FAR, FAR, FAR)


def box(cells: int, lower: Sequence[float], upper: Sequence[float]) -> Grid:
    """A slab or a room with `cells` along each metre."""
    counts = [round(cells * (high - low)) for low, high in zip(lower, upper, strict=True)]
    if len(counts) == 2:
        return Grid.slab(counts[0], counts[1], 1.0 / cells, (lower[0], lower[1]))
    shape, origin = (counts[0], counts[1], counts[2]), (lower[0], lower[1], lower[2])
    return Grid(shape, 1.0 / cells, origin)


def compared(
    title: str, geom: str, exact: float, halves: Vector, grids: Grids, off: float = 0.0
) -> Finding:
    """The added mass along x of a body at the origin, over that in endless fluid.

    halves  half of the box along each axis, m; the last is 0 in a slab
    off     m by which the box lies beside the body along each axis
    """
    extent = [half for half in halves if half > 0.0]
    boxes = [box(n, [off - e for e in extent], [off + e for e in extent]) for n in grids.cells]
    sides = AROUND if len(extent) == 2 else ROOM
    values = [pushed(grid, geom, SIDEWAYS, sides) / exact for grid in boxes]
    return near(f"m_a of {title}, over endless fluid's", values, 1.0, grids, relative=0.02)


def circles(quick: bool) -> list[Finding]:
    """In squares, centred and aside, and in boxes twice as long as wide along and across."""
    grids = Grids("cells a radius", (8, 16) if quick else (8, 16, 32))
    nearest = float(reference("I10", "half-widths of the box over a, from which on it is met"))
    findings = []
    for half in (nearest, 3.0):
        for off, where in ((0.0, ""), (ASIDE, f", aside by {ASIDE:g} radii")):
            title = f"a circle in a square of {half:g} radii to each side{where}"
            body, halves = round_body(2.0), (half, half, 0.0)
            findings.append(compared(title, body, np.pi, halves, grids, off))
    for halves, which in (((4.0, 2.0, 0.0), "along"), ((2.0, 4.0, 0.0), "across")):
        title = f"a circle {which} a box of 4 x 2 radii to each side"
        findings.append(compared(title, round_body(2.0), np.pi, halves, grids))
    return findings


def spheres(quick: bool) -> list[Finding]:
    """In cubes, centred and aside."""
    grids = Grids("cells a radius", (4, 8) if quick else (8, 16))
    title, exact = "a sphere in a cube of 2 radii to each side", 2.0 / 3.0 * np.pi
    return [
        compared(f"{title}{where}", round_body(2.0), exact, (2.0, 2.0, 2.0), grids, off)
        for off, where in ((0.0, ""), (ASIDE, f", aside by {ASIDE:g} radii"))
    ]


def slender(quick: bool) -> list[Finding]:
    """An ellipse along its axis and across."""
    grids = Grids("cells a half-length", (40, 80) if quick else (40, 80, 160))
    rows = (("along", ellipse(1.0, FLAT), FLAT**2), ("across", ellipse(FLAT, 1.0), 1.0))
    return [
        compared(
            f"an ellipse 10:1 {which} in a square of 2 half-lengths to each side",
            geom,
            np.pi * part,
            (2.0, 2.0, 0.0),
            grids,
        )
        for which, geom, part in rows
    ]


def disc(quick: bool) -> Finding:
    """A disc broadside, continued to no thickness, in a quarter of a cube of 2 radii to each side
    between two mirrors."""
    cells = (8, 16, 32) if quick else (16, 32, 64)
    geom = f'<geom type="cylinder" size="1 {THIN}" zaxis="0 1 0"/>'
    sides = Boundaries(CLOSED, FAR, FAR, FAR, CLOSED, FAR)
    boxes = [box(n, (0.0, -2.0, 0.0), (2.0, 2.0, 2.0)) for n in cells]
    values = [4.0 * pushed(grid, geom, UP, sides) / (8.0 / 3.0) for grid in boxes]
    title = "m_a of a disc broadside between two mirrors, continued to no thickness"
    return near(title, without_thickness(cells, values), 1.0, relative=0.02)


WHOLE, EEL_CELL = ((-1.22, -1.42), (2.44, 2.24)), 0.01
"""Corners of a domain of 3.66 x 3.66 m that holds the eel's whole way, and its cells, m."""


def eel_way(
    lower: tuple[float, float],
    upper: tuple[float, float],
    seconds: int = 2,
    follow: str = "nothing",
) -> float:
    """How far the head of the robot eel of 0.55 m swims along y, m.

    follow  what the domain follows
    """
    sides = {f"boundaries.{name}": "far" for name in ("x_min", "x_max", "y_min", "y_max")}
    cells = round((upper[1] - lower[1]) / EEL_CELL)
    domain = {"lower": list(lower), "upper": list(upper), "resolution": cells, "follow": follow}
    changes = sides | {f"domain.{key}": str(value) for key, value in domain.items()}
    with Simulation(load_scene("eel", changes), workers=1) as simulation:
        head = simulation.world.solid.q[1]
        for _ in range(60 * seconds):
            simulation.advance_frame()
        return float(simulation.world.solid.q[1] - head)


def way_over(
    ratio: float, low: tuple[float, float], high: tuple[float, float], where: str = ""
) -> Finding:
    """The eel's way in a domain with these corners over that in WHOLE."""
    sizes = f"{high[0] - low[0]:.2g} x {high[1] - low[1]:.3g} m"
    title = f"way of the eel in {where}{sizes}, over that in 3.66 x 3.66 m"
    return near(title, ratio, 1.0, relative=0.005)


def eel() -> list[Finding]:
    """The eel in small boxes against the largest one; its wake stays inside."""
    large = eel_way(*WHOLE)
    boxes = ((0.36, -0.03), (0.86, 0.87)), ((0.2, -0.1), (1.02, 0.92))
    return [way_over(eel_way(low, high) / large, low, high) for low, high in boxes]


def between_far_sides(quick: bool) -> list[Finding]:
    """I10: added mass in small boxes, and unless quick the way of the eel."""
    found = [*circles(quick), *spheres(quick), *slender(quick), disc(quick)]
    return found if quick else [*found, *eel()]


CASES = (Case("I10", between_far_sides, full=Tier.HALF_HOUR),)
