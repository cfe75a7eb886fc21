"""A grid that follows bodies by whole cells."""

from __future__ import annotations

import pickle
from dataclasses import replace

import numpy as np
import pytest

from flowborne.coupling.cut import cells_to_follow, follow
from flowborne.coupling.step import step
from flowborne.coupling.world import World
from flowborne.fluid.grid import Grid
from flowborne.kernels.arrays import Array
from flowborne.worlds import (
    Boundaries,
    Boundary,
    BoundaryClosed,
    BoundaryFar,
    BoundaryInflow,
    BoundaryOpen,
    BoundaryPeriodic,
    Source,
    follow_bodies,
    make_world,
    set_velocity,
    start,
)
from flowborne_validation.worlds import Uniform, mjcf

FAR = BoundaryFar()
SEA = Boundaries(*(FAR,) * 4)
CIRCLE = (
    '<body><joint name="x" type="slide" axis="1 0 0"/><joint name="y" type="slide" axis="0 1 0"/>'
    '<geom type="cylinder" size="0.5 5"/></body>'
)
SPHERE = (
    '<body><joint name="x" type="slide" axis="1 0 0"/><joint name="y" type="slide" axis="0 1 0"/>'
    '<joint name="z" type="slide" axis="0 0 1"/><geom type="sphere" size="0.5"/></body>'
)
DT = 0.05


def windowed(
    body: str,
    grid: Grid,
    velocity: tuple[float, ...],
    sides: Boundaries = SEA,
    axes: tuple[int, ...] = (0, 1),
    **fluid: object,
) -> World:
    """A body of the fluid's density that moves, and a window that follows it."""
    world = make_world(mjcf(body), grid, boundaries=sides, solid_density=1.0, **fluid)  # type: ignore[arg-type]
    follow_bodies(world, [1], axes)
    world.solid.v[:] = velocity
    return world


def small(cells: int = 48) -> Grid:
    return Grid.slab(cells, cells, 1 / 8, (-cells / 16, -cells / 16))


def corner(world: World) -> Array:
    return np.array(world.flow()[0].grid.origin)


def curl(world: World) -> Array:
    """Circulation round the inner nodes of a slab over the area of a cell, 1/s."""
    fluid, state = world.flow()
    u, v, _ = (values[:, :, 0] for values in state.velocity)
    turning = np.diff(v, axis=0)[:, 1:-1] - np.diff(u, axis=1)[1:-1]
    return np.asarray(turning / fluid.grid.spacing)


def test_the_window_stays_with_its_body_and_momentum_closes() -> None:
    world = windowed(CIRCLE, small(), (1.0, -0.5), viscosity=0.01)
    start(world, DT)
    last, worst = None, 0.0
    for _ in range(40):
        report = step(world, DT)
        if last is not None:
            given = report.momentum_crossed + report.momentum_jet + report.momentum_forces
            given += report.momentum_boundary + report.momentum_advection
            given -= report.momentum_exchanged
            worst = max(worst, float(np.abs(report.momentum_fluid - last - given).max()))
        last = report.momentum_fluid
    assert worst < 1e-12
    moved = corner(world) - corner(windowed(CIRCLE, small(), (0.0, 0.0)))
    assert moved[0] >= 4 / 8
    assert moved[1] <= -2 / 8
    assert np.abs(world.solid.q - moved[:2]).max() < 1.0 / 8 + 0.1
    assert moved / (1 / 8) == pytest.approx(np.round(moved * 8), abs=1e-12)


@pytest.mark.parametrize(
    "sides",
    [
        Boundaries(x_min=BoundaryInflow(Uniform((0.3, 0.2, 0.0))), x_max=BoundaryOpen()),
        Boundaries(BoundaryOpen(), BoundaryOpen(), BoundaryPeriodic(), BoundaryPeriodic()),
    ],
)
def test_a_uniform_stream_stays_uniform(sides: Boundaries) -> None:
    stream = (0.3, 0.0 if sides.y_min == BoundaryClosed() else 0.2, 0.0)
    if isinstance(sides.x_min, BoundaryInflow):
        sides = replace(sides, x_min=BoundaryInflow(Uniform(stream)))
    world = windowed(CIRCLE, small(24), (-1.0, 0.4), sides, axes=(0,))
    assert world.setup.fluid is not None
    world.setup = replace(world.setup, fluid=replace(world.setup.fluid, one_way=True), basis=None)
    set_velocity(world, lambda x, y, z: tuple(np.full_like(x, c) for c in stream))
    before = corner(world)
    for _ in range(30):
        step(world, DT)
    assert corner(world)[0] <= before[0] - 1.0
    for axis in (0, 1):
        assert np.abs(world.flow()[1].velocity[axis] - stream[axis]).max() < 1e-12


def test_cells_that_come_in_continue_the_fluid_without_vorticity() -> None:
    world = windowed(CIRCLE, small(), (1.0, 0.5))
    start(world, DT)
    while not any(cells_to_follow(world)):
        step(world, DT)
    ahead = np.abs(curl(world)[-4:]).max()
    follow(world)
    assert np.abs(curl(world)[-1]).max() <= max(2.0 * ahead, 1e-10)


ROOM = Grid((16, 16, 16), 1 / 5, (-1.6, -1.6, -1.6))
OPEN_AHEAD = Boundaries(BoundaryOpen(), BoundaryOpen())


@pytest.mark.parametrize(
    ("body", "grid", "velocity", "sides"),
    [
        (CIRCLE, small(32), (1.0, 0.3), SEA),
        (CIRCLE, small(32), (1.0, 0.0), OPEN_AHEAD),
        (SPHERE, ROOM, (1.0, 0.3, 0.2), Boundaries(*(FAR,) * 6)),
    ],
)
def test_the_fluid_ahead_stays_as_still_as_the_body_leaves_it(
    body: str, grid: Grid, velocity: tuple[float, ...], sides: Boundaries
) -> None:
    """A heavy body keeps its speed, and the domain moves with it by twenty cells. In a large domain
    the flow that far ahead is up to 1.6 times that of the start; waves that grow with every move
    reach 4 to 16 times, and the run ends."""
    axes = tuple(axis for axis in grid.axes if sides.pair(axis)[0] != BoundaryClosed())
    world = windowed(body, grid, velocity, sides, axes, density=0.02, viscosity=2e-4)
    start(world, DT)
    first = np.abs(world.flow()[1].velocity[0][-2:]).max()
    while corner(world)[0] < grid.origin[0] + 20.0 * grid.spacing:
        step(world, DT)
        assert np.abs(world.flow()[1].velocity[0][-2:]).max() < 3.0 * first


@pytest.mark.parametrize("cells", [64, 96])
def test_a_free_body_goes_as_in_a_domain_that_does_not_move(cells: int) -> None:
    """Both lose the same to the wake of a coarse grid."""
    world = windowed(CIRCLE, small(cells), (1.0, 0.5))
    large = make_world(
        mjcf(CIRCLE), Grid.slab(160, 160, 1 / 8, (-8, -9)), boundaries=SEA, solid_density=1.0
    )
    large.solid.v[:] = 1.0, 0.5
    for each in (world, large):
        start(each, DT)
        for _ in range(40):
            step(each, DT)
    assert world.solid.q == pytest.approx(large.solid.q, rel=0.01)


def test_a_window_that_has_no_reason_to_move_gives_the_bits_of_a_fixed_domain() -> None:
    world = windowed(CIRCLE, small(24), (0.1, 0.0))
    fixed = make_world(mjcf(CIRCLE), small(24), boundaries=SEA, solid_density=1.0)
    fixed.solid.v[:] = 0.1, 0.0
    for each in (world, fixed):
        start(each, DT)
        for _ in range(5):
            step(each, DT)
    assert all(np.array_equal(world.arrays()[k], v) for k, v in fixed.arrays().items())


def test_a_moved_world_is_restored_and_sent() -> None:
    world = windowed(SPHERE, Grid((16, 16, 16), 1 / 8, (-1.0,) * 3), (1.0, 0.0, 0.5),
                     Boundaries(*(FAR,) * 6), (0, 1, 2))  # fmt: skip
    home = world.setup
    start(world, DT)
    for _ in range(5):
        step(world, DT)
    assert not np.array_equal(corner(world), home.fluid.grid.origin)  # type: ignore[union-attr]
    again = World.from_arrays(home, {k: v.copy() for k, v in world.arrays().items()})
    sent = pickle.loads(pickle.dumps(world))
    step(world, DT)
    for other in (again, sent):
        step(other, DT)
        assert all(np.array_equal(other.arrays()[k], v) for k, v in world.arrays().items())


def test_new_cells_are_cut_by_what_stands_there() -> None:
    wall = '<geom type="box" size="0.5 0.5 5" pos="4 0.3 0"/>'
    world = windowed(wall + CIRCLE, small(), (1.0, 0.0), viscosity=0.01)
    start(world, DT)
    for _ in range(50):
        assert step(world, DT).momentum_budget_error < 1e-12
    cells = world.flow()[1].cell_volume
    assert (cells == 0.0).any(axis=1)[-4:].any()


def test_dye_that_leaves_is_gone_and_none_comes_in() -> None:
    box = Source((-2.9, -0.4, -9.0), (-2.6, 0.4, 9.0), scalars={"ink": 1.0}, times=(0.0, 0.1))
    world = windowed(CIRCLE, small(), (1.0, 0.0), sources=(box,), scalars=("ink",))
    start(world, DT)
    amount = []
    for _ in range(20):
        step(world, DT)
        amount.append(float(world.flow()[1].scalars["ink"].sum()))
    assert amount[2] > 10.0
    assert amount[-1] < 1e-6


@pytest.mark.parametrize("side", [BoundaryClosed(), BoundaryPeriodic()])
def test_a_window_does_not_move_across_a_side_without_fluid_beyond(side: Boundary) -> None:
    with pytest.raises(ValueError, match=f"cannot move along x, as a side there is {side.kind}"):
        windowed(CIRCLE, small(), (0.0, 0.0), Boundaries(x_min=side, x_max=side))


def test_a_channel_stays_tight_as_the_window_moves_along_it() -> None:
    walls = Boundaries(BoundaryOpen(), BoundaryOpen())
    world = windowed(CIRCLE, small(24), (1.0, 0.0), walls, axes=(0,))
    start(world, DT)
    for _ in range(20):
        follow(world)
        for end in (0, -1):
            assert not world.flow()[1].velocity[1][:, end].any()
        step(world, DT)
    assert corner(world)[0] > -1.0


def test_a_uniform_sea_stays_uniform() -> None:
    sea = BoundaryFar(velocity=(0.4, 0.3, 0.0))
    world = windowed(CIRCLE, small(24), (-1.0, 0.4), Boundaries(*(sea,) * 4))
    assert world.setup.fluid is not None
    world.setup = replace(world.setup, fluid=replace(world.setup.fluid, one_way=True), basis=None)
    set_velocity(world, lambda x, y, z: (np.full_like(x, 0.4), np.full_like(x, 0.3), 0.0 * x))
    before = corner(world)
    for _ in range(30):
        step(world, DT)
    assert corner(world)[0] <= before[0] - 1.0
    for axis, speed in enumerate((0.4, 0.3)):
        assert np.abs(world.flow()[1].velocity[axis] - speed).max() < 1e-12
