"""Small boxes with far sides: I10, bodies set going, against endless fluid, and the eel's way; I12,
a sphere in a stream, bodies that fall in oblong boxes, and a pair of vortices that leaves through a
side. The cylinder that sheds vortices is B8.

Added mass takes one step from rest, as in I1 and I2.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from flowborne import Array, Grid, Simulation, load_scene
from flowborne.worlds import (
    Boundaries,
    BoundaryClosed,
    BoundaryFar,
    advance,
    kinetic_energy,
    make_world,
    set_velocity,
)
from flowborne_validation.added_mass import (
    SIDEWAYS,
    THIN,
    UP,
    ellipse,
    pushed,
    round_body,
    without_thickness,
)
from flowborne_validation.case import reference
from flowborne_validation.findings import Figure, Figures
from flowborne_validation.shedding import STREAM
from flowborne_validation.worlds import force_on, mjcf, start_at_once

PLACED = {0.0: "", 0.3: ", aside by 0.3 radii"}
"""Radii by which a box lies beside the body, along every axis, and what is said of it."""

FLAT = 0.1
"""Width of the ellipse over its length."""

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
    cells: int, geom: str, exact: float, halves: Sequence[float], off: float = 0.0
) -> float:
    """The added mass along x of a body at the origin, over that in endless fluid.

    halves  half of the box along each axis, m
    off     m by which the box lies beside the body along each axis
    """
    grid = box(cells, [off - half for half in halves], [off + half for half in halves])
    return pushed(grid, geom, SIDEWAYS, AROUND if len(halves) == 2 else ROOM) / exact


def circles(cells: int) -> Figures:
    """I10: in squares, centred and aside, and in boxes twice as long as wide along and across."""
    body, found, title = round_body(2.0), {}, "m_a of a circle {}, over endless fluid's"
    nearest = float(reference("I10", "half-widths of the box over a, from which on it is met"))
    for half in (nearest, 3.0):
        for off, where in PLACED.items():
            name = title.format(f"in a square of {half:g} radii to each side{where}")
            found[name] = compared(cells, body, np.pi, (half, half), off)
    for halves, which in (((4.0, 2.0), "along"), ((2.0, 4.0), "across")):
        name = title.format(f"{which} a box of 4 x 2 radii to each side")
        found[name] = compared(cells, body, np.pi, halves)
    return found


def spheres(cells: int) -> Figures:
    """I10: in cubes, centred and aside."""
    title, exact = "m_a of a sphere in a cube of 2 radii to each side", 2.0 / 3.0 * np.pi
    return {
        f"{title}{where}, over endless fluid's": compared(
            cells, round_body(2.0), exact, (2.0, 2.0, 2.0), off
        )
        for off, where in PLACED.items()
    }


def slender(cells: int) -> Figures:
    """I10: an ellipse along its axis and across."""
    title = (
        "m_a of an ellipse 10:1 {} in a square of 2 half-lengths to each side, over endless fluid's"
    )
    rows = (("along", ellipse(1.0, FLAT), FLAT**2), ("across", ellipse(FLAT, 1.0), 1.0))
    return {
        title.format(which): compared(cells, geom, np.pi * part, (2.0, 2.0))
        for which, geom, part in rows
    }


def disc(cells: Sequence[int]) -> Figures:
    """I10: a disc broadside, continued to no thickness, in a quarter of a cube of 2 radii to each
    side between two mirrors."""
    geom = f'<geom type="cylinder" size="1 {THIN}" zaxis="0 1 0"/>'
    sides = Boundaries(CLOSED, FAR, FAR, FAR, CLOSED, FAR)
    boxes = [box(n, (0.0, -2.0, 0.0), (2.0, 2.0, 2.0)) for n in cells]
    values = [4.0 * pushed(grid, geom, UP, sides) / (8.0 / 3.0) for grid in boxes]
    title = "m_a of a disc broadside between two mirrors, continued to no thickness"
    return {title: without_thickness(cells, values)}


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


def way_in(low: tuple[float, float], high: tuple[float, float], where: str = "") -> str:
    """Name of the eel's way in a domain with these corners over that in WHOLE."""
    sizes = f"{high[0] - low[0]:.2g} x {high[1] - low[1]:.3g} m"
    return f"way of the eel in {where}{sizes}, over that in 3.66 x 3.66 m"


def eel() -> Figures:
    """I10: the eel in small boxes against the largest one; its wake stays inside."""
    large = eel_way(*WHOLE)
    boxes = ((0.36, -0.03), (0.86, 0.87)), ((0.2, -0.1), (1.02, 0.92))
    return {way_in(low, high): eel_way(low, high) / large for low, high in boxes}


FLOWING = BoundaryFar((1.0, 0.0, 0.0))
DEEP = Boundaries(*(FLOWING,) * 6)

REYNOLDS = 100.0

ROOMS = (
    ("5 x 3 x 3", (-1.5, -1.5, -1.5), (3.5, 1.5, 1.5)),
    ("3.6 x 2 x 2", (-1.0, -1.0, -1.0), (2.6, 1.0, 1.0)),
    ("3.6 x 1.5 x 1.5", (-0.75, -0.75, -0.75), (2.85, 0.75, 0.75)),
)
"""Boxes in diameters around the sphere."""

LARGE, UNDISTURBED = ((-2.5, -2.5, -2.5), (5.5, 2.5, 2.5)), 10.0
"""Box of 8 x 5 x 5 diameters that they are compared with; times D/U before the drag is taken."""


def sphere_drag(lower: tuple[float, ...], upper: tuple[float, ...], cells: int) -> float:
    """Drag coefficient of the sphere in a box after UNDISTURBED."""
    world = make_world(
        mjcf('<body><geom type="sphere" size="0.5"/></body>'),
        box(cells, lower, upper),
        viscosity=1.0 / REYNOLDS,
        boundaries=DEEP,
        tolerance=1e-6,
    )
    set_velocity(world, STREAM)
    dt = 0.8 / cells
    start_at_once(world, dt)
    report = advance(world, dt, round(UNDISTURBED / dt))
    return 8.0 / np.pi * float(force_on(report)[0])


def sphere_in_stream() -> Figures:
    """I12: the sphere's drag in small boxes, over that in a larger one, and the published one."""
    cells = 8
    large = sphere_drag(*LARGE, cells)
    found: dict[str, float | Figure] = {
        f"drag of a sphere at Re 100 in {name} diameters, over that in 8 x 5 x 5": sphere_drag(
            lower, upper, cells
        )
        / large
        for name, lower, upper in ROOMS
    }
    exact = float(reference("B7", "Cd(100)"))
    return found | {"Cd of B7's sphere in 8 x 5 x 5 diameters": Figure(large, reference=exact)}


def fall(geom: str, grid: Grid, density: float) -> float:
    """Acceleration in the sixth step of a body that is let go under 1 m/s^2 along -x, m/s^2: when
    the sides have the vorticity of the first ones."""
    world = make_world(
        mjcf(f'<body><joint name="x" type="slide" axis="1 0 0"/>{geom}</body>'),
        grid,
        boundaries=AROUND if grid.is_slab else ROOM,
        solid_density=density,
        gravity=(-1.0, 0.0, 0.0),
    )
    advance(world, 0.02, 5)
    before = world.solid.v[0]
    advance(world, 0.02)
    return float(before - world.solid.v[0]) / 0.02


def falling() -> Figures:
    """I12: a circle ten times as dense as the fluid, and a sphere twice as dense, in boxes twice as
    long as wide."""
    title, found = "acceleration of a {} a box of {} radii to each side, over endless fluid's", {}
    for half, way in (((4.0, 2.0), "along"), ((2.0, 4.0), "across")):
        grid = box(16, [-part for part in half], half)
        ratio = fall('<geom type="cylinder" size="1 5"/>', grid, 10.0) / (9.0 / 11.0)
        found[title.format(f"circle {way}", "4 x 2")] = ratio
    grid = box(12, (-2.0, -1.0, -1.0), (2.0, 1.0, 1.0))
    ratio = fall('<geom type="sphere" size="0.5"/>', grid, 2.0) / 0.4
    return {**found, title.format("sphere along", "4 x 2 x 2"): ratio}


def pair(x: Array, y: Array, z: Array) -> tuple[Array, Array, Array]:
    """Two vortices of 2 pi m^2/s and a core of 0.25 m, 1 m apart, that go along x at 1 m/s."""
    u, v = 0.0 * (x + y + z), 0.0 * (x + y + z)
    for place, sign in ((0.5, -1.0), (-0.5, 1.0)):
        square = np.maximum(x**2 + (y - place) ** 2, 1e-12)
        turning = sign * (1.0 - np.exp(-16.0 * square)) / square
        u, v = u - turning * (y - place), v + turning * x
    return u, v, 0.0 * u


def leaving_pair() -> Figures:
    """I12: what is left of its energy in a box of 4 m, 5 s after it came to the side."""
    grid = box(16, (-2.0, -2.0), (2.0, 2.0))
    world = make_world(grid=grid, boundaries=AROUND, viscosity=0.002)
    set_velocity(world, pair)
    before = kinetic_energy(world)
    advance(world, 0.02, 350)
    title = "energy of a vortex pair left in a box that it has left, over that at the start"
    return {title: kinetic_energy(world) / before}
