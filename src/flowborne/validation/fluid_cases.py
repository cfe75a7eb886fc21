"""Flows without obstacles, and a body that must not be one: F1, F6, F7."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flowborne import Array, Grid, World
from flowborne.boundaries import Boundaries, BoundaryInflow
from flowborne.motions import Trajectory, TrajectoryConstant
from flowborne.validation.case import Case, Finding, GridSeries, at_most, order_of
from flowborne.validation.worlds import RING, mjcf, whole_steps
from flowborne.worlds import advance, make_world, set_velocity


@dataclass(frozen=True)
class Vortices:
    """Taylor-Green vortices on a mean flow (mean, mean)."""

    mean: float

    def __call__(self, x: Array, y: Array, z: Array) -> tuple[Array, Array, Array]:
        return (
            np.sin(x) * np.cos(y) + self.mean + 0.0 * z,
            -np.cos(x) * np.sin(y) + self.mean + 0.0 * z,
            0.0 * (x + y + z),
        )


QUARTER = 0.5 * np.pi
"""s in which a mean flow of 1 m/s carries the pattern by a quarter of the box, a whole number of
cells on every grid."""


def taylor_green(cells: int, viscosity: float, mean: float) -> tuple[float, float]:
    """Energy and largest velocity of the pattern after a quarter, over their first values."""
    grid = Grid.slab(cells, cells, 2.0 * np.pi / cells, (0.0, 0.0))
    world = make_world(grid=grid, viscosity=viscosity, boundaries=RING, tolerance=1e-11)
    set_velocity(world, Vortices(mean))
    energy, fastest = pattern(world, mean)
    count, dt = whole_steps(QUARTER, 0.5 * grid.spacing / (1.0 + mean))
    advance(world, dt, count)
    energy_after, fastest_after = pattern(world, mean)
    return energy_after / energy, fastest_after / fastest


def pattern(world: World, mean: float) -> tuple[float, float]:
    """Energy and largest velocity of what is left without the mean flow."""
    _, state = world.flow()
    u, v = state.velocity[0][:-1] - mean, state.velocity[1][:, :-1] - mean
    return float((u**2).sum() + (v**2).sum()), float(max(np.abs(u).max(), np.abs(v).max()))


def vortex_decay(quick: bool) -> list[Finding]:
    """F1: energy and largest velocity, with and without viscosity and mean advection."""
    grids = (16, 32, 64) if quick else (32, 64, 128, 256, 512)
    findings = []
    for mean in (0.0, 1.0):
        for nu in (0.01, 0.0):
            runs = [taylor_green(n, nu, mean) for n in grids]
            exact = (float(np.exp(-4.0 * nu * QUARTER)), float(np.exp(-2.0 * nu * QUARTER)))
            for m, name in enumerate(("E(t)/E(0)", "max|u|(t)")):
                values = [run[m] for run in runs]
                errors = [abs(value - exact[m]) for value in values]
                series = GridSeries("cells a side", grids, values, errors)
                said = f"order of {name}, nu = {nu:g}, mean flow ({mean:g}, {mean:g})"
                findings.append(order_of(said, series, least=1.9))
    return findings


STREAM = 0.912
"""m/s, of F6."""

DIAMETER = 0.753
"""m, of F6."""


@dataclass(frozen=True)
class Uniform:
    """The same velocity everywhere, as a profile and as a field."""

    velocity: tuple[float, float, float]

    def __call__(
        self, x: Array, y: Array, z: Array, time: float = 0.0
    ) -> tuple[Array, Array, Array]:
        same = 0.0 * (x + y + z)
        return same + self.velocity[0], same + self.velocity[1], same + self.velocity[2]


def all_inflow(profile: object) -> Boundaries:
    """The same profile on all four sides of a slab."""
    side = BoundaryInflow(profile)  # type: ignore[arg-type]
    return Boundaries(side, side, side, side)


def carried_body(driven: bool, steps: int, pace: float = 1.0) -> tuple[float, float]:
    """Largest departure of fluid and body from the stream, over the stream's velocity.

    The box of 32 x 32 cells has a side of 4 m; the body goes with the stream for `steps` steps,
    told to or free and as heavy as the fluid.

    pace  the body's velocity over the stream's; any other than 1 is a disturbance
    """
    grid = Grid.slab(32, 32, 0.125, (-2.0, -2.0))
    body = (
        '<body name="disc" pos="-0.9 0.031 0"><joint name="x" type="slide" axis="1 0 0"/>'
        f'<joint name="y" type="slide" axis="0 1 0"/>'
        '<joint name="turn" type="hinge" axis="0 0 1"/>'
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
    """F6: a body that goes with the stream leaves it as it is."""
    steps = 10 if quick else 50
    driven, _ = carried_body(True, steps)
    free, slip = carried_body(False, steps)
    said = "max|u - u0|/u0, body"
    return [
        at_most(f"{said} told to go with the stream", driven, 1e-10),
        at_most(f"{said} free and neutral", free, 1e-10),
        at_most("slip of the free body / u0", slip, 1e-10),
    ]


RE = 40.0
DECAY = 0.5 * RE - float(np.sqrt(0.25 * RE**2 + 4.0 * np.pi**2))
"""lambda of Kovasznay's flow, 1/m."""


@dataclass(frozen=True)
class Kovasznay:
    """The exact flow behind a row of cylinders at Re 40, as a profile and as a field."""

    def __call__(
        self, x: Array, y: Array, z: Array, time: float = 0.0
    ) -> tuple[Array, Array, Array]:
        wake = np.exp(DECAY * x)
        u = 1.0 - wake * np.cos(2.0 * np.pi * y) + 0.0 * z
        v = DECAY / (2.0 * np.pi) * wake * np.sin(2.0 * np.pi * y) + 0.0 * z
        return u, v, 0.0 * (x + y + z)


def kovasznay_error(cells: int, duration: float) -> float:
    """Root of the mean square error of the velocity, in m/s, after `duration` s from the exact
    flow, with `cells` per m."""
    grid = Grid.slab(3 * cells // 2, 2 * cells, 1.0 / cells, (-0.5, -0.5))
    exact = Kovasznay()
    world = make_world(grid=grid, viscosity=1.0 / RE, boundaries=all_inflow(exact), tolerance=1e-10)
    set_velocity(world, exact)
    count, dt = whole_steps(duration, 0.25 * grid.spacing)
    advance(world, dt, count)
    _, state = world.flow()
    squares, number = 0.0, 0
    for axis in grid.axes:
        x, y, z = np.meshgrid(*grid.face_coordinates(axis), indexing="ij")
        squares += float(((state.velocity[axis] - exact(x, y, z)[axis]) ** 2).sum())
        number += x.size
    return float(np.sqrt(squares / number))


def kovasznay(quick: bool) -> list[Finding]:
    """F7: order of the velocity's error, with the exact velocity on all sides."""
    grids, duration = ((8, 16, 32), 1.0) if quick else ((16, 32, 64, 128), 4.0)
    errors = [kovasznay_error(n, duration) for n in grids]
    series = GridSeries("cells per m", grids, errors, errors)
    return [order_of("order of the velocity's L2 error", series, expected=2.0)]


CASES = (Case("F1", vortex_decay), Case("F6", free_stream), Case("F7", kovasznay))
