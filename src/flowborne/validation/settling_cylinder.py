"""A cylinder that settles in a closed box: V1."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flowborne import Array, Grid, World
from flowborne.boundaries import Boundaries, BoundaryNoSlip
from flowborne.validation.case import Case, Finding
from flowborne.validation.fixed_sphere import series_of
from flowborne.validation.reference import confirmed, reference
from flowborne.validation.worlds import mjcf, whole_steps
from flowborne.worlds import advance, make_world

DIAMETER, GRAVITY = 0.25, 980.0
"""cm and cm/s^2: this case is in centimetres, grams and seconds."""

GRIDS = {True: (4, 6), False: (8, 16, 32)}
"""Cells across the cylinder, by quick; multiples of 2 fit the box."""

CFL = 1.0
"""Cells that the cylinder falls in a step at most."""


@dataclass(frozen=True)
class Fall:
    """One of the two cases.

    name       in the list
    density    g/cm^3, of the cylinder; the fluid's is 1
    viscosity  g/(cm s)
    low, high  largest Reynolds numbers that others found
    duration   s, until it nears the bottom
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
        return self.density * DIAMETER / self.viscosity


FALLS = (Fall("case 1", 1.25, 0.1, 17.2, 17.5, 0.6), Fall("case 2", 1.5, 0.01, 438.0, 503.0, 0.3))


def box(fall: Fall, cells: int) -> World:
    """The box of 2 by 6 cm, `cells` across the cylinder, which is free in the plane."""
    h = DIAMETER / cells
    wall = BoundaryNoSlip()
    disc = (
        '<body name="disc" pos="1 4 0"><joint name="x" type="slide" axis="1 0 0"/>'
        '<joint name="y" type="slide" axis="0 1 0"/><joint name="turn" axis="0 0 1"/>'
        f'<geom type="cylinder" size="{0.5 * DIAMETER} 1"/></body>'
    )
    return make_world(
        mjcf(disc),
        Grid.slab(8 * cells, 24 * cells, h, (0.0, 0.0)),
        gravity=(0.0, -GRAVITY, 0.0),
        solid_density=fall.density,
        viscosity=fall.viscosity,
        boundaries=Boundaries(wall, wall, wall, wall),
    )


def fastest(fall: Fall, cells: int) -> tuple[float, Array]:
    """Largest Reynolds number, and (n, 2) times in s and Reynolds numbers of all steps."""
    world = box(fall, cells)
    count, dt = whole_steps(fall.duration, CFL * DIAMETER / cells * fall.unit / fall.reynolds)
    rows = []
    for _ in range(count):
        advance(world, dt)
        rows.append((world.time, -fall.unit * float(world.solid.v[1])))
    course = np.array(rows)
    return float(course[:, 1].max()), course


def settling_cylinder(quick: bool) -> list[Finding]:
    """V1: the largest Reynolds number of the light and slow and of the heavy and fast cylinder."""
    findings = []
    for fall in FALLS:
        values = [fastest(fall, n)[0] for n in GRIDS[quick]]
        exact = fall.reynolds
        series = series_of(GRIDS[quick], values, exact)
        low, high = fall.low, fall.high
        findings.append(
            Finding(
                f"{fall.name}, largest Re",
                values[-1],
                exact,
                f"[{low:g}, {high:g}]",
                low <= values[-1] <= high,
                series,
                confirmed=confirmed("V1", f"{fall.name} max Re"),
            )
        )
    return findings


CASES = (Case("V1", settling_cylinder, coarse=True),)
