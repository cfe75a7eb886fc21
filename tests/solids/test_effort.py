"""Effort of a held chain, case A3."""

from __future__ import annotations

import numpy as np
import pytest

from flowborne.solids.dynamics import assemble, kinematics
from flowborne.solids.effort import holding
from flowborne.solids.model import SolidModel
from flowborne.solids.state import SolidState

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
