"""Approaches to a target, in closed form."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from flowborne.control.servo import ServoExact, ServoPD


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
