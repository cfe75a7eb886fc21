"""A cylinder that swings to and fro in still fluid: V3."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from flowborne import Array, Grid, World
from flowborne.motions import TrajectorySinusoid
from flowborne.validation.case import Case, Curve, Finding, Plot, Tier, at_most, near
from flowborne.validation.fixed_sphere import series_of
from flowborne.validation.reference import confirmed, reference
from flowborne.validation.worlds import mjcf
from flowborne.worlds import advance, make_world

PERIOD, KC, REYNOLDS = 5.0, 5.0, 100.0
"""s, and Keulegan and Carpenter's number Umax T / D; D = 1 m, Umax = 1 m/s."""

SIDE = 20
"""Diameters across the closed box."""

GRIDS = {True: (6, 8), False: (8, 16, 32)}
"""Cells across D, by quick."""

CYCLES = {True: 3, False: 7}
"""Of which the last is looked at, by quick."""

CFL = 0.5
"""Cells that the cylinder crosses in a step at most."""

CURVE = "C_D(t/T)=F/(0.5 rho Umax^2 D) digitised"


def tank(cells: int) -> World:
    """The cylinder in the middle of its swing, on its way to -x."""
    body = (
        '<body name="cylinder"><joint name="swing" type="slide" axis="1 0 0"/>'
        '<geom type="cylinder" size="0.5 1"/></body>'
    )
    half = 0.5 * SIDE
    return make_world(
        mjcf(body),
        Grid.slab(SIDE * cells, SIDE * cells, 1.0 / cells, (-half, -half)),
        viscosity=1.0 / REYNOLDS,
        motions=(TrajectorySinusoid(np.array([0]), -KC / (2.0 * np.pi), PERIOD),),
        tolerance=1e-7,
    )


def last_cycle(cells: int, cycles: int) -> tuple[Array, Array]:
    """(n,) t/T in the middle of the steps of the last cycle, and in-line force coefficients."""
    world = tank(cells)
    count = int(np.ceil(PERIOD * cells / CFL))
    dt = PERIOD / count
    advance(world, dt, (cycles - 1) * count)
    forces = []
    for _ in range(count):
        report = advance(world, dt)
        forces.append(2.0 * float((report.pressure_wrench + report.viscous_wrench)[1, 0]))
    return (np.arange(count) + 0.5) / count, np.array(forces)


def morison(phases: Array, forces: Array) -> tuple[float, float]:
    """C_d and C_i of Morison's formula F = -rho D C_d |v| v / 2 - rho pi D^2 C_i v' / 4, by least
    squares."""
    angle = 2.0 * np.pi * phases
    v, rate = -np.cos(angle), 2.0 * np.pi / PERIOD * np.sin(angle)
    terms = np.column_stack([-np.abs(v) * v, -0.5 * np.pi * rate])
    drag, inertia = np.linalg.lstsq(terms, forces, rcond=None)[0]
    return float(drag), float(inertia)


def swinging(quick: bool) -> list[Finding]:
    """V3: the in-line force in a cycle, and Morison's coefficients of it."""
    grids = GRIDS[quick]
    runs = [last_cycle(n, CYCLES[quick]) for n in grids]
    phase, published = np.array(reference("V3", CURVE)).T
    largest = float(np.abs(published).max())
    peaks = [float(np.abs(forces).max()) for _, forces in runs]
    away = [
        float(np.abs(np.interp(phase, phases, forces, period=1.0) - published).max())
        for phases, forces in runs
    ]
    drags, inertias = zip(*(morison(*run) for run in runs), strict=True)
    curves = (Curve("Duetsch et al.", phase, published, True), Curve("flowborne", *runs[-1]))
    plot = Plot("t/T", "in-line force coefficient", curves)
    peak = near(
        "largest coefficient",
        peaks[-1],
        largest,
        relative=0.03,
        series=series_of(grids, peaks, largest),
    )
    course = at_most(
        "farthest from the measured curve", away[-1], 0.15, series=series_of(grids, away, 0.0)
    )
    known = dict(part.split("=") for part in reference("V3", "Morison fit").split(", "))
    sure = confirmed("V3", "Morison fit")
    fit = [
        replace(morison_finding(name, grids, values, float(known[name])), confirmed=sure)
        for name, values in (("C_d", drags), ("C_i", inertias))
    ]
    return [peak, replace(course, plot=plot), *fit]


def morison_finding(
    name: str, grids: Sequence[int], values: Sequence[float], exact: float
) -> Finding:
    """One of Morison's coefficients from grid to grid."""
    series = series_of(grids, values, exact)
    return near(f"Morison's {name}", values[-1], exact, relative=0.03, series=series)


CASES = (Case("V3", swinging, Tier.HALF_HOUR, coarse=True),)
