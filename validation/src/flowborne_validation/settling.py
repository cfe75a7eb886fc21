"""Bodies that settle in closed boxes: V1, a cylinder, and V2, the sphere of ten Cate's experiments.

V1 is in centimetres, grams and seconds, V2 in SI units.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flowborne import Array, Grid, World
from flowborne.bodies import WindForce
from flowborne.worlds import Boundaries, BoundaryClosed, BoundaryNoSlip, make_world
from flowborne_validation.case import Case, confirmed, reference
from flowborne_validation.findings import (
    Curve,
    Details,
    Finding,
    Grids,
    GridSeries,
    Plot,
    at_most,
    falling,
    near,
    within,
)
from flowborne_validation.worlds import PLANAR, history, mjcf, recorded, whole_steps

CFL = 1.0
"""Cells that a body falls in a step at most. A step eight times shorter changes the largest
velocity of V2's E1 by 0.3 %."""

CYLINDER, CYLINDER_GRAVITY = 0.25, 980.0
"""Diameter in cm and cm/s^2, of V1."""


@dataclass(frozen=True)
class Fall:
    """One of V1's two cases.

    name       in the list
    density    g/cm^3, of the cylinder; the fluid's is 1
    viscosity  g/(cm s)
    low, high  range of the published largest Reynolds numbers
    duration   s, until the cylinder nears the bottom
    """

    name: str
    density: float
    viscosity: float
    low: float
    high: float
    duration: float

    @property
    def reynolds(self) -> float:
        """The largest Reynolds number in the list."""
        return float(reference("V1", f"{self.name} max Re"))

    @property
    def unit(self) -> float:
        """Re over the velocity in cm/s: rho_s d / mu."""
        return self.density * CYLINDER / self.viscosity


FALLS = (Fall("case 1", 1.25, 0.1, 17.2, 17.5, 0.6), Fall("case 2", 1.5, 0.01, 438.0, 503.0, 0.3))


def box(fall: Fall, cells: int) -> World:
    """The box of 2 by 6 cm, `cells` across the cylinder, which is free in the plane."""
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
        solid_density=fall.density,
        viscosity=fall.viscosity,
        boundaries=Boundaries(wall, wall, wall, wall),
    )


def fastest(fall: Fall, cells: int) -> tuple[float, Array]:
    """Largest Reynolds number, and (n, 2) times in s and Reynolds numbers of all steps."""
    world = box(fall, cells)
    count, dt = whole_steps(fall.duration, CFL * CYLINDER / cells * fall.unit / fall.reynolds)
    course = recorded(world, dt, count, lambda _: (world.time, -fall.unit * world.solid.v[1]))
    return float(course[:, 1].max()), course


def settling_cylinder(quick: bool) -> list[Finding]:
    """V1: the largest Reynolds number of the light and slow and of the heavy and fast cylinder."""
    findings = []
    grids = Grids("cells across D", (4, 6) if quick else (8, 16, 32))
    for fall in FALLS:
        values = [fastest(fall, n)[0] for n in grids.cells]
        title, interval = f"{fall.name}, largest Re", (fall.low, fall.high)
        sure = confirmed("V1", f"{fall.name} max Re")
        findings.append(within(title, values, fall.reynolds, interval, grids, confirmed=sure))
    return findings


DIAMETER, DENSITY, GRAVITY = 0.015, 1120.0, 9.81
HALF, HEIGHT, START = 0.05, 0.16, 0.1275
"""m and kg/m^3 of V2's sphere, m/s^2; half the width of its box, the height of that, and the height
from which its centre falls, m."""


@dataclass(frozen=True)
class Oil:
    """One of V2's experiments.

    density, viscosity  kg/m^3, Pa s
    """

    name: str
    density: float
    viscosity: float

    @property
    def peak(self) -> float:
        """Largest velocity measured, m/s."""
        share = reference("V2", "max measured / u_inf")[self.name]
        return float(share * reference("V2", "u_inf (unbounded) m/s")[self.name])

    @property
    def curve(self) -> tuple[Array, Array]:
        """Times in s and downward velocities in m/s that were measured."""
        times, velocities = np.array(reference("V2", "experimental t[s],u[m/s]")[self.name]).T
        return times, -velocities


OILS = (Oil("E1", 970.0, 0.373), Oil("E3", 962.0, 0.113))


def quarter(oil: Oil, cells: int) -> World:
    """A quarter of the box, `cells` in 10 mm, between two planes about which the flow is symmetric.
    A quarter of the sphere's weight less its buoyancy pulls at a quarter of its mass. The whole box
    gives the same velocities to 5e-7 m/s with 4 cells in 10 mm."""
    h = 0.01 / cells
    counts = [round(side / h) for side in (HALF, HALF, HEIGHT)]
    grid = Grid((counts[0], counts[1], counts[2]), h, (0.0, 0.0, 0.0))
    plane, wall = BoundaryClosed(), BoundaryNoSlip()
    ball = (
        f'<body name="ball" pos="0 0 {START}"><joint name="fall" type="slide" axis="0 0 1"/>'
        f'<geom type="sphere" size="{0.5 * DIAMETER}"/></body>'
    )
    volume = 0.25 * np.pi / 6.0 * DIAMETER**3
    pull = WindForce((0.0, 0.0, -(DENSITY - oil.density) * volume * GRAVITY), ("ball",))
    return make_world(
        mjcf(ball),
        grid,
        solid_density=0.25 * DENSITY,
        density=oil.density,
        viscosity=oil.viscosity,
        boundaries=Boundaries(plane, wall, plane, wall, wall, wall),
        winds=(pull,),
    )


def fall(oil: Oil, cells: int, until: float) -> tuple[Array, Array, Array]:
    """Times in s, downward velocities in m/s and heights of the centre in m of every step."""
    world = quarter(oil, cells)
    steps, dt = whole_steps(until, CFL * 0.01 / cells / oil.peak)
    times, velocities, heights = history(
        world, dt, steps, lambda: (world.time, -world.solid.v[0], START + world.solid.q[0])
    ).T
    return times, velocities, heights


def settling(quick: bool) -> list[Finding]:
    """V2: the largest velocity, and the whole curve from release to the bottom."""
    findings = []
    cells = (3, 4) if quick else (4, 6, 8, 10)
    grids = Grids("cells across the sphere", [100.0 * DIAMETER * n for n in cells])
    for oil in OILS:
        times, measured = oil.curve
        until = 0.4 * times[-1] if quick else times[-1]
        times, measured = times[times <= until], measured[times <= until]
        falls = [fall(oil, n, until) for n in cells]
        peaks = [velocity.max() for _, velocity, _ in falls]
        series = GridSeries.toward(grids, peaks, oil.peak, relative=True)
        title = f"{oil.name}, largest velocity, m/s"
        findings.append(falling(near(title, series, oil.peak, relative=0.03)))
        found = [apart(one, times, measured, oil.peak) for one in falls]
        title = f"{oil.name}, farthest from the measured curve over its largest velocity"
        moments, velocity, _ = falls[-1]
        thin = slice(None, None, max(1, len(moments) // 200))
        curves = (
            Curve("measured", times, measured, True),
            Curve("flowborne", moments[thin], velocity[thin]),
        )
        details = Details(lines=found[-1][1], plot=Plot("t (s)", "downward velocity (m/s)", curves))
        findings.append(at_most(title, [away for away, _ in found], 0.05, grids, **details))
    return findings


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


CASES = (Case("V1", settling_cylinder, coarse=True), Case("V2", settling, coarse=True))
