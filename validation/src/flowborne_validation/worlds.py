"""Models, flows, sides and steps that several cases use."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any, TypeVar

import numpy as np

from flowborne import Array, BlowUpError, FrameReport, Grid, Simulation, StepReport, World
from flowborne.bodies import JointCommand, Trajectory
from flowborne.worlds import (
    Boundaries,
    BoundaryInflow,
    BoundaryOpen,
    BoundaryPeriodic,
    Field,
    Profile,
    advance,
    set_velocity,
    start_from,
)

Vector = tuple[float, float, float]
On = TypeVar("On")

NOWHERE: Vector = (0.0, 0.0, 0.0)
PERIODIC = BoundaryPeriodic()
RING = Boundaries(PERIODIC, PERIODIC, PERIODIC, PERIODIC)
"""Periodic in x and y."""


PLANAR = (
    '<joint name="x" type="slide" axis="1 0 0"/><joint name="y" type="slide" axis="0 1 0"/>'
    '<joint name="turn" axis="0 0 1"/>'
)
"""MJCF of the joints of a body that moves freely in the plane."""


def mjcf(*elements: str, options: str = "") -> str:
    """An MJCF model of world-body elements; angles in radians, no contact."""
    return (
        '<mujoco><compiler angle="radian"/><default><geom contype="0" conaffinity="0"/></default>'
        f"{options}<worldbody>{''.join(elements)}</worldbody></mujoco>"
    )


def chain(links: Sequence[str], length: float, start: float = 0.0) -> str:
    """MJCF of a chain along x: each body is a child of the one before.

    links   joint and geom of each body
    length  from one body to the next, m
    start   x of the first body, m
    """
    body = ""
    for k, link in reversed(list(enumerate(links))):
        body = f'<body name="link{k}" pos="{length if k else start} 0 0">{link}{body}</body>'
    return mjcf(body)


def ring_of_boxes(count: int, radius: float, size: str) -> str:
    """MJCF of fixed boxes around the origin, with their middles at a radius in m."""
    geoms = []
    for angle in 2.0 * np.pi / count * np.arange(count):
        x, y = radius * np.cos(angle), radius * np.sin(angle)
        geoms.append(f'<geom type="box" size="{size}" pos="{x} {y} 0" euler="0 0 {angle}"/>')
    return "".join(geoms)


def square(cells: int, side: float = 1.0) -> Grid:
    """A slab of `cells` x `cells` with its middle in the origin; `side` in m."""
    return Grid.slab(cells, cells, side / cells, (-0.5 * side, -0.5 * side))


def hold_all(count: int) -> JointCommand:
    """A command that holds all of `count` dofs."""
    command = JointCommand.none(count)
    command.set(np.arange(count), 0.0, 0.0)
    return command


def at_start(motions: Sequence[Trajectory]) -> tuple[Array, Array]:
    """Positions and velocities at time 0 of joints with one dof each."""
    positions = np.array([motion.position(0.0)[0] for motion in motions])
    return positions, np.array([motion.velocity(0.0)[0] for motion in motions])


def recorded(world: World, dt: float, steps: int, figures: Callable[[StepReport], Any]) -> Array:
    """(steps, ...) figures of each of some steps, from its report."""
    return np.array([figures(advance(world, dt)) for _ in range(steps)])


def history(world: World, dt: float, steps: int, figures: Callable[[], Any]) -> Array:
    """(steps + 1, ...) figures of a world now and after each of some steps."""
    return np.array([figures(), *recorded(world, dt, steps, lambda _: figures())])


def frames_of(simulation: Simulation, frames: int, figures: Callable[[FrameReport], Any]) -> Array:
    """(frames, ...) figures after each of some frames, from the frame's report. Raises
    ArithmeticError when the run blows up."""
    try:
        return np.array([figures(simulation.advance_frame()) for _ in range(frames)])
    except BlowUpError as error:
        raise ArithmeticError(f"{simulation.scene.name}: {error}") from error


def force_on(report: StepReport, body: int = 1) -> Array:
    """(6,) force and torque of the fluid on a body, N and N m (per m in a slab)."""
    return np.asarray(report.pressure_wrench[body] + report.viscous_wrench[body])


def start_at_once(world: World, dt: float) -> StepReport:
    """The first step from a flow that is not yet adapted to its bodies: the impulsive start. The
    pressure of this step is an impulse and no estimate of the next one, so it is cleared."""
    report = advance(world, dt)
    _, state = world.flow()
    for values in (*state.acceleration, state.pressure, state.previous_pressure):
        values[:] = 0.0
    return report


def components(
    x: Array, y: Array, z: Array, u: Array | float, v: Array | float, w: Array | float = 0.0
) -> tuple[Array, Array, Array]:
    """Components of a velocity as arrays of the points' shape."""
    zero = 0.0 * (x + y + z)
    return u + zero, v + zero, w + zero


@dataclass(frozen=True)
class Uniform:
    """The same velocity everywhere, as a profile and as a field."""

    velocity: Vector

    def __call__(
        self, x: Array, y: Array, z: Array, time: float = 0.0
    ) -> tuple[Array, Array, Array]:
        return components(x, y, z, *self.velocity)


@dataclass(frozen=True)
class Parabola:
    """Parallel flow along x in a channel from y = 0 to `height` (m) with the largest velocity
    `peak` (m/s), as a profile and as a field."""

    peak: float
    height: float = 0.41

    def __call__(
        self, x: Array, y: Array, z: Array, time: float = 0.0
    ) -> tuple[Array, Array, Array]:
        u = 4.0 * self.peak * y * (self.height - y) / self.height**2
        return components(x, y, z, u, 0.0)


def all_inflow(profile: Profile) -> Boundaries:
    """The same profile on all four sides of a slab."""
    side = BoundaryInflow(profile)
    return Boundaries(side, side, side, side)


def through_flow(profile: Profile) -> Boundaries:
    """Inflow at the lower x side and an open upper x side; the lateral sides slip."""
    return Boundaries(BoundaryInflow(profile), BoundaryOpen())


def refined(
    grids: Iterable[On], build: Callable[[On], World], field: Field
) -> Iterator[tuple[On, World, bool]]:
    """A world for each grid, from coarse to fine.

    The first starts from a field, the others from the last flow and bodies on the grid before.

    yields  (grid, world, whether it is the first)
    """
    before = None
    for grid in grids:
        world = build(grid)
        if before is None:
            set_velocity(world, field)
        else:
            start_from(before, world)
            world.solid.q[:], world.solid.v[:] = before.solid.q, before.solid.v
        yield grid, world, before is None
        before = world


PLACES = tuple(((k + 0.25) / 5.0 % 1.0, (2.0 * k + 0.25) / 5.0 % 1.0) for k in range(3, 8))
"""Places (x, y) of a held body in a cell of its grid, in cells from the cell's lower corner. They
are a lattice of five points, (k, 2 k) / 5, a quarter of its step away from the corner. Along each
axis they are 1/5 of a cell apart and, with their mirror images, 1/10; none lies on a plane of nodes
or half-way between two, where a grid cuts a round body into equal halves. In the first, which
stands alone on the finest grids, B8's figures on 8 cells are within 1 % of their means."""

Place = tuple[float, float]
ORIGIN: Place = (0.0, 0.0)


def over_places(
    grids: Sequence[int],
    build: Callable[[int, Place], World],
    field: Field,
    measure: Callable[[World, bool], tuple[Sequence[float], str]],
    once: Sequence[int] = (),
) -> tuple[list[Any], list[str]]:
    """Figures of a held body at PLACES in a cell of each grid.

    Each world starts from the last flow of the one before, as in `refined`.

    build    a world, from the cells and the place of the body
    measure  figures, and a line for people, from the world, and whether it is the first
    once     grids with the first place only, as a run takes half an hour
    returns  each figure by grid and place; lines
    """
    rows: dict[int, list[Sequence[float]]] = {cells: [] for cells in grids}
    lines = []
    every = [(n, place) for n in grids for place in PLACES[: 1 if n in once else None]]
    for (n, place), world, first in refined(every, lambda at: build(*at), field):
        figures, text = measure(world, first)
        rows[n].append(figures)
        lines.append(f"{n:>6g} cells, {place[0]:.2f} and {place[1]:.2f} of a cell: {text}")
    by_grid = [list(zip(*found, strict=True)) for found in rows.values()]
    return list(zip(*by_grid, strict=True)), lines


def whole_steps(duration: float, longest: float) -> tuple[int, float]:
    """Number and length of equal steps, at most `longest` each, of a duration."""
    count = max(1, int(np.ceil(duration / longest - 1e-9)))
    return count, duration / count
