"""Bodies and fluid start together."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest
from numpy.testing import assert_allclose

import flowborne as fb
from flowborne.worlds import (
    Boundaries,
    BoundaryInflow,
    BoundaryOpen,
    advance,
    kinetic_energy,
    make_world,
    set_going,
    set_velocity,
    start,
)
from flowborne_validation.worlds import RING, Uniform, mjcf

BALL = '<body name="ball"><freejoint/><geom type="sphere" size=".2" density="1"/></body>'
CHAIN = (
    '<body name="head"><freejoint name="root"/><geom type="ellipsoid" size=".2 .08 1"/>'
    '<body name="tail" pos="-.25 0 0"><joint name="hinge" pos=".05 0 0" axis="0 0 1"/>'
    '<geom type="ellipsoid" size=".2 .08 1" pos="-.2 0 0"/></body></body>'
)


def square(cells: int) -> fb.Grid:
    return fb.Grid.slab(cells, cells, 2.0 / cells, (-1.0, -1.0))


def test_a_disc_sets_its_added_mass_going() -> None:
    """Kinetic energy (1 + Ca) m v^2 / 2 with the Ca of I2, and the disc keeps its velocity."""
    found = []
    for cells in (16, 32, 64):
        world = make_world(mjcf(BALL), square(cells))
        world.solid.v[:2] = 1.0, 0.5
        alone = kinetic_energy(world)
        set_going(world)
        assert_allclose(world.solid.v[:2], (1.0, 0.5), rtol=1e-12)
        found.append(kinetic_energy(world) / alone)
    assert abs(found[-1] - 2.0712) < 0.01
    assert np.all(np.diff(np.abs(np.array(found) - 2.0712)) < 0.0)


def test_the_first_step_takes_no_share() -> None:
    """A disc that moves steadily in an ideal fluid feels nothing but the walls."""
    world = make_world(mjcf(BALL), square(64))
    world.solid.v[0] = 1.0
    set_going(world)
    advance(world, 0.01)
    assert world.solid.v[0] > 0.99
    still = make_world(mjcf(BALL), square(64))
    still.solid.v[0] = 1.0
    advance(still, 0.01)
    assert still.solid.v[0] < 0.6


def test_a_stream_flows_around_a_body_from_the_start() -> None:
    stream = Uniform((1.0, 0.0, 0.0))
    world = make_world(
        mjcf('<body><geom type="sphere" size=".2"/></body>'),
        square(64),
        boundaries=Boundaries(BoundaryInflow(stream), BoundaryOpen()),
    )
    set_velocity(world, stream)
    set_going(world)
    _, state = world.flow()
    assert 1.8 < state.velocity[0].max() < 2.2  # 2 U beside a cylinder, a little more in a channel
    assert abs(advance(world, 0.01).pressure_wrench[1, 0]) < 0.2
    assert world.time == pytest.approx(0.01)


def test_a_creature_without_impulse_has_the_least_energy() -> None:
    """With its hinge turning as it does, any other velocity of the root means more kinetic energy
    of bodies and fluid together (Kelvin)."""

    def energy(root: np.ndarray | None) -> tuple[float, np.ndarray]:
        world = make_world(mjcf(CHAIN), square(48), solid_density=1.0, tolerance=1e-11)
        world.solid.v[-1] = 2.0
        given = np.ones(world.solid.v.size, bool)
        if root is None:
            given[:-1] = False
        else:
            world.solid.v[:-1] = root
        set_going(world, given)
        assert world.solid.v[-1] == pytest.approx(2.0, rel=1e-12)
        return kinetic_energy(world), world.solid.v[:-1].copy()

    least, root = energy(None)
    assert np.abs(root).max() > 0.1
    for axis in (0, 1, 5):
        for way in (-0.05, 0.05):
            other = root.copy()
            other[axis] += way
            assert energy(other)[0] > least


def test_a_body_let_go_falls_as_galilei_has_it() -> None:
    world = make_world(mjcf(BALL), gravity=(0.0, 0.0, -9.81))
    world.solid.v[2] = 3.0
    start(world, 0.1)
    assert (world.time, world.steps, world.solid.q[2]) == (0.0, 0, pytest.approx(0.0, abs=1e-15))
    for _ in range(10):
        advance(world, 0.1)
        assert world.solid.q[2] == pytest.approx(
            3.0 * world.time - 0.5 * 9.81 * world.time**2, abs=1e-12
        )


def test_a_disc_let_go_in_a_fluid_is_where_it_should_be_to_second_order() -> None:
    """After 0.2 s it has sunk by a twentieth of a cell: what is left is the error in time."""

    def sunk(steps: int) -> float:
        world = make_world(
            mjcf(BALL), square(32), solid_density=2.0, gravity=(0.0, -0.2, 0.0), tolerance=1e-11
        )
        start(world, 0.2 / steps)
        advance(world, 0.2 / steps, steps)
        return float(-world.solid.q[1])

    found = np.array([sunk(steps) for steps in (1, 2, 4)])
    assert found[0] == pytest.approx(0.5 * 0.2 * 0.2**2 * 1.0 / (2.0 + 1.0712), rel=0.01)
    assert np.abs(np.diff(found)).max() < 1e-5 * found[0]


@dataclass
class Opening:
    """The chain's hinge begins to turn with a constant acceleration of 1 rad/s^2."""

    dofs = np.array([6])

    def position(self, time: float) -> np.ndarray:
        return np.array([0.5 * time**2])

    def velocity(self, time: float) -> np.ndarray:
        return np.array([time])


def tail_momentum(world: fb.World) -> float:
    """N s of the tail as it swings about a hinge that is held."""
    return float(world.setup.solid.body_mass[2] * 0.2 * np.abs(world.solid.v[6]))


def test_joints_that_begin_to_move_leave_no_impulse_in_what_floats() -> None:
    """But for an error of third order, by the pose half a step on."""

    def left_over(dt: float) -> float:
        world = make_world(mjcf(CHAIN), motions=(Opening(),))
        start(world, dt)
        left = np.abs(fb.bodies.halfway_momentum(world.setup.solid, world.solid, dt)).max()
        assert left < 1e-3 * tail_momentum(world)
        return float(left)

    assert left_over(0.1) > 6.0 * left_over(0.05)


def test_nor_in_what_swims_in_a_ring_of_water() -> None:
    world = make_world(
        mjcf(CHAIN),
        square(48),
        motions=(Opening(),),
        solid_density=1.0,
        boundaries=RING,
        tolerance=1e-11,
    )
    start(world, 0.1)
    report = advance(world, 0.1)
    assert np.abs(report.momentum_fluid + report.momentum_solid).max() < 1e-3 * tail_momentum(world)
