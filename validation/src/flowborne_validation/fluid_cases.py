"""Flows without obstacles: F1, F3 and F7, and F6 with a body that moves with the stream."""

from __future__ import annotations

import numpy as np

from flowborne import Array, Grid, World
from flowborne.bodies import Trajectory, TrajectoryConstant
from flowborne.worlds import Boundaries, advance, kinetic_energy, make_world, set_velocity
from flowborne_validation.case import Case, Tier, reference
from flowborne_validation.findings import (
    Curve,
    Finding,
    Grids,
    GridSeries,
    Plot,
    at_most,
    falling,
    near,
    order_of,
    within,
)
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


def vortex_decay(quick: bool) -> list[Finding]:
    """F1: energy and largest velocity, with and without viscosity and mean advection."""
    grids = Grids("cells a side", (16, 32, 64) if quick else (32, 64, 128, 256, 512))
    findings = []
    for mean in (0.0, 1.0):
        for nu in (0.01, 0.0):
            energy, fastest = zip(*(taylor_green(n, nu, mean) for n in grids.cells), strict=True)
            for name, rate, values in (("E(t)/E(0)", 4.0, energy), ("max|u|(t)", 2.0, fastest)):
                series = GridSeries.toward(grids, values, float(np.exp(-rate * nu * QUARTER)))
                title = f"order of {name}, nu = {nu:g}, mean flow ({mean:g}, {mean:g})"
                findings.append(order_of(title, series, least=1.9))
    return findings


REYNOLDS = 1600.0

SIDE = 2.0 * np.pi
"""m, of F3's box."""

ENERGY, DISSIPATION = 0.125, 2.0 / REYNOLDS * 0.375
"""E in m^2/s^2 and -dE/dt in m^2/s^3 at the start."""


def solid_vortices(x: Array, y: Array, z: Array) -> tuple[Array, Array, Array]:
    """Taylor-Green vortices in three dimensions, at the start of F3."""
    u, v = np.sin(x) * np.cos(y) * np.cos(z), -np.cos(x) * np.sin(y) * np.cos(z)
    return components(x, y, z, u, v)


def vortices(cells: int) -> World:
    """F3's periodic box at the start."""
    grid = Grid((cells, cells, cells), SIDE / cells, (0.0, 0.0, 0.0))
    world = make_world(
        grid=grid, viscosity=1.0 / REYNOLDS, boundaries=Boundaries(*(PERIODIC,) * 6), tolerance=1e-7
    )
    set_velocity(world, solid_vortices)
    return world


def decay(cells: int, duration: float) -> tuple[Array, Array, Array]:
    """Decay of F3's vortices over `duration` s.

    returns  (n+1,) energy per mass at the ends of all steps, m^2/s^2; (n-1,) times, s, and rates
             -dE/dt, m^2/s^3, in the middle of all steps but the first, which has no earlier
             acceleration
    """
    world = vortices(cells)
    # in a step the fastest fluid crosses half a cell
    count, dt = whole_steps(duration, 0.5 * SIDE / cells)
    energies = history(world, dt, count, lambda: kinetic_energy(world) / SIDE**3)
    times = np.linspace(0.5 * dt, duration - 0.5 * dt, count)
    return energies, times[1:], -np.diff(energies)[1:] / dt


def vortices_break_up(quick: bool) -> list[Finding]:
    """F3: the first steps, the peak of the dissipation and its whole course. The list has the
    course to within 5 % on 256 cells a side; coarser grids fail by their distance from it."""
    grids = Grids("cells a side", (32, 64) if quick else (32, 64, 128))
    runs = [decay(n, 20.0) for n in grids.cells]
    peaks = [rates.max() for _, _, rates in runs]
    moments = [times[rates.argmax()] for _, times, rates in runs]
    early = [rates[0] for _, _, rates in runs]
    moment, published = np.array(reference("F3", "curve t,-dE/dt (digitised)")).T
    away = [
        np.abs(np.interp(moment, times, rates) / published - 1.0).max() for _, times, rates in runs
    ]
    curves = [Curve("spectral, 512 cells a side", moment, published, True)]
    curves += [
        Curve(f"{n} cells a side", times[::4], rates[::4])
        for n, (_, times, rates) in zip(grids.cells, runs, strict=True)
    ]
    plot = Plot("t (s)", "-dE/dt (m^2/s^3)", curves)
    name, when = "-dE_k/dt peak value", "time of peak"
    peak, time = float(reference("F3", name)), float(reference("F3", when))
    begun = "-dE/dt in the second step, m^2/s^3"
    title = "farthest from the published course, relative"
    course = at_most(title, away, 0.05, grids, tolerance="5 %")
    lines = [
        f"{n:>6g} cells a side: the first step loses {1.0 - energies[1] / energies[0]:.2g} of E"
        for n, (energies, _, _) in zip(grids.cells, runs, strict=True)
    ]
    return [
        near("E(0), m^2/s^2", runs[-1][0][0], ENERGY, relative=0.01),
        near(begun, early, DISSIPATION, grids, relative=0.01, lines=lines),
        within(name, peaks, peak, (0.0125, 0.0130), grids, plot=plot),
        within(when, moments, time, (8.8, 9.1), grids),
        falling(course),
    ]


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


def free_stream(quick: bool) -> list[Finding]:
    """F6: a body that moves with the stream does not disturb it."""
    steps = 10 if quick else 50
    driven, _ = carried_body(True, steps)
    free, slip = carried_body(False, steps)
    title = "max|u - u0|/u0, body"
    return [
        at_most(f"{title} told to go with the stream", driven, 1e-10),
        at_most(f"{title} free and neutral", free, 1e-10),
        at_most("slip of the free body / u0", slip, 1e-10),
    ]


RE = 40.0
DECAY = 0.5 * RE - float(np.sqrt(0.25 * RE**2 + 4.0 * np.pi**2))
"""lambda of Kovasznay's flow, 1/m."""


def kovasznay_flow(x: Array, y: Array, z: Array, time: float = 0.0) -> tuple[Array, Array, Array]:
    """The exact flow behind a row of cylinders at Re 40, as a profile and as a field."""
    wake = np.exp(DECAY * x)
    u = 1.0 - wake * np.cos(2.0 * np.pi * y)
    v = DECAY / (2.0 * np.pi) * wake * np.sin(2.0 * np.pi * y)
    return components(x, y, z, u, v)


def kovasznay_error(cells: int, duration: float) -> float:
    """Root of the mean square error of the velocity, in m/s, after `duration` s from the exact
    flow, with `cells` per m."""
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
    return float(np.sqrt(squares / number))


def kovasznay(quick: bool) -> list[Finding]:
    """F7: order of the velocity's error, with the exact velocity on all sides."""
    grids, duration = ((8, 16, 32), 1.0) if quick else ((16, 32, 64, 128), 4.0)
    errors = [kovasznay_error(n, duration) for n in grids]
    series = GridSeries.toward(Grids("cells per m", grids), errors, 0.0)
    return [order_of("order of the velocity's L2 error", series, expected=2.0)]


CASES = (
    Case("F1", vortex_decay),
    Case("F3", vortices_break_up, Tier.HALF_HOUR, coarse=True),
    Case("F6", free_stream),
    Case("F7", kovasznay),
)
