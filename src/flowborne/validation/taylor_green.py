"""Vortices that break up into ever smaller ones: F3."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flowborne import Array, Grid, World
from flowborne.boundaries import Boundaries
from flowborne.validation.case import Case, Curve, Finding, GridSeries, Plot, Tier, near
from flowborne.validation.reference import reference
from flowborne.validation.worlds import PERIODIC, whole_steps
from flowborne.worlds import advance, kinetic_energy, make_world, set_velocity

REYNOLDS = 1600.0

SIDE = 2.0 * np.pi
"""m, of the box."""

GRIDS = {True: (32, 64), False: (32, 64, 128)}
"""Cells a side, by quick."""

DURATION = 20.0
"""s."""

CFL = 0.5
"""Cells that the fastest fluid crosses in a step."""

ENERGY, DISSIPATION = 0.125, 2.0 / REYNOLDS * 0.375
"""E in m^2/s^2 and -dE/dt in m^2/s^3 at the start."""


@dataclass(frozen=True)
class Vortices:
    """The flow at the start."""

    def __call__(self, x: Array, y: Array, z: Array) -> tuple[Array, Array, Array]:
        return (
            np.sin(x) * np.cos(y) * np.cos(z),
            -np.cos(x) * np.sin(y) * np.cos(z),
            0.0 * (x + y + z),
        )


def vortices(cells: int) -> World:
    """The periodic box at the start."""
    grid = Grid((cells, cells, cells), SIDE / cells, (0.0, 0.0, 0.0))
    world = make_world(
        grid=grid,
        viscosity=1.0 / REYNOLDS,
        boundaries=Boundaries(PERIODIC, PERIODIC, PERIODIC, PERIODIC, PERIODIC, PERIODIC),
        tolerance=1e-7,
    )
    set_velocity(world, Vortices())
    return world


def decay(cells: int, duration: float) -> tuple[Array, Array, Array]:
    """(n+1,) energy per mass in m^2/s^2 before and after every step, and (n-1,) times in s and
    rates -dE/dt in m^2/s^3 in the middle of each but the first, in which the flow does not know
    its acceleration yet."""
    world = vortices(cells)
    count, dt = whole_steps(duration, CFL * SIDE / cells)
    energies = [kinetic_energy(world) / SIDE**3]
    for _ in range(count):
        advance(world, dt)
        energies.append(kinetic_energy(world) / SIDE**3)
    times = np.linspace(0.5 * dt, duration - 0.5 * dt, count)
    return np.array(energies), times[1:], -np.diff(energies)[1:] / dt


def vortices_break_up(quick: bool) -> list[Finding]:
    """F3: the first instants, the peak of the dissipation and its whole course.

    The list has the course to within 5 % on 256 cells a side; what fails on fewer says how far from
    it they are.
    """
    grids = GRIDS[quick]
    runs = [decay(n, DURATION) for n in grids]
    peaks = [float(rates.max()) for _, _, rates in runs]
    moments = [float(times[rates.argmax()]) for _, times, rates in runs]
    moment, published = np.array(reference("F3", "curve t,-dE/dt (digitised)")).T
    away = [
        float(np.abs(np.interp(moment, times, rates) / published - 1.0).max())
        for _, times, rates in runs
    ]
    curves = [Curve("spectral, 512 cells a side", moment, published, True)]
    curves += [
        Curve(f"{n} cells a side", times[::4], rates[::4])
        for n, (_, times, rates) in zip(grids, runs, strict=True)
    ]
    plot = Plot("t (s)", "-dE/dt (m^2/s^3)", curves)
    label, name, when = "cells a side", "-dE_k/dt peak value", "time of peak"
    peak, time = float(reference("F3", name)), float(reference("F3", when))
    high = GridSeries(label, grids, peaks, [abs(v - peak) for v in peaks])
    late = GridSeries(label, grids, moments, [abs(v - time) for v in moments])
    course = GridSeries(label, grids, away, away)
    early = [float(rates[0]) for _, _, rates in runs]
    begun = GridSeries(label, grids, early, [abs(v - DISSIPATION) for v in early])
    lines = [
        f"{n:>6g} cells a side: the first step loses {1.0 - energies[1] / energies[0]:.2g} of E"
        for n, (energies, _, _) in zip(grids, runs, strict=True)
    ]
    return [
        near("E(0), m^2/s^2", runs[-1][0][0], ENERGY, relative=0.01),
        near(
            "-dE/dt in the second step, m^2/s^3",
            early[-1],
            DISSIPATION,
            relative=0.01,
            series=begun,
            lines=lines,
        ),
        Finding(
            name, peaks[-1], peak, "[0.0125, 0.013]", 0.0125 <= peaks[-1] <= 0.0130, high, plot=plot
        ),
        Finding(when, moments[-1], time, "[8.8, 9.1]", 8.8 <= moments[-1] <= 9.1, late),
        Finding(
            "farthest from the published course, relative",
            away[-1],
            0.0,
            "5 %, falling from grid to grid",
            away[-1] <= 0.05 and course.falls,
            course,
        ),
    ]


CASES = (Case("F3", vortices_break_up, Tier.HALF_HOUR, coarse=True),)
