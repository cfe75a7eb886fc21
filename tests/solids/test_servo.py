"""Approaches to a target, in closed form, and motions that drives follow late or weakly."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from flowborne import World
from flowborne.bodies import (
    Servo,
    ServoExact,
    ServoPD,
    TrajectoryConstant,
    TrajectoryServo,
    TrajectorySinusoid,
)
from flowborne.worlds import advance, make_world
from flowborne_validation.worlds import mjcf


@given(st.floats(-3, 3), st.integers(1, 40), st.floats(1e-4, 0.1))
def test_exact_servo_arrives_when_due(gap: float, steps: int, dt: float) -> None:
    here, velocity = np.zeros(1), np.zeros(1)
    for left in range(steps, 0, -1):
        move, velocity = ServoExact().velocity(gap - here, velocity, left * dt, dt)
        assert move == pytest.approx(gap / (steps * dt))
        here = here + dt * move
    assert here[0] == pytest.approx(gap, abs=1e-13)


@given(st.floats(0.1, 500.0), st.floats(1e-3, 1.0))
def test_pd_servo_follows_its_law_for_any_step(frequency: float, dt: float) -> None:
    servo = ServoPD(frequency)
    here, velocity, time = np.zeros(1), np.zeros(1), 0.0
    for _ in range(20):
        move, velocity = servo.velocity(1.0 - here, velocity, 9.0, dt)
        here, time = here + dt * move, time + dt
        late = (1.0 + frequency * time) * np.exp(-frequency * time)
        assert here[0] == pytest.approx(1.0 - late, abs=1e-10)
        assert velocity[0] == pytest.approx(
            frequency**2 * time * np.exp(-frequency * time), abs=1e-8 * frequency
        )
    assert here[0] <= 1.0 + 1e-12


def test_bad_servos_are_refused() -> None:
    with pytest.raises(ValueError, match="frequency is 0"):
        ServoPD(0.0)
    with pytest.raises(ValueError, match="torque limit is"):
        ServoExact((1.0, -1.0))


INERTIA, DT = 0.5, 0.01
WHEEL = mjcf(
    '<body><joint name="hinge" axis="0 0 1"/><geom type="sphere" size="0.1"/>'
    f'<inertial pos="0 0 0" mass="1" diaginertia="{INERTIA} {INERTIA} {INERTIA}"/></body>'
)
"""A body on a hinge, without a fluid."""

DOF = np.array([0])


def wheel(motion: TrajectoryConstant | TrajectorySinusoid, servo: Servo) -> World:
    return make_world(WHEEL, slab=True, motions=(TrajectoryServo(motion, servo),))


@pytest.mark.parametrize("limit", [np.inf, 4.0])
def test_pd_servo_follows_a_steady_motion_two_over_its_frequency_late(limit: float) -> None:
    """To a step, for which a target stands still."""
    world = wheel(TrajectoryConstant(DOF, 0.0, 2.0), ServoPD(10.0, limit))
    advance(world, DT, 300)
    late = world.time - world.solid.q[0] / 2.0
    assert late == pytest.approx(2.0 / 10.0, abs=DT)


def test_a_strong_drive_follows_as_one_without_a_limit() -> None:
    world = wheel(TrajectorySinusoid(DOF, 0.5, 1.0), ServoExact(1e9))
    world.solid.v[:] = world.setup.motions[0].velocity(0.0)
    advance(world, DT)
    for _ in range(100):
        advance(world, DT)
        told = world.setup.motions[0].position(world.time)[0]
        assert world.solid.q[0] == pytest.approx(told, abs=1e-12)


def test_a_weak_drive_pushes_with_all_that_it_has() -> None:
    """Told to turn at 2 rad/s at once, a wheel comes to it at torque over inertia."""
    torque = 0.4
    world = wheel(TrajectoryConstant(DOF, 0.0, 2.0), ServoExact(torque))
    for n in range(1, 101):
        report = advance(world, DT)
        assert report.limited.tolist() == [0]
        assert report.actuator[0] == pytest.approx(torque)
        assert world.solid.v[0] == pytest.approx(n * DT * torque / INERTIA)
