"""Assembly: the identities with MuJoCo, active sets, Jacobians, threads, momentum."""

from __future__ import annotations

import copy
import re
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor

import mujoco
import numpy as np
import pytest

from flowborne.solids.constraints import ACTIVE, FRICTION, OFF, PUSHED_UP, Rows
from flowborne.solids.dynamics import FULL_NEWTON_STEPS, SolidSystem, assemble, kinematics
from flowborne.solids.model import SolidModel, SolidState
from flowborne.solids.momentum import halfway_momentum, kinetic_energy, momentum, potential_energy

SPRINGS = """<mujoco><worldbody><body><joint axis="0 1 0" damping=".3"/>
<geom type="capsule" fromto="0 0 0 1 0 0" size=".1"/>
<body pos="1 0 0"><joint name="b" axis="0 1 .2" stiffness="5" springref="20" armature=".1"/>
<geom type="box" size=".3 .1 .1" pos=".3 0 0"/><body pos=".6 0 0"><joint name="c" axis="0 0 1"/>
<geom type="box" size=".3 .1 .1" pos=".3 0 0"/></body></body></body></worldbody>
<tendon><fixed><joint joint="c" coef="1"/></fixed>
<fixed stiffness="30" damping="2"><joint joint="b" coef="1"/><joint joint="c" coef="-.5"/>
</fixed></tendon></mujoco>"""

CROWD = """<mujoco><worldbody><geom type="plane" size="5 5 .1" pos="0 0 -.6"/>
<body pos="0 0 .1"><freejoint/><geom type="capsule" size=".1 .3" mass="3"/>
<body pos="0 0 .4"><joint type="ball" damping=".3" stiffness="2"/>
<geom type="box" size=".1 .2 .3" mass="2"/>
<body pos=".5 0 0"><joint axis="0 1 0" damping=".2" stiffness="5" springref="10" armature=".1"
range="-3 3" solreflimit=".019 1" frictionloss=".4"/><geom type="sphere" size=".2" mass="1"/>
</body></body></body>
</worldbody></mujoco>"""

SLAB = """<mujoco><worldbody><geom type="plane" size="9 9 .1" euler="-90 0 0" pos="0 -.2 0"/>
<body><joint type="slide" axis="1 0 0"/><joint type="slide" axis="0 1 0"/><joint axis="0 0 1"/>
<geom type="box" size=".3 .1 .1"/><body pos=".3 0 0">
<joint axis="0 0 1" range="-5 5" solreflimit=".019 1"/>
<geom type="capsule" fromto="0 0 0 .5 0 0" size=".1"/></body></body></worldbody></mujoco>"""

FLOATING = """<mujoco><worldbody><body><freejoint/><geom type="capsule" fromto="0 0 0 1 0 0"
size=".1"/><body pos="1 0 0"><joint type="ball"/><geom type="box" size=".4 .1 .05" pos=".4 0 0"/>
<body pos=".8 0 0"><joint axis="0 1 0" armature=".5"/><geom type="box" size=".4 .1 .05"
pos=".4 0 0"/></body></body></body></worldbody></mujoco>"""

PLANAR = """<mujoco><worldbody><body><joint type="slide" axis="1 0 0"/>
<joint type="slide" axis="0 1 0"/><joint axis="0 0 1"/><geom type="box" size=".3 .1 .1"/>
<body pos=".3 0 0"><joint axis="0 0 1"/><geom type="box" size=".3 .1 .1" pos=".3 0 0"/></body>
</body></worldbody></mujoco>"""


def tumbled(model: SolidModel, seed: int, speed: float = 1.0, far: float = 0.3) -> SolidState:
    rng = np.random.default_rng(seed)
    state = model.rest()
    state.q = model.integrate(state.q, rng.normal(size=model.nv), far)
    return SolidState(state.q, speed * rng.normal(size=model.nv))


def mujoco_step(model: SolidModel, state: SolidState, force: np.ndarray, dt: float) -> np.ndarray:
    """Velocity after MuJoCo's own step with contacts and limits, of average acceleration.

    Its step is A (v+ - v) = dt (f - dt K v) with A = M + dt D + dt^2 K. Here it has half the D and
    a quarter of the K, and what f lacks then is applied.
    """
    whole, soft = copy.copy(model.mj), copy.copy(model.mj)
    soft.jnt_stiffness[:] *= 0.25
    soft.tendon_stiffness[:] *= 0.25
    soft.dof_damping[:] *= 0.5
    soft.tendon_damping[:] *= 0.5

    forces = []
    for mj in (whole, soft):
        mj.opt.timestep = dt
        data = mujoco.MjData(mj)
        data.qpos[:], data.qvel[:] = state.q, state.v
        mujoco.mj_forward(mj, data)
        forces.append(np.array(data.qfrc_passive))
    lacking = forces[0] - forces[1] - data.efm_c  # -dt K v
    data = mujoco.MjData(soft)
    data.qpos[:], data.qvel[:], data.qfrc_applied[:] = state.q, state.v, force + lacking
    mujoco.mj_step(soft, data)
    return np.array(data.qvel)


@pytest.mark.parametrize("dt", [0.002, 0.013])
@pytest.mark.parametrize(
    ("xml", "slab"), [(SPRINGS, False), (CROWD, False), (SLAB, True), (FLOATING, False)]
)
def test_identity_with_mujoco_step(xml: str, slab: bool, dt: float) -> None:
    """A (v+ - v) = dt b gives the velocity of MuJoCo's own step, contacts and limits included.

    Rows are as stiff as the springs and dampers of MuJoCo's own step make them, so that the model
    with contacts has none.
    """
    if xml is CROWD:
        xml = re.sub(r' (stiffness|damping)="[^"]*"', "", xml)
    model = SolidModel.from_string(xml, slab=slab, gravity=(0.1, -5.0, -8.0))
    contacts = 0
    for seed in range(12):
        state = tumbled(model, seed)
        force = np.random.default_rng(seed + 99).normal(size=model.nv)
        system: SolidSystem | None = assemble(model, state, force, dt)
        while system is not None:
            last, v_plus = system, np.linalg.solve(system.A, system.impulse)
            system = system.updated(v_plus)
        expected = mujoco_step(model, state, force, dt)
        scale = 1.0 + np.abs(expected).max()
        np.testing.assert_allclose(v_plus, expected, rtol=0, atol=1e-11 * scale)
        np.testing.assert_allclose(last.A, last.A.T, atol=1e-12 * np.abs(last.A).max())
        assert np.linalg.eigvalsh(last.A)[0] > 0.0
        contacts += last.contacts
    if "plane" in xml:
        assert contacts > 3


def test_a_spring_loses_nothing_and_its_frequency_is_of_second_order() -> None:
    """tan(omega' dt / 2) = omega dt / 2: average acceleration, after ten periods."""
    model = SolidModel.from_string(
        """<mujoco><worldbody><body><joint type="slide" axis="1 0 0" stiffness="20"/>
        <geom size=".1" mass="2"/></body></worldbody></mujoco>""",
        gravity=(0.0, 0.0, 0.0),
    )
    omega = np.sqrt(10.0)
    for steps in (12, 60):
        dt = 2.0 * np.pi / omega / steps
        angle = 2.0 * np.arctan(0.5 * omega * dt)
        state = model.rest()
        state.q[0] = 0.01
        state.v[0] = 0.01 * (np.cos(angle) - 1.0) / dt
        for step in range(1, 10 * steps):
            state.q = model.integrate(state.q, state.v, dt)
            assert state.q[0] == pytest.approx(0.01 * np.cos(step * angle), abs=1e-12)
            system = assemble(model, state, np.zeros(1), dt)
            state.v = np.linalg.solve(system.A, system.impulse)


@pytest.mark.parametrize(("xml", "slab"), [(CROWD, False), (SLAB, True)])
@pytest.mark.parametrize("start", [OFF, ACTIVE, PUSHED_UP])
def test_updated_finds_mujocos_active_set(xml: str, slab: bool, start: int) -> None:
    model = SolidModel.from_string(xml, slab=slab, gravity=(0.1, -5.0, -8.0))
    for seed in range(12):
        state = tumbled(model, seed)
        right = assemble(model, state, np.zeros(model.nv), 0.01)
        wrong: SolidSystem | None = right._with(np.full(right.zones.shape, start), *right.smooth)
        rounds = 0
        while wrong is not None:
            system = wrong
            v_plus = np.linalg.solve(system.A, system.impulse)
            wrong = system.updated(v_plus)
            rounds += 1
            assert rounds < 15
        np.testing.assert_allclose(
            v_plus, np.linalg.solve(right.A, right.impulse), atol=1e-10 * (1 + np.abs(v_plus).max())
        )


BARE = """<mujoco><worldbody><geom type="plane" size="9 9 .1" condim="{floor}" friction="0"/>
<body pos="0 0 .049"><freejoint/><geom type="box" size=".2 .1 .05" condim="{box}" friction="0 0 0"/>
</body><body pos="1 0 .049"><freejoint/><geom type="box" size=".2 .1 .05" friction=".5"/></body>
</worldbody></mujoco>"""
"""Two boxes on a floor, one of them without friction."""


@pytest.mark.parametrize("condim", [3, 4, 6])
def test_contact_without_friction_is_that_of_condim_1(condim: int) -> None:
    """One row a contact, the same as MuJoCo's own for condim 1; other contacts keep theirs."""
    systems = []
    for box in (condim, 1):
        xml = BARE.format(floor=box, box=box).replace('friction="0"', 'friction="0 0 0"')
        model = SolidModel.from_string(xml, gravity=(0.0, 0.0, -9.81))
        state = tumbled(model, 3, speed=0.1, far=0.0)
        systems.append(assemble(model, state, np.zeros(model.nv), 0.01))
    (bare, plain), dofs = (system.rows for system in systems), slice(0, 6)
    assert bare is not None
    assert plain is not None
    own = [np.flatnonzero(np.abs(rows.J[:, dofs]).max(axis=1) > 0.0) for rows in (bare, plain)]
    assert len(own[0]) == len(own[1]) == 4
    for name in ("J", "D", "aref", "friction", "kind"):
        np.testing.assert_allclose(
            getattr(bare, name)[own[0]], getattr(plain, name)[own[1]], rtol=1e-9, atol=1e-12
        )
    assert len(bare.D) - len(own[0]) >= len(plain.D) - len(own[1]) == 16


def test_pushed_adds_a_force_and_keeps_the_rows() -> None:
    model = SolidModel.from_string(CROWD)
    state = tumbled(model, 5)
    force = np.random.default_rng(2).normal(size=model.nv)
    plain = assemble(model, state, np.zeros(model.nv), 0.01)
    pushed = plain.pushed(force)
    np.testing.assert_allclose(pushed.impulse, plain.impulse + 0.01 * force, atol=1e-12)
    np.testing.assert_array_equal(pushed.A, plain.A)


@pytest.mark.parametrize("xml", [CROWD, SPRINGS, FLOATING])
def test_twist_jacobian_is_mujocos_about_the_world_origin(xml: str) -> None:
    model = SolidModel.from_string(xml)
    state = tumbled(model, 3)
    pose = kinematics(model, state.q)
    data = mujoco.MjData(model.mj)
    data.qpos[:] = state.q
    mujoco.mj_forward(model.mj, data)
    for body in range(model.nbody):
        linear, angular = np.zeros((3, model.nv)), np.zeros((3, model.nv))
        mujoco.mj_jac(model.mj, data, linear, angular, np.zeros(3), body)
        np.testing.assert_allclose(
            pose.twist_jacobian[body], np.vstack([linear, angular]), atol=1e-13
        )


def test_twist_jacobian_moves_centroids() -> None:
    """Central differences of the centroids' places along the motion."""
    model = SolidModel.from_string(FLOATING)
    state = tumbled(model, 4)
    pose, h = kinematics(model, state.q), 1e-5
    ahead = kinematics(model, model.integrate(state.q, state.v, h)).centroid
    behind = kinematics(model, model.integrate(state.q, state.v, -h)).centroid
    twist = pose.twist_jacobian @ state.v
    velocity = twist[:, :3] + np.cross(twist[:, 3:], pose.centroid)
    np.testing.assert_allclose((ahead - behind)[1:] / (2 * h), velocity[1:], atol=1e-8)


def test_momentum_is_the_sum_over_bodies() -> None:
    model = SolidModel.from_string(FLOATING)
    state = tumbled(model, 6)
    pose = kinematics(model, state.q)
    twist = pose.twist_jacobian @ state.v
    total = np.zeros((2, 3))
    energy = 0.5 * 0.5 * state.v[-1] ** 2
    for b in range(1, model.nbody):
        rotation = np.empty(9)
        mujoco.mju_quat2Mat(rotation, model.mj.body_iquat[b])
        axes = pose.body_rotation[b] @ rotation.reshape(3, 3)
        inertia = axes @ np.diag(model.mj.body_inertia[b]) @ axes.T
        omega, c = twist[b, 3:], pose.mass_centre[b]
        velocity = twist[b, :3] + np.cross(omega, c)
        linear = model.body_mass[b] * velocity
        total += [linear, inertia @ omega + np.cross(c, linear)]
        energy += 0.5 * linear @ velocity + 0.5 * omega @ inertia @ omega
    np.testing.assert_allclose(momentum(model, state), total, rtol=1e-11)
    assert kinetic_energy(model, state) == pytest.approx(energy, rel=1e-11)


def test_potential_energy_is_weight_and_springs() -> None:
    model = SolidModel.from_string(SPRINGS, gravity=(0.0, 0.0, -3.0))
    state = tumbled(model, 7)
    pose, q = kinematics(model, state.q), state.q
    weight = 3.0 * model.body_mass @ pose.mass_centre[:, 2]
    bent = q[1] - np.radians(20)
    springs = 0.5 * 5.0 * bent**2 + 0.5 * 30.0 * (bent - 0.5 * q[2]) ** 2
    assert potential_energy(model, state) == pytest.approx(weight + springs, rel=1e-12)


@pytest.mark.parametrize(
    ("xml", "slab", "conserved"), [(FLOATING, False, 6), (PLANAR, False, 3), (PLANAR, True, 3)]
)
def test_A4_free_chain_with_motors_keeps_momentum(
    xml: str, slab: bool, conserved: int, advance: Callable[..., tuple[SolidState, object]]
) -> None:
    model = SolidModel.from_string(xml, slab=slab, gravity=(0.0, 0.0, 0.0))
    assert model.conserved.sum() == conserved
    state, dt = tumbled(model, 8, speed=0.5), 0.005
    state.v[model.locked] = 0.0
    start = halfway_momentum(model, state, dt)
    motor = np.zeros(model.nv)
    for k in range(60):
        motor[conserved:] = 20.0 * np.sin(0.2 * k + np.arange(model.nv - conserved))
        state, _ = advance(model, state, dt, motor)
    error = np.abs(halfway_momentum(model, state, dt) - start).max()
    scale = np.abs(start).max()
    assert error < 1e-10 * scale, f"momentum changed by {error / scale:.1e}"
    assert np.abs(momentum(model, state) - start).max() < 0.05 * scale


def test_weight_changes_the_momentum_of_a_free_chain(
    advance: Callable[..., tuple[SolidState, object]],
) -> None:
    model = SolidModel.from_string(FLOATING, gravity=(0.0, 0.0, -2.0))
    state, dt = tumbled(model, 9, speed=0.3), 0.005
    start = halfway_momentum(model, state, dt)
    for _ in range(20):
        state, _ = advance(model, state, dt)
    fallen = halfway_momentum(model, state, dt)[0] - start[0]
    weight = [0.0, 0.0, -2.0 * model.body_mass.sum()]
    np.testing.assert_allclose(
        fallen, np.multiply(weight, 20 * dt), atol=1e-9 * np.abs(start).max()
    )


def test_threads_with_different_steps_do_not_disturb_each_other() -> None:
    """The time step enters constraint references: many threads, many steps, the same numbers."""
    model = SolidModel.from_string(CROWD)
    cases = [(seed, 0.001 * (1 + seed % 7)) for seed in range(60)]

    def solve(case: tuple[int, float]) -> tuple[np.ndarray, np.ndarray]:
        system = assemble(model, tumbled(model, case[0]), np.zeros(model.nv), case[1])
        return system.A, system.impulse

    alone = [solve(case) for case in cases]
    with ThreadPoolExecutor(4) as pool:
        together = list(pool.map(solve, cases))
    for (A, r), (B, s) in zip(alone, together, strict=True):
        np.testing.assert_array_equal(A, B)
        np.testing.assert_array_equal(r, s)


def test_dry_friction_is_found_where_newton_jumps_over_it() -> None:
    """A row that sticks within 1e-4 of rest, with a push of a tenth of its friction: full steps of
    Newton's method and half ones go back and forth between both directions of slip."""
    rows = Rows(
        np.ones((1, 1)), np.array([1e4]), np.zeros(1), np.ones(1), np.array([FRICTION]), -np.ones(1)
    )
    A, push, still = np.ones((1, 1)), np.array([0.1]), np.zeros(1)
    slipping = push + rows.friction
    zones = np.array([PUSHED_UP])
    system = SolidSystem(A, slipping, 1.0, still, rows, zones, None, still, (A, push), still)
    v = slipping
    while (changed := system.updated(v)) is not None:
        system = changed
        v = np.linalg.solve(system.A, system.impulse)
        assert system.turns <= FULL_NEWTON_STEPS + 2
    assert v == pytest.approx(0.1 / (1.0 + 1e4))
