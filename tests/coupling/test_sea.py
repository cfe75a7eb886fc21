"""A domain in a sea: its stream, what the vorticity inside and beyond does at the sides."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest

import flowborne as fb
from flowborne.coupling.world import World
from flowborne.fluid.grid import Grid
from flowborne.sim.frame import Snapshot
from flowborne.worlds import (
    Boundaries,
    Boundary,
    BoundaryClosed,
    BoundaryFar,
    BoundaryInflow,
    BoundaryOpen,
    Source,
    advance,
    make_world,
    set_velocity,
)
from flowborne_validation.far_sides import box, pair
from flowborne_validation.shedding import UNBOUNDED, cylinder
from flowborne_validation.worlds import Uniform, force_on, mjcf, start_at_once

CLOSED = BoundaryClosed()


def sea(*velocity: float) -> Boundaries:
    """A slab in a sea that flows."""
    return Boundaries(*(BoundaryFar((velocity[0], velocity[1], 0.0)),) * 4)


STILL = sea(0.0, 0.0)


@dataclass(frozen=True)
class Rising:
    """From rest within 1 s."""

    def at(self, time: float) -> float:
        return 0.5 - 0.5 * np.cos(np.pi * min(time, 1.0))


@pytest.mark.parametrize("velocity", [(1.0, 0.4), (-0.3, 1.0), (0.5, -0.5)])
def test_a_uniform_stream_stays_uniform(velocity: tuple[float, float]) -> None:
    world = make_world(grid=box(8, (0.0, 0.0), (3.0, 2.0)), boundaries=sea(*velocity))
    set_velocity(world, Uniform((*velocity, 0.0)))
    advance(world, 0.05, 40)
    for values, speed in zip(world.flow()[1].velocity[:2], velocity, strict=True):
        np.testing.assert_allclose(values, speed, atol=1e-12)


def test_a_sea_that_begins_to_flow_takes_the_fluid_inside_along() -> None:
    sides = Boundaries(*(BoundaryFar((1.0, 0.4, 0.0), Rising()),) * 4)
    world = make_world(grid=box(8, (0.0, 0.0), (3.0, 2.0)), boundaries=sides, tolerance=1e-13)
    for _ in range(25):
        report = advance(world, 0.05)
        assert world.time > 1.0 or report.momentum_budget_error < 1e-10
        for values, speed in zip(world.flow()[1].velocity[:2], (1.0, 0.4), strict=True):
            np.testing.assert_allclose(values, speed * Rising().at(world.time), atol=1e-11)


def test_a_light_body_goes_with_a_sea_that_begins_to_flow() -> None:
    """Of the density of the fluid: as fast as the sea."""
    sides = Boundaries(*(BoundaryFar((1.0, 0.0, 0.0), Rising()),) * 4)
    body = '<body><joint name="x" type="slide" axis="1 0 0"/><geom type="cylinder" size="0.5 5"/>'
    grid = box(12, (-1.0, -1.0), (1.0, 1.0))
    world = make_world(mjcf(f"{body}</body>"), grid, boundaries=sides, solid_density=1.0)
    for _ in range(10):
        advance(world, 0.05)
        assert world.solid.v[0] == pytest.approx(Rising().at(world.time), abs=1e-3)


@pytest.mark.parametrize("half", [(3.0, 1.5), (1.5, 3.0), (4.0, 2.0), (2.0, 4.0)])
def test_a_circle_falls_in_an_oblong_box_as_in_endless_fluid(half: tuple[float, float]) -> None:
    """After some steps: the column of fluid behind each face is right for a square alone."""
    body = '<body><joint name="x" type="slide" axis="1 0 0"/><geom type="cylinder" size="1 5"/>'
    grid, gravity = box(16, (-half[0], -half[1]), half), (-1.0, 0.0, 0.0)
    world = make_world(
        mjcf(f"{body}</body>"), grid, boundaries=STILL, solid_density=10.0, gravity=gravity
    )
    for _ in range(12):
        before = world.solid.v[0]
        report = advance(world, 0.02)
        assert report.momentum_budget_error < 1e-12
    assert (before - world.solid.v[0]) / 0.02 == pytest.approx(9.0 / 11.0, rel=2e-3)


def held(grid: Grid, sides: Boundaries, viscosity: float = 0.01) -> World:
    """A cylinder of 1 m at the origin in a stream of 1 m/s along x."""
    world = make_world(
        cylinder(1.0, 0.0, 0.0), grid, viscosity=viscosity, boundaries=sides, tolerance=1e-7
    )
    set_velocity(world, Uniform((1.0, 0.0, 0.0)))
    start_at_once(world, 0.125)
    return world


def drag(world: World, steps: int) -> float:
    """Its coefficient after steps of 0.125 s; momentum is kept in all of them."""
    for _ in range(steps):
        report = advance(world, 0.125)
        assert report.momentum_budget_error < 1e-10
    return UNBOUNDED.coefficients(report)[0]


@pytest.mark.parametrize(("lower", "upper"), [((-3, -3), (5, 3)), ((-2, -2), (4, 2))])
def test_a_stream_past_a_cylinder_in_a_small_box(
    lower: tuple[float, float], upper: tuple[float, float]
) -> None:
    """Drag at 5 D/U is 1.275 in 24 x 20 diameters; with walls it is 1.62 in 8 x 6."""
    world = held(box(8, lower, upper), sea(1.0, 0.0))
    assert drag(world, 40) == pytest.approx(1.275, rel=0.01)


def test_a_stream_past_a_cylinder_beside_a_mirror() -> None:
    """Half of it, between the mirror and the sea, with its wake and that one's image."""
    whole = drag(held(box(8, (-2.0, -2.0), (3.0, 2.0)), sea(1.0, 0.0)), 60)
    far = BoundaryFar((1.0, 0.0, 0.0))
    half = held(box(8, (-2.0, 0.0), (3.0, 2.0)), Boundaries(far, far, CLOSED, far))
    assert 2.0 * drag(half, 60) == pytest.approx(whole, rel=0.01)


def test_an_oblique_stream_past_a_cylinder() -> None:
    """Within 5 % of one along x, on a grid on which a cylinder is not round."""
    world = make_world(
        cylinder(1.0, 0.0, 0.0),
        box(8, (-3.0, -3.0), (3.0, 3.0)),
        viscosity=0.01,
        boundaries=sea(0.8, 0.6),
        tolerance=1e-7,
    )
    set_velocity(world, Uniform((0.8, 0.6, 0.0)))
    start_at_once(world, 0.125)
    report = advance(world, 0.125, 40)
    force = 2.0 * force_on(report)
    assert 0.8 * force[0] + 0.6 * force[1] == pytest.approx(1.323, rel=0.05)
    assert abs(0.8 * force[1] - 0.6 * force[0]) < 0.08


def left_behind(side: Boundary) -> float:
    """Part of the energy of a vortex pair that is left in the box 5 s after it came to the side."""
    grid = box(8, (-2.0, -2.0), (2.0, 2.0))
    world = make_world(grid=grid, boundaries=Boundaries(*(side,) * 4), viscosity=0.002)
    set_velocity(world, pair)
    start = fb.worlds.kinetic_energy(world)
    advance(world, 0.04, 175)
    return fb.worlds.kinetic_energy(world) / start


def test_a_vortex_pair_leaves() -> None:
    """Of its energy 0.5 % stay; behind open sides 2 %, in a domain six times as wide 0.05 %."""
    assert left_behind(BoundaryFar()) < 0.007
    assert left_behind(BoundaryOpen()) > 0.015


def test_the_sides_let_through_what_a_source_brings() -> None:
    """At once, alike to all sides of a square, and in a slab beside a mirror."""
    source = Source((-0.1, -0.1, -1.0), (0.1, 0.1, 1.0), volume_rate=0.5)
    for low, sides in (
        (-1.0, STILL),
        (0.0, Boundaries(BoundaryFar(), BoundaryFar(), CLOSED, BoundaryFar())),
    ):
        grid = box(10, (-1.0, low), (1.0, 1.0))
        world = make_world(grid=grid, boundaries=sides, sources=(source,))
        advance(world, 0.02, 2)
        u, v, _ = world.flow()[1].velocity
        through = [-u[0].sum(), u[-1].sum(), v[:, -1].sum()]
        np.testing.assert_allclose(
            0.1 * np.array(through), 0.125 if low else [0.125, 0.125, 0.25], rtol=1e-2
        )


SMALL = {"domain.resolution": "16", "dye": "[]", "film.field": "vorticity"} | {
    f"boundaries.{side}": '{ kind = "far", velocity = [1.0, 0.2] }'
    for side in ("x_min", "x_max", "y_min", "y_max")
}


@pytest.mark.usefixtures("shared_processes")
@pytest.mark.parametrize("executor", ["serial", "threads", "processes"])
def test_trials_workers_and_a_resumed_run_have_the_same_bits(executor: str) -> None:
    """With a wake beyond the exit."""
    scene = fb.load_scene("ns-chain-2", SMALL)
    with fb.Simulation(scene, workers=1) as simulation:
        simulation.advance_frame()
        middle = World.from_arrays(simulation.world.setup, simulation.world.copy().arrays())
        simulation.advance_frame()
        expected = simulation.world.arrays()
    assert expected["fluid/wake"][1].any()
    assert expected["fluid/sea"].size == 3
    with fb.Simulation(scene, workers=2, executor=executor) as resumed:
        resumed.restore(Snapshot(middle, 1, None))
        resumed.advance_frame()
        for name, values in resumed.world.arrays().items():
            np.testing.assert_array_equal(values, expected[name])


def test_a_jump_of_the_sea_in_a_run_moves_the_fluid() -> None:
    values = {
        f"boundaries.{side}.velocity": [2.0, 0.0] for side in ("x_min", "x_max", "y_min", "y_max")
    }
    with fb.Simulation(fb.load_scene("ns-chain-2", SMALL), workers=1) as simulation:
        simulation.advance_frame()
        simulation.change(values)
        simulation.advance_frame()
        u = simulation.world.flow()[1].velocity[0]
        assert np.abs(u[0] - 2.0).max() < 0.3


def test_what_is_no_sea_is_refused() -> None:
    with pytest.raises(ValueError, match="there is one sea"):
        Boundaries(BoundaryFar((1.0, 0.0, 0.0)), *(BoundaryFar(),) * 3)
    grid, far = box(4, (0.0, 0.0), (1.0, 1.0)), BoundaryFar((1.0, 0.0, 0.0))
    with pytest.raises(ValueError, match="other sides take part"):
        make_world(grid=grid, boundaries=Boundaries(far, far, BoundaryOpen(), far))
    with pytest.raises(ValueError, match="crosses a closed side"):
        make_world(grid=grid, boundaries=Boundaries(CLOSED, far, far, far))


def test_where_other_sides_take_part_far_ones_are_columns_of_fluid_alone() -> None:
    inflow = BoundaryInflow(Uniform((1.0, 0.0, 0.0)))
    still = BoundaryFar()
    world = make_world(
        grid=box(8, (0.0, 0.0), (1.0, 1.0)), boundaries=Boundaries(inflow, still, still, still)
    )
    set_velocity(world, Uniform((1.0, 0.0, 0.0)))
    advance(world, 0.05, 5)
    np.testing.assert_allclose(world.flow()[1].velocity[0], 1.0, atol=1e-12)
    assert not world.flow()[1].wake.size
