"""Flow without inertia: C1 to C5."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from flowborne import Grid, World
from flowborne.bodies import Curve, TrajectoryKeyframes
from flowborne.worlds import Boundaries, BoundaryNoSlip, advance, make_world, start
from flowborne_validation.case import reference
from flowborne_validation.findings import Figure, Figures
from flowborne_validation.worlds import PERIODIC, PLANAR, force_on, hold_all, mjcf, recorded

DENSITY = 1000.0
"""kg/m^3 of the fluid."""

RADIUS, HALF, LENGTH, SPEED = 0.05, 0.2, 0.8, 0.1
"""m, of a rod and of the box around it: half its height and half its length; m/s of the rod."""

WALL = BoundaryNoSlip()

CLOSED = Boundaries(WALL, WALL, WALL, WALL)


def faxen(ratio: float) -> float:
    """Drag over mu U of a cylinder half-way between two walls, per length (Faxen 1946).

    ratio  of its radius to its distance from the walls
    """
    k = ratio**2
    rest = 0.9156892732 - 1.7243844 * k + 1.730194 * k**2 - 2.405644 * k**3 + 4.59131 * k**4
    return float(4.0 * np.pi / (-np.log(ratio) - rest))


def rod(cells: int, viscosity: float, density: float, gravity: float = 0.0) -> World:
    """A rod half-way between two walls, which slides along them.

    cells    across it
    density  of the rod, kg/m^3
    """
    h = 2.0 * RADIUS / cells
    slide = '<body><joint name="x" type="slide" axis="1 0 0"/>'
    return make_world(
        mjcf(f'{slide}<geom type="cylinder" size="{RADIUS} 0.5"/></body>'),
        Grid.slab(round(2.0 * LENGTH / h), round(2.0 * HALF / h), h, (-LENGTH, -HALF)),
        gravity=(gravity, 0.0, 0.0),
        solid_density=density,
        density=DENSITY,
        viscosity=viscosity,
        boundaries=CLOSED,
    )


def held_rod(cells: int, reynolds: float, number: float, spread: float) -> Figures:
    """C1: drag of a rod that is driven along at a steady speed, over Faxen's.

    number  nu dt / h^2
    spread  nu t / HALF^2 at which it is measured, but not before the second step
    """
    viscosity = DENSITY * SPEED * 2.0 * RADIUS / reynolds
    nu, h = viscosity / DENSITY, 2.0 * RADIUS / cells
    world, dt = rod(cells, viscosity, DENSITY), number * h**2 / nu
    command = hold_all(1)
    command.set(np.array([0]), SPEED, SPEED)
    world.solid.v[:] = SPEED
    advance(world, dt, 1, command)
    steps = max(1, round(spread * HALF**2 / nu / dt) - 1)
    force = -force_on(advance(world, dt, steps, command))[0]
    exact = faxen(RADIUS / HALF) * viscosity * SPEED
    return {f"drag at Re {reynolds:g}, nu dt/h^2 {number:g}": Figure(force / exact, reference=1.0)}


def sinking_rod(cells: int, number: float) -> Figures:
    """C2: speed of a rod twice as dense as the fluid in its second step, over Faxen's.

    number  nu dt / h^2, for the viscosity of C2's scene and steps of 1/24 s
    """
    h, dt = 2.0 * RADIUS / cells, 1.0 / 24.0
    viscosity = DENSITY * number * h**2 / dt
    world = rod(cells, viscosity, 2.0 * DENSITY, 9.81)
    exact = DENSITY * 9.81 * np.pi * RADIUS**2 / (faxen(RADIUS / HALF) * viscosity)
    found = recorded(world, dt, 5, lambda report: report.velocity[0] / exact)
    name = f"speed at nu dt/h^2 {number:g}, step"
    return {f"{name} {n}": Figure(found[n - 1], reference=1.0) for n in (2, 5)}


LINK, THICK = 0.1, 0.012
"""m, of the scallop's shells: length and radius."""

OPENED = np.radians([-40.0, -100.0, -40.0])
"""Angles of its hinge at OPENING, s."""

OPENING = 0.0, 0.2, 1.0


def scallop_drift(cells: int, steps: int, viscosity: float, cycles: int = 1) -> Figures:
    """C3: how far a scallop gets along its axis in a cycle, which opens fast and closes slowly, in
    mm; without inertia 0, by the theorem of Purcell (1977).

    cells  in 0.45 m
    steps  in 1/50 s
    """
    shell = f'<geom type="capsule" fromto="0 0 0 {LINK} 0 0" size="{THICK}"/>'
    other = f'<body><joint name="hinge" type="hinge" axis="0 0 1"/>{shell}</body>'
    h = 0.45 / cells
    world = make_world(
        mjcf(f"<body>{PLANAR}{shell}{other}</body>"),
        Grid.slab(cells, round(0.4 / h), h, (-0.2, -0.2)),
        solid_density=DENSITY,
        density=DENSITY,
        viscosity=viscosity,
        motions=(TrajectoryKeyframes(np.array([3]), Curve(OPENING, tuple(OPENED))),),
    )
    world.solid.q[2:4] = -0.5 * OPENED[0], OPENED[0]
    before, dt = world.solid.q[:2].copy(), 0.02 / steps
    start(world, dt)
    advance(world, dt, 50 * steps)
    speed = LINK * abs(OPENED[1] - OPENED[0]) / OPENING[1]
    name = f"{steps} steps a frame, Re {DENSITY * speed * LINK / viscosity:.1g}"
    return {name: Figure(1e3 * (world.solid.q[0] - before[0]))}


def sphere_in_array(cells: Sequence[int], part: float) -> Figures:
    """C4: drag of a simple cubic array of spheres without inertia, over Stokes' with the mean
    velocity.

    cells  across the periodic cube
    part   of the volume that the spheres take
    """
    diameter = (6.0 * part / np.pi) ** (1.0 / 3.0)
    found, grids = [array_drag(n, diameter) for n in cells], [n * diameter for n in cells]
    known = reference("C4", "K of a simple cubic array")[f"{part:g}"]
    return {f"drag where spheres are {part:g} of the volume": Figure(found, grids, known)}


def array_drag(cells: int, diameter: float) -> float:
    """K = f L^3 / (3 pi mu d U) for a body force f on the fluid and its mean velocity U in a cube
    of edge L = 1."""
    viscosity, push = 1.0, 0.01
    ball = f'<body pos="0.5 0.5 0.5"><geom type="sphere" size="{0.5 * diameter}"/></body>'
    world = make_world(
        mjcf(ball),
        Grid((cells,) * 3, 1.0 / cells, (0.0, 0.0, 0.0)),
        viscosity=viscosity,
        body_force=(push, 0.0, 0.0),
        boundaries=Boundaries(*(PERIODIC,) * 6),
    )
    advance(world, 10.0, 3)
    through = world.flow()[1].velocity[0][0].mean()  # of a plane that the sphere does not reach
    return float(push / (3.0 * np.pi * viscosity * diameter * through))


CYCLE = np.radians([[-45, 45, 45, -45, -45], [-45, -45, 45, 45, -45]])
"""Angles of Purcell's swimmer at its left and its right hinge, in quarters of a cycle."""

AHEAD = 0.46
"""rad, of its middle link at the start, by which it gets along x."""

BASIN = 4.0, 3.0, 1.0
"""m, sides of the closed box in the middle of which it starts; its walls slip."""


def three_links(cells: int) -> World:
    """Purcell's swimmer, whose hinges go through their cycle in 1 s. Its links are 1 m long between
    the hinges, four times their diameter; Re is 0.1 at most.

    cells  across a link
    """
    h, (x, y, z) = 0.25 / cells, BASIN
    middle = f'<body>{PLANAR}<geom type="capsule" fromto="-0.5 0 0 0.5 0 0" size="0.125"/>'
    for side in (-1, 1):
        rod = f'<geom type="capsule" fromto="0 0 0 {side} 0 0" size="0.125"/>'
        middle += f'<body pos="{0.5 * side} 0 0"><joint type="hinge" axis="0 0 1"/>{rod}</body>'
    motions = [Curve((0.0, 0.25, 0.5, 0.75, 1.0), tuple(angles)) for angles in CYCLE]
    world = make_world(
        mjcf(f"{middle}</body>"),
        Grid((round(x / h), round(y / h), round(z / h)), h, (-0.5 * x, -0.5 * y, -0.5 * z)),
        solid_density=DENSITY,
        density=DENSITY,
        viscosity=1e5,
        motions=tuple(TrajectoryKeyframes(np.array([3 + n]), m) for n, m in enumerate(motions)),
    )
    world.solid.q[2:] = AHEAD, *CYCLE[:, 0]
    return world


def purcell_swimmer(cells: int, steps: int) -> Figures:
    """C5: displacement of Purcell's swimmer in a cycle, over the length of a link.

    cells  across a link
    steps  in a cycle
    """
    world, dt = three_links(cells), 1.0 / steps
    start(world, dt)
    advance(world, dt, steps)
    way = float(np.hypot(*world.solid.q[:2]))
    line = f"turned by {np.degrees(world.solid.q[2] - AHEAD):.2f} degrees in a cycle"
    return {"displacement per cycle": Figure(way, lines=[line])}
