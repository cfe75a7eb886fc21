"""Bodies released in ideal fluid: I1 unbounded, I2 in closed containers.

One step from rest is enough: the cases are about the first acceleration.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
import trimesh
from scipy.spatial import ConvexHull, HalfspaceIntersection

from flowborne import Array, Grid
from flowborne.bodies import JointCommand
from flowborne.worlds import Boundaries, advance, make_world
from flowborne_validation.case import reference, table
from flowborne_validation.findings import Figure, Figures
from flowborne_validation.worlds import Vector, mjcf, ring_of_boxes, square

DT = 1e-3
"""s, the only step; no figure depends on it."""

LIGHT = 0.01
"""Density of most bodies here over the fluid's."""

WALLS = Boundaries()

UP: Vector = (0.0, 1.0, 0.0)
SIDEWAYS: Vector = (1.0, 0.0, 0.0)


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


def contained(
    cells: int,
    width: float,
    box: Callable[[int], Grid] = square,
    direction: Vector = UP,
    walls: str = "",
) -> float:
    """Ca of a cylinder or a sphere of a diameter `width` (m), `cells` across it, in a container of
    1 m."""
    return coefficient(box(round(cells / width)), round_body(width), direction, walls)


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


def squares(cells: int, least: float) -> Figures:
    """Cylinder in a square, for D/L from the least on."""
    rows = table("I2", "cylinder in closed square, Ca vs D/L").items()
    return {
        f"Ca of a cylinder in a square, D/L = {d:g}": Figure(
            contained(cells, 1.0 / round(1.0 / d)), reference=exact
        )
        for d, exact in rows
        if d >= least
    }


def oblongs(cells: int, least: float) -> Figures:
    """Cylinder in a box twice as long as wide, for D/L from the least on."""
    name = "cylinder in 1x2 box (width 1): [moving across, moving along the long side]"
    rows = {float(key.removeprefix("D/L=")): pair for key, pair in reference("I2", name).items()}
    return {
        f"Ca of a cylinder {side} a 1 x 2 box, D/L = {width:g}": Figure(
            contained(cells, width, oblong, direction), reference=exact
        )
        for width, pair in rows.items()
        if width >= least
        for side, direction, exact in zip(("across", "along"), (SIDEWAYS, UP), pair, strict=True)
    }


LONG, SHORT = 0.1, 0.05
"""Semi-axes of the list's ellipse, m."""

SHELL = 0.4
"""Radius of the fixed shells, m."""


def ellipse_in_box(cells: int) -> Figures:
    """Ellipse along both axes and turning."""
    along, broadside, rotating = reference("I2", "ellipse 2:1 (a=0.1,b=0.05) in unit box")
    box, geom = square(round(cells / (2.0 * LONG))), ellipse(LONG, SHORT)
    inertia = turned(box, geom) / turning(LONG, SHORT)
    title = "ellipse in a box, "
    return {
        f"{title}Ca along its long axis": Figure(coefficient(box, geom, SIDEWAYS), (), along),
        f"{title}Ca across": Figure(coefficient(box, geom, UP), (), broadside),
        f"{title}I_a over the unbounded one": Figure(inertia, (), rotating),
    }


def cubes(cells: int, least: float, below: float) -> Figures:
    """Sphere in a cube, for D/L from the least on and below a bound."""
    return {
        f"Ca of a sphere in a cube, D/L = {ratio:g}": Figure(
            contained(cells, 1.0 / round(1.0 / ratio), cube), reference=exact
        )
        for ratio, exact in table("I2", "sphere in closed cube, Ca vs D/L").items()
        if least <= ratio < below
    }


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


def shells(cells: int, ratios: Sequence[float]) -> Figures:
    """Cylinder in the middle of a fixed shell."""
    ring = round_wall(SHELL)
    return {
        f"Ca of a cylinder in a concentric shell, b/a = {ratio:g}": Figure(
            contained(cells, 2.0 * SHELL / ratio, walls=ring),
            reference=(ratio**2 + 1.0) / (ratio**2 - 1.0),
        )
        for ratio in ratios
    }


def ball(cells: int) -> Figures:
    """Sphere in the middle of a fixed shell."""
    found = contained(cells, SHELL, cube, walls=ball_of_boxes(SHELL))
    exact = (2.0**3 + 2.0) / (2.0 * (2.0**3 - 1.0))
    return {"Ca of a sphere in a concentric shell, b/a = 2": Figure(found, reference=exact)}


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


def density_ratios(names: Sequence[str]) -> Figures:
    """Accelerations of the list's tables, downward positive, and their limits."""
    found: dict[str, float | Figure] = {}
    for name in names:
        solid = name == "sphere"
        width = 1.0 / 3.0 if solid else 0.25
        grid = (cube if solid else square)(round(32 / width))
        displaced = np.pi * width**3 / 6.0 if solid else np.pi * width**2 / 4.0
        rows = table("I1", f"table a/g {'(down +) ' if not solid else ''}{name}")
        for ratio, exact in (rows | {1e-6: -2.0 if solid else -1.0, 1e6: 1.0}).items():
            measured = rise(grid, round_body(width), ratio)
            if ratio == 1.0:
                found[f"a/g of a neutral {name}"] = measured
                continue
            title = f"a/g of a {name}, rho_s/rho_f = {ratio:g}, 32 cells across D"
            free = -free_rise(measured, ratio, displaced, solid)
            found[title] = Figure(free, reference=exact)
    return found


def ellipses(cells: int) -> Figures:
    """Rise of an ellipse along both axes, and its added moment of inertia."""
    geom, area, box = (
        ellipse(LONG, SHORT),
        np.pi * LONG * SHORT,
        square(round(cells / (2.0 * LONG))),
    )
    found: dict[str, float | Figure] = {}
    for axis, direction in (("a=2b along long axis", SIDEWAYS), ("across", UP)):
        free = free_rise(rise(box, geom, LIGHT, direction), LIGHT, area, False)
        exact = reference("I1", "rise a/g for rho_s/rho_f=0.01")[f"ellipse {axis}"]
        found[f"rise over g of an ellipse {axis}"] = Figure(free, reference=exact)
    inertia = free_turning(turned(box, geom), LONG, SHORT) / turning(LONG, SHORT)
    return {**found, "I_a of an ellipse over rho pi/8 (a^2-b^2)^2": inertia}


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


def spheroid(cells: int) -> Figures:
    """A prolate spheroid twice as long as wide, along its axis."""
    length, width = 0.4, 0.2
    e = np.sqrt(1.0 - (width / length) ** 2)
    a0 = 2.0 * (1.0 - e**2) / e**3 * (np.arctanh(e) - e)
    volume = np.pi / 6.0 * length * width**2
    geom = f'<geom type="ellipsoid" size="{0.5 * width} {0.5 * length} {0.5 * width}"/>'
    ca = coefficient(cube(round(cells / length)), geom)
    free = unbounded(ca * volume, volume, solid=True) / volume
    exact = float(a0 / (2.0 - a0))
    return {"Ca of a prolate spheroid 2:1 along its axis": Figure(free, reference=exact)}


THIN = 1e-4
"""Half thickness of plate and disc, m."""


def plates(cells: int) -> Figures:
    """A plate across, along and turning; in the fluid it is 1.4 cells thick, so the order is 1."""
    half = 0.2
    geom, box = f'<geom type="box" size="{half} {THIN} 1"/>', square(round(cells / (2.0 * half)))
    broadside, along = (
        unbounded(pushed(box, geom, direction), 4.0 * half * THIN) / (np.pi * half**2)
        for direction in (UP, SIDEWAYS)
    )
    rotating = free_turning(turned(box, geom), half, 0.0) / turning(half, 0.0)
    return {
        "m_a of a plate across over rho pi a^2": broadside,
        "I_a of a plate over rho pi a^4/8": rotating,
        "m_a of a plate along over rho pi a^2": along,
    }


def quarter(cells: int) -> Grid:
    """A quarter of the cube of 1 m, `cells` across, between the planes x = 0 and z = 0 about which
    body and flow are symmetric."""
    return Grid((cells // 2, cells, cells // 2), 1.0 / cells, (0.0, -0.5, 0.0))


def without_thickness(cells: Sequence[int], values: Sequence[float]) -> float:
    """Limit of values on three grids for no thickness in the fluid, which is proportional to e =
    1/cells. The flow round a thin rim of any shape adds terms in e ln e and e."""
    e = 1.0 / np.array(cells)
    return float(np.linalg.solve(np.column_stack([e**0, e * np.log(e), e]), values)[0])


def disc(cells: Sequence[int]) -> Figures:
    """A disc broadside, and its limit for no thickness, as in the list. In the fluid it is 1.75
    cells thick, and a disc of this thickness has the added mass of the series."""
    half = 0.2
    geom = f'<geom type="cylinder" size="{half} {THIN}" zaxis="0 1 0"/>'
    displaced, exact = 2.0 * THIN * np.pi * half**2, 8.0 / 3.0 * half**3
    added = [4.0 * pushed(quarter(round(n / (2.0 * half))), geom, UP) for n in cells]
    values = [unbounded(mass, displaced, solid=True) / exact for mass in added]
    title, limit = "m_a of a disc broadside over 8/3 rho a^3", without_thickness(cells, values)
    return {
        title: Figure(values, cells),
        f"{title}, continued to no thickness": Figure(values, cells, value=limit),
    }
