"""Bodies released in ideal fluid: I1 unbounded, I2 in closed containers.

One step from rest is enough: the cases are about the first acceleration.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
import trimesh
from scipy.spatial import ConvexHull, HalfspaceIntersection

from flowborne import Array, Grid
from flowborne.bodies import JointCommand
from flowborne.worlds import Boundaries, advance, make_world
from flowborne_validation.case import Case, reference, table
from flowborne_validation.findings import Finding, Grids, GridSeries, at_most, falling, near
from flowborne_validation.worlds import Vector, mjcf, ring_of_boxes, square

DT = 1e-3
"""s, the only step; no figure depends on it."""

LIGHT = 0.01
"""Density of most bodies here over the fluid's."""

WALLS = Boundaries()

UP: Vector = (0.0, 1.0, 0.0)
SIDEWAYS: Vector = (1.0, 0.0, 0.0)

Cells = Sequence[int]
"""Cells across the body, from coarse to fine."""


def oblong(cells: int) -> Grid:
    """A closed slab of 1 m by 2 m about the origin, `cells` across."""
    return Grid.slab(cells, 2 * cells, 1.0 / cells, (-0.5, -1.0))


def cube(cells: int) -> Grid:
    """A closed cube of 1 m about the origin, `cells` across."""
    return Grid((cells, cells, cells), 1.0 / cells, (-0.5, -0.5, -0.5))


def round_body(diameter: float) -> str:
    """A sphere, which in a slab is a cylinder."""
    return f'<geom type="sphere" size="{0.5 * diameter}"/>'


def ellipse(a: float, b: float) -> str:
    """Ellipse with semi-axes a along x and b along y."""
    return f'<geom type="ellipsoid" size="{a} {b} 1"/>'


def rise(grid: Grid, geom: str, ratio: float, direction: Vector = UP, walls: str = "") -> float:
    """Acceleration of a body against gravity, over gravity.

    geom       at the origin
    ratio      density over the fluid's
    direction  against gravity
    walls      fixed geoms
    """
    body = f'<body name="body"><freejoint name="root"/>{geom}</body>'
    gravity = (-direction[0], -direction[1], -direction[2])
    world = make_world(
        mjcf(walls, body), grid, gravity=gravity, solid_density=ratio, tolerance=1e-11
    )
    advance(world, DT)
    return float(world.solid.v[:3] @ np.array(direction)) / DT


def coefficient(grid: Grid, geom: str, direction: Vector = UP, walls: str = "") -> float:
    """Ca of a body in its container, from how it rises."""
    return (1.0 - LIGHT) / rise(grid, geom, LIGHT, direction, walls) - LIGHT


def turned(grid: Grid, geom: str) -> float:
    """Added moment of inertia about the origin over the fluid's density, m^4."""
    return -float(started(grid, geom, 'axis="0 0 1"')[5])


def pushed(grid: Grid, geom: str, direction: Vector, sides: Boundaries = WALLS) -> float:
    """Added mass over the fluid's density, m^3, or m^2 in a slab."""
    joint = f'type="slide" axis="{" ".join(str(x) for x in direction)}"'
    return -float(started(grid, geom, joint, sides)[:3] @ np.array(direction))


def started(grid: Grid, geom: str, joint: str, sides: Boundaries = WALLS) -> Array:
    """(6,) wrench of the pressure while a drive starts the body with unit acceleration.

    joint  its attributes in MJCF
    """
    body = f'<body name="body"><joint name="drive" {joint}/>{geom}</body>'
    world = make_world(mjcf(body), grid, solid_density=1.0, boundaries=sides, tolerance=1e-11)
    command = JointCommand.none(1)
    command.set(np.array([0]), 0.0, DT)
    return advance(world, DT, command=command).pressure_wrench[1]


def judged(title: str, on: Grids, values: Sequence[float], exact: float) -> Finding:
    """A finding within 1 % of its reference on the finest grid."""
    return near(title, GridSeries.toward(on, values, exact, relative=True), exact, relative=0.01)


def contained(
    title: str,
    exact: float,
    cells: Cells,
    width: float,
    box: Callable[[int], Grid] = square,
    direction: Vector = UP,
    walls: str = "",
) -> Finding:
    """Ca of a cylinder or a sphere of a diameter `width` (m) in a container of 1 m."""
    values = [
        coefficient(box(round(n / width)), round_body(width), direction, walls) for n in cells
    ]
    return judged(f"Ca of a {title}", Grids("cells across D", cells), values, exact)


LONGWISE = "cells along the long axis"


def across(quick: bool) -> Cells:
    """Cells across a cylinder in a container."""
    return (8, 16, 32) if quick else (8, 16, 32, 64)


def squares(quick: bool) -> list[Finding]:
    """Cylinder in a square."""
    rows = table("I2", "cylinder in closed square, Ca vs D/L").items()
    return [
        contained(f"cylinder in a square, D/L = {d:g}", exact, across(quick), 1.0 / round(1.0 / d))
        for d, exact in rows
        if not (quick and d < 0.2)
    ]


def oblongs(quick: bool) -> list[Finding]:
    """Cylinder in a box twice as long as wide."""
    name = "cylinder in 1x2 box (width 1): [moving across, moving along the long side]"
    findings = []
    for key, pair in reference("I2", name).items():
        width = float(key.removeprefix("D/L="))
        if quick and width < 0.5:
            continue
        for side, direction, exact in zip(("across", "along"), (SIDEWAYS, UP), pair, strict=True):
            title = f"cylinder {side} a 1 x 2 box, D/L = {width:g}"
            findings.append(contained(title, exact, across(quick), width, oblong, direction))
    return findings


LONG, SHORT = 0.1, 0.05
"""Semi-axes of the list's ellipse, m."""


def ellipse_in_box(quick: bool) -> list[Finding]:
    """Ellipse along both axes and turning."""
    grids = Grids(LONGWISE, (16, 32, 64) if quick else (16, 32, 64, 128))
    along, broadside, rotating = reference("I2", "ellipse 2:1 (a=0.1,b=0.05) in unit box")
    unbounded = np.pi / 8.0 * (LONG**2 - SHORT**2) ** 2
    boxes = [square(round(n / (2.0 * LONG))) for n in grids.cells]
    geom = ellipse(LONG, SHORT)
    rows = (
        ("Ca along its long axis", along, [coefficient(g, geom, SIDEWAYS) for g in boxes]),
        ("Ca across", broadside, [coefficient(g, geom, UP) for g in boxes]),
        ("I_a over the unbounded one", rotating, [turned(g, geom) / unbounded for g in boxes]),
    )
    return [
        judged(f"ellipse in a box, {label}", grids, values, exact) for label, exact, values in rows
    ]


def cubes(quick: bool) -> list[Finding]:
    """Sphere in a cube; the finest grid of the smallest sphere has 160^3 cells."""
    findings = []
    for ratio, exact in table("I2", "sphere in closed cube, Ca vs D/L").items():
        if quick and ratio < 0.3:
            continue
        cells = (8, 16) if quick or ratio < 0.15 else (8, 16, 32)
        title = f"sphere in a cube, D/L = {ratio:g}"
        findings.append(contained(title, exact, cells, 1.0 / round(1.0 / ratio), cube))
    return findings


def round_wall(radius: float, sides: int = 128) -> str:
    """Fixed boxes around the origin whose inner edges enclose the area of a circle."""
    turn = np.pi / sides
    inner = radius * float(np.sqrt(turn / np.tan(turn)))
    half = 0.05 * radius
    return ring_of_boxes(sides, inner + half, f"{half} {(inner + 2.0 * half) * np.tan(turn)} 1")


def ball_of_boxes(radius: float) -> str:
    """Fixed boxes around the origin whose inner faces enclose the volume of a ball."""
    normals = trimesh.creation.icosphere(subdivisions=3, radius=1.0).vertices
    planes = np.column_stack([normals, -np.ones(len(normals))])
    hollow = ConvexHull(HalfspaceIntersection(planes, np.zeros(3)).intersections)
    inner = radius * (4.0 / 3.0 * np.pi / hollow.volume) ** (1.0 / 3.0)
    half = 0.08 * radius
    geoms = []
    for normal in normals:
        centre = " ".join(str(x) for x in (inner + half) * normal)
        along = " ".join(str(x) for x in normal)
        size = f"{0.15 * radius} {0.15 * radius} {half}"
        geoms.append(f'<geom type="box" size="{size}" pos="{centre}" zaxis="{along}"/>')
    return "".join(geoms)


def shells(quick: bool) -> list[Finding]:
    """Cylinder and sphere in the middle of a fixed shell."""
    findings = []
    outer = 0.4
    ring = round_wall(outer)
    for ratio in (2.0,) if quick else (2.0, 3.0, 4.0):
        exact = (ratio**2 + 1.0) / (ratio**2 - 1.0)
        title = f"cylinder in a concentric shell, b/a = {ratio:g}"
        width = 2.0 * outer / ratio
        findings.append(contained(title, exact, across(quick), width, walls=ring))
    if not quick:
        exact = (2.0**3 + 2.0) / (2.0 * (2.0**3 - 1.0))
        title, ball = "sphere in a concentric shell, b/a = 2", ball_of_boxes(outer)
        findings.append(contained(title, exact, (8, 16, 32), outer, cube, walls=ball))
    return findings


def containers(quick: bool) -> list[Finding]:
    """I2: bodies in closed boxes and shells."""
    return squares(quick) + oblongs(quick) + ellipse_in_box(quick) + cubes(quick) + shells(quick)


FLAT_IMAGES = 3.438 / (2.0 * np.pi)
"""Velocity of the images of a dipole in a square of 1 m at the dipole, per area of the dipole: the
general form of I2's fit Ca + 1 = 2/(1 - 3.438 (D/2L)^2)."""

SOLID_IMAGES = 4.84372 / (2.0 * np.pi)
"""The same for a cube of 1 m, per volume: I2's q = 4.84372 (D/2L)^3."""


def unbounded(added: float, displaced: float, solid: bool = False) -> float:
    """Added mass over the fluid's density without the box of 1 m, from that in its middle. The
    body's dipole S is the sum of displaced and added volume; in the box it is S / (1 - images
    S)."""
    dipole = added + displaced
    return dipole / (1.0 + (SOLID_IMAGES if solid else FLAT_IMAGES) * dipole) - displaced


def free_rise(measured: float, ratio: float, displaced: float, solid: bool) -> float:
    """Rise over g without the box, from that in the box."""
    boxed = (1.0 - ratio) / measured - ratio
    free = unbounded(boxed * displaced, displaced, solid) / displaced
    return (1.0 - ratio) / (ratio + free)


def density_ratios(quick: bool) -> list[Finding]:
    """Accelerations of the list's tables, downward positive, and their limits."""
    findings = []
    for name, solid, limit in (("cylinder", False, -1.0), ("sphere", True, -2.0)):
        if quick and solid:
            continue
        width = 1.0 / 3.0 if solid else 0.25
        grid = (cube if solid else square)(round(32 / width))
        displaced = np.pi * width**3 / 6.0 if solid else np.pi * width**2 / 4.0
        rows = table("I1", f"table a/g {'(down +) ' if not solid else ''}{name}")
        for ratio, exact in (rows | {1e-6: limit, 1e6: 1.0}).items():
            measured = rise(grid, round_body(width), ratio)
            if ratio == 1.0:
                findings.append(at_most(f"a/g of a neutral {name}", measured, 1e-10))
                continue
            found = -free_rise(measured, ratio, displaced, solid)
            title = f"a/g of a {name}, rho_s/rho_f = {ratio:g}, 32 cells across D"
            findings.append(near(title, found, exact, relative=0.01))
    return findings


def ellipses(quick: bool) -> list[Finding]:
    """Rise of an ellipse along both axes, and its added moment of inertia."""
    grids = Grids(LONGWISE, (16, 32) if quick else (32, 64, 128))
    geom, area = ellipse(LONG, SHORT), np.pi * LONG * SHORT
    boxes = [square(round(n / (2.0 * LONG))) for n in grids.cells]
    rows = reference("I1", "rise a/g for rho_s/rho_f=0.01")
    findings = []
    for axis, direction in (("a=2b along long axis", SIDEWAYS), ("across", UP)):
        rises = [rise(box, geom, LIGHT, direction) for box in boxes]
        values = [free_rise(found, LIGHT, area, False) for found in rises]
        title = f"rise over g of an ellipse {axis}"
        findings.append(judged(title, grids, values, rows[f"ellipse {axis}"]))
    inertia = turning(LONG, SHORT)
    values = [free_turning(turned(box, geom), LONG, SHORT) / inertia for box in boxes]
    return [*findings, judged("I_a of an ellipse over rho pi/8 (a^2-b^2)^2", grids, values, 1.0)]


def turning(a: float, b: float) -> float:
    """Added moment of inertia of an ellipse over the fluid's density, unbounded, m^4."""
    return float(np.pi / 8.0 * (a**2 - b**2) ** 2)


def free_turning(boxed: float, a: float, b: float) -> float:
    """Added moment of inertia without the box of 1 m, from that in its middle. The images of the
    body's quadrupole, (a^2 - b^2)(a + b)^2/16, add its square times a number that follows from I2's
    ellipse."""

    def square(a: float, b: float) -> float:
        return ((a**2 - b**2) * (a + b) ** 2 / 16.0) ** 2

    excess = reference("I2", "ellipse 2:1 (a=0.1,b=0.05) in unit box")[2] - 1.0
    images = excess * turning(LONG, SHORT) / square(LONG, SHORT)
    return boxed / (1.0 + images * square(a, b) / turning(a, b))


def spheroid(quick: bool) -> list[Finding]:
    """A prolate spheroid twice as long as wide, along its axis."""
    grids = Grids("cells along the axis", (16, 32) if quick else (16, 32, 64))
    length, width = 0.4, 0.2
    e = np.sqrt(1.0 - (width / length) ** 2)
    a0 = 2.0 * (1.0 - e**2) / e**3 * (np.arctanh(e) - e)
    exact = float(a0 / (2.0 - a0))
    volume = np.pi / 6.0 * length * width**2
    geom = f'<geom type="ellipsoid" size="{0.5 * width} {0.5 * length} {0.5 * width}"/>'
    boxed = [coefficient(cube(round(n / length)), geom) for n in grids.cells]
    values = [unbounded(ca * volume, volume, solid=True) / volume for ca in boxed]
    return [judged("Ca of a prolate spheroid 2:1 along its axis", grids, values, exact)]


THIN = 1e-4
"""Half thickness of plate and disc, m."""


def plates(quick: bool) -> list[Finding]:
    """A plate across, along and turning; in the fluid it is 1.4 cells thick, so the order is 1."""
    half = 0.2
    cells = (16, 32, 64) if quick else (64, 128, 256, 512, 1024)
    grids = Grids("cells across the plate", cells)
    geom = f'<geom type="box" size="{half} {THIN} 1"/>'
    displaced, circle = 4.0 * half * THIN, np.pi * half**2
    boxes = [square(round(n / (2.0 * half))) for n in cells]
    broadside, along = (
        [unbounded(pushed(box, geom, direction), displaced) / circle for box in boxes]
        for direction in (UP, SIDEWAYS)
    )
    rotating = [free_turning(turned(box, geom), half, 0.0) / turning(half, 0.0) for box in boxes]
    return [
        judged("m_a of a plate across over rho pi a^2", grids, broadside, 1.0),
        judged("I_a of a plate over rho pi a^4/8", grids, rotating, 1.0),
        at_most("m_a of a plate along over rho pi a^2", along, 0.01, grids),
    ]


def quarter(cells: int) -> Grid:
    """A quarter of the cube of 1 m, `cells` across, between the planes x = 0 and z = 0 about which
    body and flow are symmetric."""
    return Grid((cells // 2, cells, cells // 2), 1.0 / cells, (0.0, -0.5, 0.0))


def without_thickness(cells: Cells, values: Sequence[float]) -> float:
    """Limit of values on three grids for no thickness in the fluid, which is proportional to e =
    1/cells. The flow round a thin rim of any shape adds terms in e ln e and e."""
    e = 1.0 / np.array(cells)
    return float(np.linalg.solve(np.column_stack([e**0, e * np.log(e), e]), values)[0])


def disc(quick: bool) -> list[Finding]:
    """A disc broadside, and its limit for no thickness, as in the list. In the fluid it is 1.75
    cells thick, and a disc of this thickness has the added mass of the series."""
    half = 0.2
    cells = (24, 48, 96) if quick else (32, 64, 128)
    geom = f'<geom type="cylinder" size="{half} {THIN}" zaxis="0 1 0"/>'
    displaced, exact = 2.0 * THIN * np.pi * half**2, 8.0 / 3.0 * half**3
    added = [4.0 * pushed(quarter(round(n / (2.0 * half))), geom, UP) for n in cells]
    values = [unbounded(mass, displaced, solid=True) / exact for mass in added]
    title = "m_a of a disc broadside over 8/3 rho a^3"
    thick = judged(title, Grids("cells across the disc", cells), values, 1.0)
    name, value = f"{title}, continued to no thickness", without_thickness(cells, values)
    limit = near(name, value, 1.0, relative=0.01)
    return [thick, falling(replace(limit, series=thick.series))]


def unbounded_bodies(quick: bool) -> list[Finding]:
    """I1: bodies corrected for their container."""
    return density_ratios(quick) + ellipses(quick) + spheroid(quick) + plates(quick) + disc(quick)


CASES = (Case("I1", unbounded_bodies, coarse=True), Case("I2", containers))
