"""Bodies that settle in closed boxes: V1, a cylinder, and V2, the sphere of ten Cate's experiments.

V1 is in centimetres, grams and seconds, V2 in SI units.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from flowborne import Array, Grid, World
from flowborne.bodies import WindForce
from flowborne.worlds import Boundaries, BoundaryClosed, BoundaryNoSlip, make_world
from flowborne_validation.case import reference
from flowborne_validation.findings import Curve, Figure, Figures, Plot
from flowborne_validation.worlds import PLANAR, history, mjcf, recorded, whole_steps

CFL = 1.0
"""Cells that a body falls in a step at most. A step eight times shorter changes the largest
velocity of V2's E1 by 0.3 %."""

CYLINDER, CYLINDER_GRAVITY = 0.25, 980.0
"""Diameter in cm and cm/s^2, of V1."""


def box(cells: int, density: float, viscosity: float) -> World:
    """The box of 2 by 6 cm, `cells` across the cylinder, which is free in the plane.

    density    g/cm^3, of the cylinder; the fluid's is 1
    viscosity  g/(cm s)
    """
    h = CYLINDER / cells
    wall = BoundaryNoSlip()
    disc = (
        f'<body name="disc" pos="1 4 0">{PLANAR}'
        f'<geom type="cylinder" size="{0.5 * CYLINDER} 1"/></body>'
    )
    return make_world(
        mjcf(disc),
        Grid.slab(8 * cells, 24 * cells, h, (0.0, 0.0)),
        gravity=(0.0, -CYLINDER_GRAVITY, 0.0),
        solid_density=density,
        viscosity=viscosity,
        boundaries=Boundaries(wall, wall, wall, wall),
    )


def fastest(
    cells: int, density: float, viscosity: float, reynolds: float, duration: float
) -> tuple[float, Array]:
    """Largest Reynolds number, and (n, 2) times in s and Reynolds numbers of all steps.

    reynolds  the largest one expected; `duration` s later the cylinder nears the bottom
    """
    world = box(cells, density, viscosity)
    unit = density * CYLINDER / viscosity
    count, dt = whole_steps(duration, CFL * CYLINDER / cells * unit / reynolds)
    course = recorded(world, dt, count, lambda _: (world.time, -unit * world.solid.v[1]))
    return float(course[:, 1].max()), course


def settling_cylinder(
    cells: int, name: str, density: float, viscosity: float, duration: float
) -> Figures:
    """V1: the largest Reynolds number of the light and slow or of the heavy and fast cylinder."""
    reynolds = float(reference("V1", f"{name} max Re"))
    found, _ = fastest(cells, density, viscosity, reynolds, duration)
    return {f"{name}, largest Re": Figure(found, reference=reynolds)}


DIAMETER, DENSITY, GRAVITY = 0.015, 1120.0, 9.81
HALF, HEIGHT, START = 0.05, 0.16, 0.1275
"""m and kg/m^3 of V2's sphere, m/s^2; half the width of its box, the height of that, and the height
from which its centre falls, m."""


def quarter(cells: int, density: float, viscosity: float) -> World:
    """A quarter of the box, `cells` in 10 mm, between two planes about which the flow is symmetric.
    A quarter of the sphere's weight less its buoyancy pulls at a quarter of its mass. The whole box
    gives the same velocities to 5e-7 m/s with 4 cells in 10 mm.

    density, viscosity  of the oil, kg/m^3 and Pa s
    """
    h = 0.01 / cells
    counts = [round(side / h) for side in (HALF, HALF, HEIGHT)]
    grid = Grid((counts[0], counts[1], counts[2]), h, (0.0, 0.0, 0.0))
    plane, wall = BoundaryClosed(), BoundaryNoSlip()
    ball = (
        f'<body name="ball" pos="0 0 {START}"><joint name="fall" type="slide" axis="0 0 1"/>'
        f'<geom type="sphere" size="{0.5 * DIAMETER}"/></body>'
    )
    volume = 0.25 * np.pi / 6.0 * DIAMETER**3
    pull = WindForce((0.0, 0.0, -(DENSITY - density) * volume * GRAVITY), ("ball",))
    return make_world(
        mjcf(ball),
        grid,
        solid_density=0.25 * DENSITY,
        density=density,
        viscosity=viscosity,
        boundaries=Boundaries(plane, wall, plane, wall, wall, wall),
        winds=(pull,),
    )


def fall(world: World, cells: int, peak: float, until: float) -> tuple[Array, Array, Array]:
    """Times in s, downward velocities in m/s and heights of the centre in m of every step.

    peak  largest velocity expected, m/s
    """
    steps, dt = whole_steps(until, CFL * 0.01 / cells / peak)
    times, velocities, heights = history(
        world, dt, steps, lambda: (world.time, -world.solid.v[0], START + world.solid.q[0])
    ).T
    return times, velocities, heights


def settling(
    cells: Sequence[int], part: float, name: str, density: float, viscosity: float
) -> Figures:
    """V2: the largest velocity, and the curve from release to the bottom, or a part of it, of one
    of the experiments.

    cells  in 10 mm
    """
    times, velocities = np.array(reference("V2", "experimental t[s],u[m/s]")[name]).T
    share, unbounded = (
        reference("V2", key)[name] for key in ("max measured / u_inf", "u_inf (unbounded) m/s")
    )
    peak, until = float(share * unbounded), part * times[-1]
    times, measured = times[times <= until], -velocities[times <= until]
    falls = [fall(quarter(n, density, viscosity), n, peak, until) for n in cells]
    away, lines = zip(*(apart(one, times, measured, peak) for one in falls), strict=True)
    moments, velocity, _ = falls[-1]
    thin = slice(None, None, max(1, len(moments) // 200))
    curves = (
        Curve("measured", times, measured, True),
        Curve("flowborne", moments[thin], velocity[thin]),
    )
    plot = Plot("t (s)", "downward velocity (m/s)", curves)
    grids = [100.0 * DIAMETER * n for n in cells]
    title = f"{name}, farthest from the measured curve over its largest velocity"
    return {
        f"{name}, largest velocity, m/s": Figure([v.max() for _, v, _ in falls], grids, peak),
        title: Figure(away, grids, lines=lines[-1], plot=plot),
    }


def apart(
    fallen: tuple[Array, Array, Array], times: Array, measured: Array, peak: float
) -> tuple[float, list[str]]:
    """Largest distance from a measured curve over `peak`, and lines with its time, on the whole way
    and on the part before the bottom affects the sphere."""
    moments, velocity, height = fallen
    away = np.abs(np.interp(times, moments, velocity) - measured) / peak
    bottom = START - 0.9 * (START - 0.5 * DIAMETER)
    high = np.interp(times, moments, height) > bottom
    lines = [
        f"{label}: {away[part].max():.3g} at {times[part][away[part].argmax()]:.3g} s, "
        f"{np.sqrt(np.mean(away[part] ** 2)):.3g} in the mean"
        for label, part in (("all the way", high | True), ("first nine tenths of the way", high))
    ]
    return float(away.max()), lines
