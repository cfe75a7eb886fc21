"""Viscous flow between coaxial cylinders: V8."""

from __future__ import annotations

import numpy as np

from flowborne import Grid, World
from flowborne.bodies import Trajectory, TrajectoryConstant
from flowborne.validation.case import Case
from flowborne.validation.findings import Finding, Grids, near
from flowborne.validation.worlds import force_on, mjcf, ring_of_boxes
from flowborne.worlds import advance, make_world

INNER, OUTER = 0.5, 1.0
"""Radii a and b, m."""

SPIN = 1.0
"""Omega, rad/s."""

SIDES = 48
"""Boxes that make the outer cylinder."""

SHELL = 0.1
"""Half the thickness of the outer cylinder, m; the grids end inside it."""

VISCOSITY = 1.0
"""Pa s; the fluid's density is 1 kg/m^3."""

SETTLING = 1.0
"""s after which the flow is steady: 40 times (b - a)^2 / (pi^2 nu)."""

HEAVY = 1000.0
"""kg/m^3, of the inner cylinder: its flow stays quasi-steady as it slows down."""

PART = 0.2
"""Simulated part of the time constant of the spin-down."""


TORQUE = 4.0 * np.pi * VISCOSITY * INNER**2 * OUTER**2 / (OUTER**2 - INNER**2)
"""N m per m on the inner cylinder at 1 rad/s."""

RATE = TORQUE / (0.5 * HEAVY * np.pi * INNER**4)
"""1/s, of the spin-down."""


def annulus(cells: int, free: bool) -> World:
    """The inner cylinder in the outer one, with the prescribed SPIN or free.

    The outer cylinder is a ring of boxes whose inner sides make a regular polygon; its mean radius
    is that of the cylinder.
    """
    h = OUTER / cells
    side = cells + 2
    grid = Grid.slab(2 * side, 2 * side, h, (-side * h, -side * h))
    half = np.pi / SIDES
    # the mean of apothem / cos(t) over half a side is the radius
    apothem = OUTER * half / np.log(1.0 / np.cos(half) + np.tan(half))
    reach = apothem + SHELL
    ring = ring_of_boxes(SIDES, reach, f"{SHELL} {1.05 * half * (reach + SHELL)} 1")
    shaft = (
        '<body name="shaft"><joint name="turn" type="hinge" axis="0 0 1"/>'
        f'<geom type="cylinder" size="{INNER} 1" density="{HEAVY}"/></body>'
    )
    motions: tuple[Trajectory, ...] = ()
    if not free:
        motions = (TrajectoryConstant(np.array([0]), 0.0, SPIN),)
    return make_world(mjcf(ring, shaft), grid, viscosity=VISCOSITY, motions=motions)


def measured(cells: int) -> tuple[float, float]:
    """Torque on the inner cylinder in the steady flow, and the rate of its spin-down from there,
    both over the exact ones."""
    dt = OUTER / cells / (SPIN * INNER)
    driven = annulus(cells, free=False)
    report = advance(driven, dt, int(SETTLING / dt))
    torque = force_on(report, -1)[5]
    freed = annulus(cells, free=True)
    freed.fluid = driven.fluid
    freed.solid.v[0] = SPIN
    steps = int(PART / RATE / dt)
    advance(freed, dt, steps)
    rate = np.log(SPIN / freed.solid.v[0]) / (steps * dt)
    return float(-torque / (SPIN * TORQUE)), float(rate / RATE)


def between_cylinders(quick: bool) -> list[Finding]:
    """V8: torque of the steady flow, and the spin-down of the free inner cylinder.

    The list's unbounded cylinder is the limit of the same formula for large b.
    """
    grids = Grids("cells across b", (16, 24) if quick else (16, 32, 64, 128))
    torques, rates = zip(*(measured(n) for n in grids.cells), strict=True)
    return [
        near("torque / exact, steady", torques, 1.0, grids, relative=0.01),
        near("rate of the spin-down / exact", rates, 1.0, grids, relative=0.02),
    ]


CASES = (Case("V8", between_cylinders),)
