"""Stops of joints: how stiff they are, and what they do to drives."""

from __future__ import annotations

import numpy as np
import pytest

from flowborne.solids.driven import drive, within_limits
from flowborne.solids.dynamics import SolidSystem, assemble
from flowborne.solids.model import SolidModel, SolidState
from flowborne.solids.prescribed import Driven
from flowborne.solids.trajectories import JointCommand

WHEEL = """<mujoco><worldbody><body><joint axis="0 0 1" range="-45 45" {stop}/>
<geom type="cylinder" size=".1 .05" mass="2"/></body></worldbody></mujoco>"""

SLIDER = """<mujoco><worldbody><body><joint type="slide" axis="1 0 0" range="-.2 .3"/>
<geom type="box" size=".1 .1 .1" mass="2"/></body></worldbody></mujoco>"""

BALL = """<mujoco><worldbody><body><joint type="ball" range="0 30"/>
<geom type="box" size=".1 .1 .1" mass="2"/></body></worldbody></mujoco>"""


def moved(
    model: SolidModel, speed: float, force: float, dt: float, count: int
) -> tuple[np.ndarray, np.ndarray]:
    """(count, nq) positions and (count, nv) velocities from rest position, as bodies step."""
    state, applied = model.rest(), np.zeros(model.nv)
    state.v[-1], applied[-1] = speed, force
    found = []
    for _ in range(count):
        before = state.copy()
        state.q = model.integrate(state.q, state.v, dt)
        system: SolidSystem | None = assemble(model, state, applied, dt, before)
        while system is not None:
            state.v = np.linalg.solve(system.A, system.impulse)
            system = system.updated(state.v)
        found.append((state.q.copy(), state.v.copy()))
    places, speeds = zip(*found, strict=True)
    return np.array(places), np.array(speeds)


@pytest.mark.parametrize("dt", [1e-4, 1e-3, 0.01, 0.03])
@pytest.mark.parametrize("speed", [-40.0, -0.3, 0.3, 40.0])
def test_a_fast_joint_reaches_its_stop_and_does_not_pass_it(dt: float, speed: float) -> None:
    """Before, it passed the stop by speed * 20 ms / e: 17 degrees at 40 rad/s."""
    model = SolidModel.from_string(WHEEL.format(stop=""), gravity=(0.0, 0.0, 0.0))
    stop = np.sign(speed) * np.radians(45.0)
    if abs(speed) * dt > abs(stop):
        return  # it is past the stop after its first step, in which nothing is known of it
    count = int(abs(stop / speed) / dt) + 8
    places, speeds = moved(model, speed, 0.0, dt, count)
    beyond = np.sign(speed) * (places[:, 0] - stop)
    assert beyond.max() < 0.05 * abs(speed) * dt
    free = beyond < -abs(speed) * dt
    np.testing.assert_allclose(speeds[free, 0], speed, rtol=1e-12)
    assert abs(beyond[-1]) < 0.05 * abs(speed) * dt
    assert abs(speeds[-1, 0]) < 0.05 * abs(speed)


def test_a_stop_carries_what_pushes_against_it() -> None:
    """Under 50 N a slider of 2 kg comes to rest at its stop, deeper by F / (D K) than that: with
    MuJoCo's impedance d from 0.9 to 0.95, D = m d / (1 - d) and K = d / (2 dt 0.95)^2."""
    model = SolidModel.from_string(SLIDER, gravity=(0.0, 0.0, 0.0))
    arrival = np.sqrt(2.0 * 25.0 * 0.3)
    for dt in (1e-3, 4e-3):
        places, speeds = moved(model, 0.0, 50.0, dt, 400)
        assert places.max() - 0.3 < 0.05 * arrival * dt
        assert abs(speeds[-1, 0]) < 1e-9
        deep = 25.0 * (2.0 * dt * 0.95) ** 2 * (1.0 - 0.9) / 0.9**2
        assert places[-1, 0] - 0.3 == pytest.approx(deep, rel=0.06)


def test_a_ball_joint_stays_in_its_cone() -> None:
    model = SolidModel.from_string(BALL, gravity=(0.0, 0.0, 0.0))
    dt, speed = 1e-3, 20.0
    places, _ = moved(model, speed, 0.0, dt, 60)
    angles = 2.0 * np.arccos(np.clip(places[:, 0], -1.0, 1.0))
    assert np.degrees(angles.max() - speed * 2.0 * dt) < 30.0


def test_a_softer_stop_of_the_model_is_kept() -> None:
    """A critically damped spring of time constant T is passed by speed T / e, here 0.37 rad."""
    model = SolidModel.from_string(
        WHEEL.format(stop='solreflimit=".1 1" solimplimit=".999 .999 .001"'),
        gravity=(0.0, 0.0, 0.0),
    )
    places, _ = moved(model, 10.0, 0.0, 1e-4, 4000)
    assert places.max() - np.radians(45.0) == pytest.approx(10.0 * 0.1 / np.e, rel=0.01)


def test_a_drive_of_limited_torque_ends_at_its_stop() -> None:
    """It pushes on with its limit, 0.5 N m, where the stop keeps it from its velocity."""
    model = SolidModel.from_string(WHEEL.format(stop=""), gravity=(0.0, 0.0, 0.0))
    state, limit, none, dt = model.rest(), np.array([0.5]), np.zeros(1), 1e-3
    state.v[0], command = 5.0, JointCommand.none(1)
    command.set(np.array([0]), 5.0, 5.0, 0.5)
    for _ in range(400):
        before = state.copy()
        state.q = model.integrate(state.q, state.v, dt)
        turns = drive(model, state, none, dt, before, command)
        found: Driven | None = turns
        while found is not None:
            turns, v = found, found.velocity
            found = turns.updated(v) or within_limits(turns, limit, v, turns.actuator(v, none))
        state.v = turns.velocity
        assert state.q[0] < np.radians(45.0) + 0.05 * 5.0 * dt
    assert state.q[0] == pytest.approx(np.radians(45.0), abs=1e-4)
    assert abs(state.v[0]) < 1e-9
    np.testing.assert_allclose(turns.actuator(state.v, none), limit)


def test_stops_of_exact_drives_stay_as_they_are() -> None:
    """A drive of any force passes the stop; a stiffer one would only add to its torque."""
    model = SolidModel.from_string(WHEEL.format(stop=""), gravity=(0.0, 0.0, 0.0))
    state = SolidState(np.array([np.radians(44.0)]), np.array([20.0]))
    exact = np.array([True])
    assert assemble(model, state, np.zeros(1), 1e-3, exact=exact).rows is None
    free = assemble(model, state, np.zeros(1), 1e-3).rows
    assert free is not None
    gap = np.radians(1.0)
    assert free.aref[0] == pytest.approx((20.0 - gap / 1e-3) / 1e-3)
    state.q[0] = np.radians(46.0)
    stiff = assemble(model, state, np.zeros(1), 1e-3).rows
    soft = assemble(model, state, np.zeros(1), 1e-3, exact=exact).rows
    assert stiff is not None
    assert soft is not None
    assert stiff.aref[0] > 5.0 * soft.aref[0]
