"""Flows without obstacles: F1, F3 and F7, and F6 with a body that moves with the stream."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from flowborne import Array, Grid, World
from flowborne.bodies import Trajectory, TrajectoryConstant
from flowborne.worlds import Boundaries, advance, kinetic_energy, make_world, set_velocity
from flowborne_validation.case import reference
from flowborne_validation.findings import Curve, Figure, Figures, Plot
from flowborne_validation.worlds import (
    PERIODIC,
    PLANAR,
    RING,
    Uniform,
    all_inflow,
    components,
    history,
    mjcf,
    square,
    whole_steps,
)

QUARTER = 0.5 * np.pi
"""s in which a mean flow of 1 m/s moves the pattern by a quarter of the box, whole cells on every
grid."""


def taylor_green(cells: int, viscosity: float, mean: float) -> tuple[float, float]:
    """Energy and largest velocity of the pattern after QUARTER, over their first values."""

    def vortices(x: Array, y: Array, z: Array) -> tuple[Array, Array, Array]:
        u, v = np.sin(x) * np.cos(y) + mean, -np.cos(x) * np.sin(y) + mean
        return components(x, y, z, u, v)

    grid = Grid.slab(cells, cells, 2.0 * np.pi / cells, (0.0, 0.0))
    world = make_world(grid=grid, viscosity=viscosity, boundaries=RING, tolerance=1e-11)
    set_velocity(world, vortices)
    energy, fastest = pattern(world, mean)
    count, dt = whole_steps(QUARTER, 0.5 * grid.spacing / (1.0 + mean))
    advance(world, dt, count)
    energy_after, fastest_after = pattern(world, mean)
    return energy_after / energy, fastest_after / fastest


def pattern(world: World, mean: float) -> tuple[float, float]:
    """Energy and largest velocity without the mean flow."""
    _, state = world.flow()
    u, v = state.velocity[0][:-1] - mean, state.velocity[1][:, :-1] - mean
    return float((u**2).sum() + (v**2).sum()), float(max(np.abs(u).max(), np.abs(v).max()))


def vortex_decay(cells: int) -> Figures:
    """F1: energy and largest velocity, with and without viscosity and mean advection."""
    found = {}
    for mean in (0.0, 1.0):
        for nu in (0.01, 0.0):
            rows = zip(("E(t)/E(0)", "max|u|(t)"), (4.0, 2.0), strict=True)
            for (name, rate), value in zip(rows, taylor_green(cells, nu, mean), strict=True):
                title = f"order of {name}, nu = {nu:g}, mean flow ({mean:g}, {mean:g})"
                found[title] = Figure(value, reference=float(np.exp(-rate * nu * QUARTER)))
    return found


REYNOLDS = 1600.0

SIDE = 2.0 * np.pi
"""m, of F3's box."""

ENERGY, DISSIPATION = 0.125, 2.0 / REYNOLDS * 0.375
"""E in m^2/s^2 and -dE/dt in m^2/s^3 at the start."""


def decay(cells: int, duration: float) -> tuple[Array, Array, Array]:
    """Decay over `duration` s of F3's vortices in a periodic box.

    returns  (n+1,) energy per mass at the ends of all steps, m^2/s^2; (n-1,) times, s, and rates
             -dE/dt, m^2/s^3, in the middle of all steps but the first, which has no earlier
             acceleration
    """

    def vortices(x: Array, y: Array, z: Array) -> tuple[Array, Array, Array]:
        u, v = np.sin(x) * np.cos(y) * np.cos(z), -np.cos(x) * np.sin(y) * np.cos(z)
        return components(x, y, z, u, v)

    grid = Grid((cells, cells, cells), SIDE / cells, (0.0, 0.0, 0.0))
    world = make_world(
        grid=grid, viscosity=1.0 / REYNOLDS, boundaries=Boundaries(*(PERIODIC,) * 6), tolerance=1e-7
    )
    set_velocity(world, vortices)
    # in a step the fastest fluid crosses half a cell
    count, dt = whole_steps(duration, 0.5 * SIDE / cells)
    energies = history(world, dt, count, lambda: kinetic_energy(world) / SIDE**3)
    times = np.linspace(0.5 * dt, duration - 0.5 * dt, count)
    return energies, times[1:], -np.diff(energies)[1:] / dt


def vortices_break_up(grids: Sequence[int]) -> Figures:
    """F3: the first steps, the peak of the dissipation and its whole course. The list has the
    course to within 5 % on 256 cells a side; coarser grids fail by their distance from it."""
    runs = [decay(n, 20.0) for n in grids]
    moment, published = np.array(reference("F3", "curve t,-dE/dt (digitised)")).T
    away = [
        np.abs(np.interp(moment, times, rates) / published - 1.0).max() for _, times, rates in runs
    ]
    curves = [Curve("spectral, 512 cells a side", moment, published, True)]
    curves += [
        Curve(f"{n} cells a side", times[::4], rates[::4])
        for n, (_, times, rates) in zip(grids, runs, strict=True)
    ]
    lines = [
        f"{n:>6g} cells a side: the first step loses {1.0 - energies[1] / energies[0]:.2g} of E"
        for n, (energies, _, _) in zip(grids, runs, strict=True)
    ]
    early = [rates[0] for _, _, rates in runs]
    peaks = [rates.max() for _, _, rates in runs]
    plot = Plot("t (s)", "-dE/dt (m^2/s^3)", curves)
    return {
        "E(0), m^2/s^2": Figure(runs[-1][0][0], reference=ENERGY),
        "-dE/dt in the second step, m^2/s^3": Figure(early, grids, DISSIPATION, lines=lines),
        "-dE_k/dt peak value": Figure(peaks, grids, plot=plot),
        "time of peak": Figure([times[rates.argmax()] for _, times, rates in runs], grids),
        "farthest from the published course, relative": Figure(away, grids),
    }


STREAM, DIAMETER = 0.912, 0.753
"""m/s and m, of F6."""


def carried_body(driven: bool, steps: int, pace: float = 1.0) -> tuple[float, float]:
    """Largest departure of fluid and body from the stream, over the stream's velocity.

    The box of 32 x 32 cells has a side of 4 m; the body moves with the stream for `steps` steps,
    by a prescribed motion or free and as heavy as the fluid.

    pace  the body's velocity over the stream's; any other than 1 is a disturbance
    """
    grid = square(32, 4.0)
    body = (
        f'<body name="disc" pos="-0.9 0.031 0">{PLANAR}'
        f'<geom type="sphere" size="{0.5 * DIAMETER}" density="1"/></body>'
    )
    motions: tuple[Trajectory, ...] = ()
    if driven:
        motions = (
            TrajectoryConstant(np.array([0]), 0.0, pace * STREAM),
            TrajectoryConstant(np.array([1]), 0.0),
            TrajectoryConstant(np.array([2]), 0.0),
        )
    stream = Uniform((STREAM, 0.0, 0.0))
    world = make_world(
        mjcf(body), grid, boundaries=all_inflow(stream), tolerance=1e-13, motions=motions
    )
    set_velocity(world, stream)
    world.solid.v[0] = pace * STREAM
    advance(world, 0.25 * grid.spacing / STREAM, steps)
    _, state = world.flow()
    wrong = max(np.abs(state.velocity[0] - STREAM).max(), np.abs(state.velocity[1]).max())
    slip = np.abs(world.solid.v - np.array([STREAM, 0.0, 0.0])).max()
    return float(wrong / STREAM), float(slip / STREAM)


def free_stream(steps: int) -> Figures:
    """F6: a body that moves with the stream does not disturb it."""
    driven, _ = carried_body(True, steps)
    free, slip = carried_body(False, steps)
    title = "max|u - u0|/u0, body"
    return {
        f"{title} told to go with the stream": driven,
        f"{title} free and neutral": free,
        "slip of the free body / u0": slip,
    }


RE = 40.0
DECAY = 0.5 * RE - float(np.sqrt(0.25 * RE**2 + 4.0 * np.pi**2))
"""lambda of Kovasznay's flow, 1/m."""


def kovasznay_flow(x: Array, y: Array, z: Array, time: float = 0.0) -> tuple[Array, Array, Array]:
    """The exact flow behind a row of cylinders at Re 40, as a profile and as a field."""
    wake = np.exp(DECAY * x)
    u = 1.0 - wake * np.cos(2.0 * np.pi * y)
    v = DECAY / (2.0 * np.pi) * wake * np.sin(2.0 * np.pi * y)
    return components(x, y, z, u, v)


def kovasznay(cells: int, duration: float) -> Figures:
    """F7: root of the mean square error of the velocity, in m/s, after `duration` s from the exact
    flow, with `cells` per m and the exact velocity on all sides."""
    grid = Grid.slab(3 * cells // 2, 2 * cells, 1.0 / cells, (-0.5, -0.5))
    sides = all_inflow(kovasznay_flow)
    world = make_world(grid=grid, viscosity=1.0 / RE, boundaries=sides, tolerance=1e-10)
    set_velocity(world, kovasznay_flow)
    count, dt = whole_steps(duration, 0.25 * grid.spacing)
    advance(world, dt, count)
    _, state = world.flow()
    squares, number = 0.0, 0
    for axis in grid.axes:
        x, y, z = np.meshgrid(*grid.face_coordinates(axis), indexing="ij")
        squares += float(((state.velocity[axis] - kovasznay_flow(x, y, z)[axis]) ** 2).sum())
        number += x.size
    return {"order of the velocity's L2 error": float(np.sqrt(squares / number))}
