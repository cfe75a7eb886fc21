"""A cylinder that moves: driven in still fluid (V3), on a spring across a stream (V5), turning in
another cylinder (V8)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from flowborne import Array, Grid, World
from flowborne.bodies import Trajectory, TrajectoryConstant, TrajectorySinusoid
from flowborne.worlds import advance, make_world, set_velocity
from flowborne_validation.case import reference
from flowborne_validation.findings import Curve, Figure, Figures, Plot
from flowborne_validation.shedding import CFL, STREAM, UNBOUNDED, Kicked, Oscillation, amplitude
from flowborne_validation.worlds import (
    force_on,
    mjcf,
    recorded,
    ring_of_boxes,
    square,
    through_flow,
)

PERIOD, KC, REYNOLDS = 5.0, 5.0, 100.0
"""V3: s; Keulegan and Carpenter's number Umax T / D and Reynolds number; D = 1 m, Umax = 1 m/s."""

SIDE, CURVE = 20, "C_D(t/T)=F/(0.5 rho Umax^2 D) digitised"
"""Diameters across V3's closed box, and its force in the list."""

SPRING_REYNOLDS, MASS = 150.0, 2.0
"""V5: Re, and the cylinder's mass over rho D^2; D = 1 m, U = 1 m/s."""

LOCKED, UNLOCKED = 5.0, 3.0
"""U / (f_n D) of V5 with the vortices in step with the spring, and out of step; f_n is the
frequency on the spring in vacuum."""


def tank(cells: int) -> World:
    """V3's cylinder in the middle of its swing, moving towards -x."""
    body = (
        '<body name="cylinder"><joint name="swing" type="slide" axis="1 0 0"/>'
        '<geom type="cylinder" size="0.5 1"/></body>'
    )
    return make_world(
        mjcf(body),
        square(SIDE * cells, SIDE),
        viscosity=1.0 / REYNOLDS,
        motions=(TrajectorySinusoid(np.array([0]), -KC / (2.0 * np.pi), PERIOD),),
        tolerance=1e-7,
    )


def last_cycle(cells: int, cycles: int) -> tuple[Array, Array]:
    """(n,) t/T in the middle of each step of the last cycle, and in-line force coefficients."""
    world = tank(cells)
    count = int(np.ceil(PERIOD * cells / 0.5))  # the cylinder crosses half a cell a step
    dt = PERIOD / count
    advance(world, dt, (cycles - 1) * count)
    forces = recorded(world, dt, count, lambda report: 2.0 * force_on(report)[0])
    return (np.arange(count) + 0.5) / count, forces


def morison(phases: Array, forces: Array) -> tuple[float, float]:
    """C_d and C_i of Morison's formula F = -rho D C_d |v| v / 2 - rho pi D^2 C_i v' / 4, by least
    squares."""
    angle = 2.0 * np.pi * phases
    v, rate = -np.cos(angle), 2.0 * np.pi / PERIOD * np.sin(angle)
    terms = np.column_stack([-np.abs(v) * v, -0.5 * np.pi * rate])
    drag, inertia = np.linalg.lstsq(terms, forces, rcond=None)[0]
    return float(drag), float(inertia)


def swinging(grids: Sequence[int], cycles: int) -> Figures:
    """V3: the in-line force in a cycle, and Morison's coefficients of it."""
    runs = [last_cycle(n, cycles) for n in grids]
    phase, published = np.array(reference("V3", CURVE)).T
    away = [
        np.abs(np.interp(phase, phases, forces, period=1.0) - published).max()
        for phases, forces in runs
    ]
    curves = (Curve("Duetsch et al.", phase, published, True), Curve("flowborne", *runs[-1]))
    plot = Plot("t/T", "in-line force coefficient", curves)
    peaks, largest = [np.abs(forces).max() for _, forces in runs], float(np.abs(published).max())
    coefficients = zip(*(morison(*run) for run in runs), strict=True)
    return {
        "largest coefficient": Figure(peaks, grids, largest),
        "farthest from the measured curve": Figure(away, grids, plot=plot),
        **{
            f"Morison's {name}": Figure(values, grids, exact)
            for (name, exact), values in zip(
                reference("V3", "Morison fit").items(), coefficients, strict=True
            )
        },
    }


def sprung(cells: int, speed: float) -> World:
    """V5's cylinder, which moves only across the stream, on its spring without damping.

    cells  across D
    speed  U / (f_n D)
    """
    stiffness = MASS * (2.0 * np.pi / speed) ** 2
    body = (
        f'<body name="cylinder"><joint name="y" type="slide" axis="0 1 0" stiffness="{stiffness}"/>'
        '<geom type="cylinder" size="0.5 1"/></body>'
    )
    return make_world(
        mjcf(body),
        Grid.slab(40 * cells, 40 * cells, 1.0 / cells, (-15.0, -20.0)),
        solid_density=MASS / (0.25 * np.pi),
        viscosity=1.0 / SPRING_REYNOLDS,
        boundaries=through_flow(STREAM),
        tolerance=1e-7,
    )


def vibration(cells: int, speed: float) -> tuple[float, float]:
    """A/D in the last five periods of 120 D/U, and their frequency over that of the spring, from a
    stream with a gust across the cylinder's wake."""
    world = sprung(cells, speed)
    set_velocity(world, Kicked(STREAM, UNBOUNDED, 0.0, 0.0))
    dt = CFL / cells
    path = recorded(world, dt, round(120.0 / dt), lambda _: world.solid.q[0])
    late = path[len(path) // 2 :]
    steps, period = Oscillation(dt, late).last(5)
    return amplitude(late[steps]), speed / period


def vibrating(cells: int, speeds: Sequence[float]) -> Figures:
    """V5: amplitude and frequency in step with the spring, and the amplitude out of step, of some
    U / (f_n D)."""
    found = {speed: vibration(cells, speed) for speed in speeds}
    lines = [
        f"U/(f_n D) = {speed:g}: A/D {size:.3f}, f/f_n {frequency:.3f}"
        for speed, (size, frequency) in found.items()
    ]
    size, frequency = found[LOCKED]
    at = f"at U/(f_n D) = {LOCKED:g}"
    return {
        f"A/D {at}": Figure(size, lines=lines),
        f"f/f_n {at}": frequency,
        f"A/D {at} over that at {UNLOCKED:g}": size / found[UNLOCKED][0],
    }


INNER, OUTER, SPIN = 0.5, 1.0, 1.0
"""V8: radii a and b, m, and Omega, rad/s."""

SIDES, SHELL = 48, 0.1
"""Boxes that make the outer cylinder, and half their thickness, m; the grids end inside them."""

VISCOSITY, HEAVY = 1.0, 1000.0
"""Pa s; kg/m^3 of the inner cylinder, whose flow stays quasi-steady as it slows down."""

TORQUE = 4.0 * np.pi * VISCOSITY * INNER**2 * OUTER**2 / (OUTER**2 - INNER**2)
RATE = TORQUE / (0.5 * HEAVY * np.pi * INNER**4)
"""N m per m on the inner cylinder at 1 rad/s, and 1/s of the spin-down."""


def annulus(cells: int, free: bool) -> World:
    """The inner cylinder in the outer one, with the prescribed SPIN or free. The outer cylinder is
    a ring of boxes whose inner sides make a regular polygon; its mean radius is that of the
    cylinder."""
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


def between_cylinders(cells: int) -> Figures:
    """V8: torque on the inner cylinder in the steady flow, and the rate of its spin-down then,
    both over the exact ones. The list's unbounded cylinder is the limit of the same formula for
    large b."""
    dt = OUTER / cells / (SPIN * INNER)
    driven = annulus(cells, free=False)
    # in 1 s, 40 times (b - a)^2 / (pi^2 nu), the flow becomes steady
    report = advance(driven, dt, int(1.0 / dt))
    torque = force_on(report, -1)[5]
    freed = annulus(cells, free=True)
    freed.fluid = driven.fluid
    freed.solid.v[0] = SPIN
    steps = int(0.2 / RATE / dt)
    advance(freed, dt, steps)
    rate = np.log(SPIN / freed.solid.v[0]) / (steps * dt)
    return {
        "torque / exact, steady": float(-torque / (SPIN * TORQUE)),
        "rate of the spin-down / exact": float(rate / RATE),
    }
