"""Small domains in a sea: I12, a sphere in a stream, bodies that fall in oblong boxes, and a pair
of vortices that leaves through a side. The cylinder that sheds vortices is B8.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from flowborne import Array, Grid
from flowborne.worlds import (
    Boundaries,
    BoundaryFar,
    advance,
    kinetic_energy,
    make_world,
    set_velocity,
)
from flowborne_validation.case import Case, reference
from flowborne_validation.far_sides import AROUND, ROOM, box
from flowborne_validation.findings import Finding, near
from flowborne_validation.shedding import STREAM
from flowborne_validation.worlds import force_on, mjcf, start_at_once

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


def spheres() -> Iterator[Finding]:
    """The sphere's drag in small boxes, over that in a larger one, and the published one."""
    cells = 8
    large = sphere_drag(*LARGE, cells)
    for name, lower, upper in ROOMS:
        value = sphere_drag(lower, upper, cells) / large
        title = f"drag of a sphere at Re 100 in {name} diameters, over that in 8 x 5 x 5"
        yield near(title, value, 1.0, relative=0.02)
    title, exact = "Cd of B7's sphere in 8 x 5 x 5 diameters", float(reference("B7", "Cd(100)"))
    yield near(title, large, exact, relative=0.02)


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


def falling() -> Iterator[Finding]:
    """A circle ten times as dense as the fluid, and a sphere twice as dense, in boxes twice as long
    as wide."""
    title = "acceleration of a {} a box of {} radii to each side, over endless fluid's"
    for half, way in (((4.0, 2.0), "along"), ((2.0, 4.0), "across")):
        grid = box(16, [-part for part in half], half)
        ratio = fall('<geom type="cylinder" size="1 5"/>', grid, 10.0) / (9.0 / 11.0)
        yield near(title.format(f"circle {way}", "4 x 2"), ratio, 1.0, relative=0.005)
    grid = box(12, (-2.0, -1.0, -1.0), (2.0, 1.0, 1.0))
    ratio = fall('<geom type="sphere" size="0.5"/>', grid, 2.0) / 0.4
    yield near(title.format("sphere along", "4 x 2 x 2"), ratio, 1.0, relative=0.005)


def pair(x: Array, y: Array, z: Array) -> tuple[Array, Array, Array]:
    """Two vortices of 2 pi m^2/s and a core of 0.25 m, 1 m apart, that go along x at 1 m/s."""
    u, v = 0.0 * (x + y + z), 0.0 * (x + y + z)
    for place, sign in ((0.5, -1.0), (-0.5, 1.0)):
        square = np.maximum(x**2 + (y - place) ** 2, 1e-12)
        turning = sign * (1.0 - np.exp(-16.0 * square)) / square
        u, v = u - turning * (y - place), v + turning * x
    return u, v, 0.0 * u


def leaving_pair() -> Finding:
    """What is left of its energy in a box of 4 m, 5 s after it came to the side."""
    grid = box(16, (-2.0, -2.0), (2.0, 2.0))
    world = make_world(grid=grid, boundaries=AROUND, viscosity=0.002)
    set_velocity(world, pair)
    before = kinetic_energy(world)
    advance(world, 0.02, 350)
    title = "energy of a vortex pair left in a box that it has left, over that at the start"
    return near(title, kinetic_energy(world) / before, 0.0, absolute=0.01)


def in_a_sea(quick: bool) -> list[Finding]:
    """I12; unless quick, with the sphere in a stream."""
    found = [*falling(), leaving_pair()]
    return found if quick else [*found, *spheres()]


CASES = (Case("I12", in_a_sea),)
