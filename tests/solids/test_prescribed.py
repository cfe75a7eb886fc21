"""Prescribed dofs: exact velocities, torques read off, torque limits."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from flowborne.solids.driven import drive, within_limits
from flowborne.solids.dynamics import assemble, kinematics
from flowborne.solids.model import SolidModel, SolidState
from flowborne.solids.prescribed import PrescribedSystem, prescribe
from flowborne.solids.trajectories import JointCommand

from .held_pose import holding

CREATURE = SolidModel.from_string("""<mujoco><worldbody><geom type="plane" size="5 5 .1"/>
<body pos="0 0 .15"><freejoint name="root"/><geom type="box" size=".3 .2 .1" mass="2"/>
<body pos=".3 0 0"><joint name="j1" axis="0 1 0" range="-20 20"/>
<geom type="capsule" fromto="0 0 0 .4 0 0" size=".08" mass="1"/>
<body pos=".4 0 0"><joint name="j2" axis="0 1 0" damping=".1"/>
<geom type="capsule" fromto="0 0 0 .4 0 0" size=".08" mass="1"/></body></body></body></worldbody>
</mujoco>""")


def settled(driven: PrescribedSystem, impulse: np.ndarray) -> tuple[PrescribedSystem, np.ndarray]:
    for _ in range(30):
        v_plus = driven.after(impulse)
        changed = driven.updated(v_plus)
        if changed is None:
            return driven, v_plus
        driven = changed
    raise AssertionError("the active set did not settle")


@given(seed=st.integers(0, 10_000), which=st.lists(st.booleans(), min_size=8, max_size=8))
@settings(max_examples=60, deadline=None)
def test_targets_are_met_and_the_drives_balance(seed: int, which: list[bool]) -> None:
    """Exact targets under gravity, contact, limits and any impulse; A v+ = r + impulse + drives."""
    model, dt, rng = CREATURE, 0.01, np.random.default_rng(seed)
    rest = model.rest()
    q = model.integrate(rest.q, 0.2 * rng.normal(size=model.nv), 1.0)
    state = SolidState(q, rng.normal(size=model.nv))
    prescribed, hold = np.array(which), rng.normal(size=model.nv)
    impulse = rng.normal(size=model.nv)
    driven = prescribe(assemble(model, state, np.zeros(model.nv), dt), prescribed, hold)
    driven, v_plus = settled(driven, impulse)
    np.testing.assert_array_equal(v_plus[prescribed], hold[prescribed])
    actuator = driven.actuator(v_plus, impulse)
    assert np.all(actuator[~prescribed] == 0.0)
    system = driven.system
    scale = 1.0 + np.abs(system.A).max() * (1.0 + np.abs(v_plus).max())
    np.testing.assert_allclose(
        system.A @ v_plus, system.impulse + impulse + dt * actuator, atol=1e-12 * scale
    )
    np.testing.assert_array_equal(driven.inverse, driven.inverse.T)
    assert np.all(driven.inverse[prescribed] == 0.0)


def test_nothing_prescribed_is_the_free_solution() -> None:
    model = CREATURE
    state = model.rest()
    system = assemble(model, state, np.zeros(model.nv), 0.01)
    driven = prescribe(system, np.zeros(model.nv, bool), np.zeros(model.nv))
    np.testing.assert_allclose(
        driven.velocity, np.linalg.solve(system.A, system.impulse), atol=1e-12
    )


def test_everything_prescribed_has_no_answer_to_the_fluid() -> None:
    model = CREATURE
    system = assemble(model, model.rest(), np.zeros(model.nv), 0.01)
    driven = prescribe(system, np.ones(model.nv, bool), np.full(model.nv, 0.1))
    assert np.all(driven.inverse == 0.0)
    np.testing.assert_array_equal(driven.after(np.ones(model.nv)), np.full(model.nv, 0.1))


def test_a_weak_drive_pushes_with_its_limit() -> None:
    """Of two driven joints one is too weak: it gives way and uses exactly its limit."""
    model, dt = CREATURE, 0.01
    state, none = model.rest(), np.zeros(model.nv)
    state.q[2] = 3.0
    prescribed = np.array([False] * 6 + [True, True])
    hold = np.array([0.0] * 6 + [0.3, -4.0])
    limit = np.array([np.inf] * 6 + [np.inf, 0.5])
    driven = prescribe(assemble(model, state, none, dt), prescribed, hold)
    driven, v_plus = settled(driven, none)
    weak = within_limits(driven, limit, v_plus, driven.actuator(v_plus, none))
    assert weak is not None
    weak, v_plus = settled(weak, none)
    actuator = weak.actuator(v_plus, none)
    np.testing.assert_array_equal(weak.limited, [False] * 7 + [True])
    assert actuator[7] == -0.5
    assert v_plus[6] == 0.3
    assert -4.0 < v_plus[7] < 0.0
    applied = assemble(model, state, np.array([0.0] * 7 + [-0.5]), dt)
    alone = prescribe(applied, weak.prescribed, hold)
    np.testing.assert_allclose(settled(alone, none)[1], v_plus, atol=1e-12)
    assert within_limits(weak, limit, v_plus, actuator) is None


def test_drives_below_their_limits_keep_their_velocities() -> None:
    model = CREATURE
    prescribed = np.array([False] * 6 + [True, True])
    system = assemble(model, model.rest(), np.zeros(model.nv), 0.01)
    driven = prescribe(system, prescribed, np.zeros(model.nv))
    actuator = np.array([9.0] * 6 + [0.9, -0.9])
    assert within_limits(driven, np.ones(model.nv), np.zeros(model.nv), actuator) is None


def test_singular_matrix_is_refused() -> None:
    system = assemble(CREATURE, CREATURE.rest(), np.zeros(8), 0.01)
    flat = system.A.copy()
    flat[3] = flat[:, 3] = 0.0
    broken = replace(system, A=flat)
    with pytest.raises(ValueError, match="not positive definite at free dof 3"):
        prescribe(broken, np.zeros(8, bool), np.zeros(8))


@given(seed=st.integers(0, 10_000))
@settings(max_examples=60, deadline=None)
def test_every_drive_holds_or_pushes_short_of_its_velocity(seed: int) -> None:
    """The complementarity of velocities and limits, whatever the drives and limits are."""
    random = np.random.default_rng(seed)
    model, none = CREATURE, np.zeros(8)
    state = model.rest()
    state.q[2] = 3.0
    prescribed = random.random(8) < 0.8
    hold, limit = random.normal(size=8), np.exp(random.normal(2.0, 2.0, 8))
    driven = prescribe(assemble(model, state, none, 0.01), prescribed, hold)
    for _ in range(100):
        v_plus = driven.after(none)
        force = driven.actuator(v_plus, none)
        changed = within_limits(driven, limit, v_plus, force) or driven.updated(v_plus)
        if changed is None:
            break
        driven = changed
    assert changed is None, "the drives did not settle"
    assert np.all(np.abs(force) <= limit * (1.0 + 1e-8))
    kept = prescribed & ~driven.limited
    np.testing.assert_array_equal(v_plus[kept], hold[kept])
    short = np.sign(force) * (hold - v_plus)
    assert np.all(short[driven.limited] >= -1e-8)
    assert np.all(force[~prescribed] == 0.0)


LINKS, LENGTH, G = 4, 0.7, 9.81


def chain() -> SolidModel:
    xml = ""
    for k in reversed(range(LINKS)):
        place = LENGTH if k else 0.0
        xml = f"""<body pos="{place} 0 0"><joint axis="0 0 1"/><geom type="box"
        size="{LENGTH / 2} {0.05 + 0.01 * k} .1" pos="{LENGTH / 2} 0 0"/>{xml}</body>"""
    return SolidModel.from_string(
        f"<mujoco><worldbody>{xml}</worldbody></mujoco>", slab=True, gravity=(0.0, -G, 0.0)
    )


def statics(model: SolidModel, q: np.ndarray, force_y: np.ndarray) -> np.ndarray:
    """tau_k = -sum over i >= k of (x_i - x_k) F_i, the forces acting at the boxes' middles."""
    pose = kinematics(model, q)
    joint, middle = pose.body_position[1:, 0], pose.geom_position[:, 0]
    return np.array([-((middle[k:] - joint[k]) * force_y[k:]).sum() for k in range(LINKS)])


@pytest.mark.parametrize("dt", [1e-3, 0.05])
def test_A3_static_chain(dt: float) -> None:
    """Within 1e-6 m g L, whatever the angles and the time step."""
    model = chain()
    rng = np.random.default_rng(0)
    for _ in range(5):
        state = SolidState(rng.uniform(-2, 2, LINKS), np.zeros(LINKS))
        tau = holding(model, state, np.zeros(LINKS), dt)
        expected = statics(model, state.q, -G * model.body_mass[1:])
        np.testing.assert_allclose(tau, expected, atol=1e-6 * model.body_mass.sum() * G * LENGTH)


def test_A3_static_chain_in_fluid_at_rest() -> None:
    """Archimedes' force as an applied one: m becomes (rho_s - rho_f) V."""
    model, fluid = chain(), 1300.0
    state = SolidState(np.array([0.3, -0.8, 1.1, 0.4]), np.zeros(LINKS))
    pose = kinematics(model, state.q)
    force = np.zeros((model.nbody, 3))
    force[:, 1] = fluid * model.volume * G
    wrench = np.concatenate([force, np.cross(pose.centroid, force)], axis=1)
    applied = np.einsum("bij,bi->j", pose.twist_jacobian, wrench)
    tau = holding(model, state, applied, 0.01)
    expected = statics(model, state.q, (fluid - 1000.0) * model.volume[1:] * G)
    np.testing.assert_allclose(tau, expected, atol=1e-6 * model.body_mass.sum() * G * LENGTH)


def test_A3_zero_effort_when_the_weight_hangs_below() -> None:
    """Hanging straight down, and balanced straight up: no joint works."""
    model = chain()
    for angle in (-np.pi / 2, np.pi / 2):
        tau = holding(model, SolidState(np.array([angle, 0, 0, 0]), np.zeros(4)), np.zeros(4), 0.01)
        np.testing.assert_allclose(tau, 0.0, atol=1e-10 * model.body_mass.sum() * G * LENGTH)


def test_holding_some_joints_lets_the_others_fall() -> None:
    """The force found, applied as a motor's, leaves the held joint's velocity as it is."""
    model, dt = chain(), 0.01
    state = SolidState(np.array([0.3, -0.8, 1.1, 0.4]), np.array([0.5, -1.0, 0.2, 2.0]))
    tau = holding(model, state, np.zeros(4), dt, dofs=np.array([1]))
    assert np.count_nonzero(tau) == 1
    system = assemble(model, state, tau, dt)
    v_plus = np.linalg.solve(system.A, system.impulse)
    assert v_plus[1] == pytest.approx(-1.0, abs=1e-12)
    assert np.abs(v_plus - state.v)[[0, 2, 3]].min() > 1e-3


def test_holding_against_centrifugal_force() -> None:
    """A bent arm whose shoulder turns: the elbow holds m r x omega^2 with omega = 3."""
    model = SolidModel.from_string(
        """<mujoco><worldbody><body><joint axis="0 0 1"/><geom type="box" size=".5 .1 .1"
        pos=".5 0 0"/><body pos="1 0 0"><joint axis="0 0 1"/><geom type="sphere" size=".001"
        pos="1 0 0" mass="2"/></body></body></worldbody></mujoco>""",
        slab=True,
        gravity=(0.0, 0.0, 0.0),
    )
    state = SolidState(np.array([0.2, np.pi / 2]), np.array([3.0, 0.0]))
    tau = holding(model, state, np.zeros(2), 0.01)
    np.testing.assert_allclose(tau, [0.0, 2.0 * 1.0 * 1.0 * 9.0], atol=1e-9)


@given(seed=st.integers(0, 10_000), which=st.lists(st.booleans(), min_size=8, max_size=8))
@settings(max_examples=40, deadline=None)
def test_bodies_under_another_force_are_those_made_anew(seed: int, which: list[bool]) -> None:
    """To the bit, with dampers and Coriolis forces; not on the floor, whose rows differ."""
    model, dt, rng = CREATURE, 0.01, np.random.default_rng(seed)
    rest, given, command = model.rest(), np.array(which), JointCommand.none(model.nv)
    low, hold = 0.1 * rng.normal(size=model.nv), rng.normal(size=model.nv)
    command.set(given, hold[given], hold[given])
    high = low + np.array([0.0, 0.0, 5.0, *np.zeros(model.nv - 3)])
    forces, v = rng.normal(size=(2, model.nv)), rng.normal(size=model.nv)
    for shift, free in ((low, False), (high, True)):
        before = SolidState(model.integrate(rest.q, shift, 1.0), v)
        state = SolidState(model.integrate(before.q, v, dt), v)
        driven = [drive(model, state, f, dt, before, command) for f in forces]
        driven[0].updated(driven[0].velocity + 0.1)
        again = driven[0].under(forces[1])
        assert (again is None) == (not free and driven[0].system.rows is not None)
        for end in (hold, v, again.velocity) if again is not None else ():
            np.testing.assert_array_equal(again.velocity, driven[1].velocity)
            np.testing.assert_array_equal(again.actuator(end, v), driven[1].actuator(end, v))
            for one, other in zip(
                again.system.own_at(end), driven[1].system.own_at(end), strict=True
            ):
                np.testing.assert_array_equal(one, other)
