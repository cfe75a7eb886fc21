"""Displacements of joints: ranges, differences, what is outboard."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from flowborne.control import creature
from flowborne.coupling.world import Setup, World
from flowborne.solids.model import SolidModel
from flowborne.solids.momentum import momentum

MakeWorld = Callable[..., World]
shared_fixture = settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
vectors = st.lists(st.floats(-1.5, 1.5), min_size=3, max_size=3).map(np.array)


def ball_angle(q: np.ndarray) -> float:
    return float(2.0 * np.arctan2(np.linalg.norm(q[1:]), abs(q[0])))


def test_hinge_stops_at_its_range_and_may_come_back_from_beyond(make_world: MakeWorld) -> None:
    world = make_world(limited=True)
    model, state = world.setup.solid, world.solid
    state.q[0] = 1.0
    for wanted, allowed in ((0.5, 0.2), (0.1, 0.1), (-3.0, -2.2)):
        far = creature.within_range(model, state.q, np.array([wanted, 9.0, 0.0]))
        assert far == pytest.approx([allowed, 9.0, 0.0])
    state.q[0] = 1.5
    for wanted, allowed in ((0.5, 0.0), (-0.1, -0.1)):
        far = creature.within_range(model, state.q, np.array([wanted, 0.0, 0.0]))
        assert far == pytest.approx([allowed, 0.0, 0.0])


@shared_fixture
@given(first=vectors, then=vectors)
def test_ball_stays_within_its_cone(
    make_world: MakeWorld, first: np.ndarray, then: np.ndarray
) -> None:
    world = make_world(ball=True, limited=True)
    model, state = world.setup.solid, world.solid
    allowed = creature.within_range(model, state.q, first)
    assert np.linalg.norm(allowed) == pytest.approx(min(np.linalg.norm(first), 0.7), abs=1e-9)
    here = creature.moved(model, state.q, allowed)
    there = creature.moved(model, here, creature.within_range(model, here, then))
    assert ball_angle(there) <= 0.7 + 1e-9
    # no more is taken than has to be: what is cut short ends on the cone
    if np.linalg.norm(creature.within_range(model, here, then) - then) > 1e-9:
        assert ball_angle(there) == pytest.approx(0.7, abs=1e-6)


def test_ball_beyond_its_cone_may_only_come_back(make_world: MakeWorld) -> None:
    world = make_world(ball=True, limited=True)
    model, state = world.setup.solid, world.solid
    out = creature.moved(model, state.q, np.array([0.0, 1.0, 0.0]))
    assert not creature.within_range(model, out, np.array([0.0, 0.2, 0.0])).any()
    back = np.array([0.0, -0.2, 0.0])
    assert np.array_equal(creature.within_range(model, out, back), back)


@shared_fixture
@given(first=vectors, then=vectors)
def test_difference_undoes_a_displacement_of_a_ball(
    make_world: MakeWorld, first: np.ndarray, then: np.ndarray
) -> None:
    world = make_world(ball=True)
    model, state = world.setup.solid, world.solid
    here = creature.moved(model, state.q, first)
    there = creature.moved(model, here, then)
    assert model.difference(here, there) == pytest.approx(then, abs=1e-9)


def test_outboard_dofs_leave_out_controlled_and_keyframed_ones(make_world: MakeWorld) -> None:
    class Wave:
        dofs = np.array([2])

    def outboard(world: World, *dofs: int) -> list[int]:
        return creature.outboard(world, np.array(dofs)).tolist()

    world = make_world()
    assert outboard(world, 0) == [1, 2]
    assert outboard(world, 1) == [2]
    assert outboard(world, 0, 2) == [1]
    assert outboard(world, 2) == []
    assert outboard(make_world(motions=(Wave(),)), 0) == [1]


FLOATING = """
<mujoco>
  <worldbody>
    <body name="trunk">
      <freejoint name="root"/>
      <geom type="box" size=".5 .2 .1"/>
      <body name="limb" pos=".5 0 0">
        <joint name="hip" type="hinge" axis="0 0 1"/>
        <geom type="box" size=".4 .1 .1" pos=".4 0 0"/>
        <body name="foot" pos=".8 0 0">
          <joint name="ankle" type="hinge" axis="0 1 0"/>
          <geom type="box" size=".2 .1 .1" pos=".2 0 0"/>
        </body>
      </body>
    </body>
  </worldbody>
</mujoco>
"""


def test_velocity_given_to_joints_keeps_the_momentum_of_a_floating_creature() -> None:
    model = SolidModel.from_string(FLOATING)
    world = World(Setup(model), solid=model.rest())
    world.solid.q[7:] = [0.4, -0.6]
    world.solid.v[:] = [0.3, -0.2, 0.5, 1.0, -2.0, 0.7, 3.0, -4.0]
    before = momentum(model, world.solid)
    creature.give_velocity(world, np.array([6, 7]), np.array([-5.0, 0.0]), np.zeros(0, np.int64))
    assert world.solid.v[6:] == pytest.approx([-5.0, 0.0], abs=1e-13)
    assert momentum(model, world.solid) == pytest.approx(before, rel=1e-10)


def test_kept_velocities_stay() -> None:
    model = SolidModel.from_string(FLOATING)
    world = World(Setup(model), solid=model.rest())
    world.solid.v[:] = 1.0
    creature.give_velocity(world, np.array([7]), np.zeros(1), np.array([6]))
    assert world.solid.v[6:].tolist() == [1.0, 0.0]
    assert np.abs(world.solid.v[:6] - 1.0).max() > 1e-3
