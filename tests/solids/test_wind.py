"""Simple winds: cases K1 to K3 as forces."""

from __future__ import annotations

import pickle
from dataclasses import dataclass

import mujoco
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from flowborne.coupling.step import step
from flowborne.coupling.world import Setup, World
from flowborne.solids.dynamics import kinematics
from flowborne.solids.following import follow
from flowborne.solids.model import SolidModel
from flowborne.solids.momentum import momentum
from flowborne.solids.tissue.growth import Tissue, add_flesh
from flowborne.solids.wind import Wind, WindFaces, WindForce
from flowborne_validation.flesh_bars import bar_mesh

LENGTH, WIDTH, RHO, SPEED = 2.0, 0.4, 1.3, 5.0

BLOCK = SolidModel.from_string(
    f"""<mujoco><worldbody><body name="block"><joint axis="0 0 1"/><geom type="box"
    size="{LENGTH / 2} {WIDTH / 2} .1" pos="{LENGTH / 2} 0 0"/><body name="end" pos="9 9 0">
    <joint axis="0 0 1"/><geom type="sphere" size=".1"/></body></body></worldbody></mujoco>""",
    slab=True,
)


def wrench(wind: Wind, angle: float, v: np.ndarray | None = None) -> np.ndarray:
    pose = kinematics(BLOCK, np.array([angle, 0.0]))
    return wind.wrench(BLOCK, pose, np.zeros(2) if v is None else v, 0.0)


@given(phi=st.floats(-np.pi, np.pi), beta=st.floats(-np.pi, np.pi))
@settings(max_examples=40, deadline=None)
def test_K3_drag_of_a_block_at_any_angle(phi: float, beta: float) -> None:
    """D = 2 rho U^2 (L |sin phi|^3 + w |cos phi|^3), phi between block and wind, in any wind."""
    blow = np.array([np.cos(beta), np.sin(beta), 0.0])
    wind = WindFaces(tuple(SPEED * blow), RHO, ("block",))
    drag = wrench(wind, phi + beta)[1, :3] @ blow
    expected = LENGTH * np.abs(np.sin(phi)) ** 3 + WIDTH * np.abs(np.cos(phi)) ** 3
    assert drag == pytest.approx(2 * RHO * SPEED**2 * expected, rel=1e-12)


@pytest.mark.parametrize("psi", [0.0, 0.3, 1.0])
def test_K2_normal_force_of_both_long_faces(psi: float) -> None:
    """Hanging at psi from straight down in a wind along x: 2 rho U^2 L cos^2 psi."""
    total = wrench(WindFaces((SPEED, 0.0, 0.0), RHO, ("block",)), psi - np.pi / 2)[1]
    normal = np.array([np.cos(psi), np.sin(psi), 0.0])
    assert total[:3] @ normal == pytest.approx(
        2 * RHO * SPEED**2 * LENGTH * np.cos(psi) ** 2, rel=1e-12
    )
    assert total[5] == pytest.approx(RHO * SPEED**2 * LENGTH**2 * np.cos(psi) ** 2, rel=1e-12)


def test_turning_block_feels_its_own_speed() -> None:
    """No wind, angular velocity w: each long face -rho w^2 L^4 / 4 about the hinge, in patches."""
    w = 3.0
    torque = wrench(WindFaces((0.0, 0.0, 0.0), RHO, ("block",)), 0.7, np.array([w, 0.0]))[1, 5]
    thin = 2 * RHO * w**2 * LENGTH**4 / 4
    end = RHO * w**2 * (WIDTH / 2) ** 4 / 2
    assert torque == pytest.approx(-(thin + 2 * end), rel=1e-2)


def test_moving_with_the_wind_feels_nothing() -> None:
    model = SolidModel.from_string(
        "<mujoco><worldbody><body><freejoint/><geom size='.2'/></body></worldbody></mujoco>"
    )
    v = np.array([1.0, 2.0, 3.0, 0.0, 0.0, 0.0])
    force = WindFaces((1.0, 2.0, 3.0), RHO).wrench(model, kinematics(model, model.rest().q), v, 0.0)
    np.testing.assert_allclose(force, 0.0, atol=1e-25)


def test_K1_uniform_force_acts_at_the_centre_of_mass() -> None:
    angle, force = 0.4, (3.0, 1.0, 0.0)
    total = wrench(WindForce(force), angle)
    arm = LENGTH / 2 * np.array([np.cos(angle), np.sin(angle), 0.0])
    np.testing.assert_allclose(total[1], [*force, *np.cross(arm, force)], atol=1e-12)
    np.testing.assert_array_equal(total[0], 0.0)


def test_bodies_are_chosen_by_name() -> None:
    assert np.all(wrench(WindForce((1.0, 0.0, 0.0), ("end",)), 0.0)[1] == 0.0)
    assert np.all(wrench(WindFaces((1.0, 0.0, 0.0), RHO, ("block",)), 0.0)[2] == 0.0)
    with pytest.raises(ValueError, match="the model has no body 'ned'"):
        wrench(WindForce((1.0, 0.0, 0.0), ("ned",)), 0.0)


@dataclass(frozen=True)
class Shear:
    """Wind along x that grows with the height and with time."""

    rate: float

    def __call__(self, x: np.ndarray, time: float) -> np.ndarray:
        return np.stack([self.rate * x[:, 1] * (1 + time), 0 * time * x[:, 1], 0 * x[:, 1]], axis=1)


def test_field_is_taken_at_each_face() -> None:
    """Upright block in a shear from its hinge: 2 rho s^2 L^3/3 and the moment 2 rho s^2 L^4/4."""
    wind = pickle.loads(pickle.dumps(WindFaces(Shear(2.0), RHO, ("block",))))
    pose = kinematics(BLOCK, np.array([np.pi / 2, 0.0]))
    total = wind.wrench(BLOCK, pose, np.zeros(2), 0.5)[1]
    assert total[0] == pytest.approx(2 * RHO * 9.0 * LENGTH**3 / 3, rel=1e-2)
    assert total[5] == pytest.approx(-2 * RHO * 9.0 * LENGTH**4 / 4, rel=1e-2)


def bar() -> SolidModel:
    """Two bones with a ball each in a bar of flesh of 0.8 m x 0.4 m x 0.2 m, centred at x = 0.4."""
    spec = mujoco.MjSpec.from_string(
        """<mujoco><worldbody><body name="base"><freejoint/><geom size=".05" pos=".1 0 0"/>
        <body name="end" pos=".8 0 0"><joint/><geom size=".05" pos="-.1 0 0"/></body></body>
        </worldbody></mujoco>"""
    )
    points, elements = bar_mesh((4, 2, 2), (0.8, 0.4, 0.2))
    holders = ["base" if x < 0.1 else "end" if x > 0.7 else "" for x in points[:, 0]]
    grown = add_flesh(spec, "bar", points, elements, Tissue(1e4, 0.3, 1e3), holders)
    return SolidModel.with_flesh(spec, [grown], gravity=(0.0, 0.0, 0.0))


def test_K3_drag_of_a_bar_of_flesh_in_any_wind() -> None:
    """Each pair of its sides: 2 rho A (U.n)^2, and nothing on the bones inside."""
    model, blow = bar(), np.array([1.0, 2.0, -3.0])
    pose, wind = kinematics(model, model.rest().q), WindFaces((1.0, 2.0, -3.0), RHO)
    force = wind.on_flesh(model, pose, np.zeros(model.nv), 0.0)
    sides = np.array([0.4 * 0.2, 0.8 * 0.2, 0.8 * 0.4])
    np.testing.assert_allclose(force.sum(axis=0), 2 * RHO * sides * np.abs(blow) * blow, rtol=1e-9)
    assert model.geom_covered.all()
    assert not wind.wrench(model, pose, np.zeros(model.nv), 0.0).any()


def test_flesh_that_moves_with_the_wind_feels_nothing() -> None:
    model = bar()
    pose, v = kinematics(model, model.rest().q), np.zeros(model.nv)
    v[:3] = 1.0, 2.0, -3.0
    moving = follow(model, model.rest().q, v)
    force = WindFaces((1.0, 2.0, -3.0), RHO).on_flesh(model, pose, moving, 0.0)
    np.testing.assert_allclose(force, 0.0, atol=1e-20)


def test_bodies_share_the_wind_on_flesh() -> None:
    model = bar()
    pose, still = kinematics(model, model.rest().q), np.zeros(model.nv)
    every, base, end = (
        WindFaces((0.0, 0.0, 4.0), RHO, bodies).on_flesh(model, pose, still, 0.0)
        for bodies in (None, ("base",), ("end",))
    )
    np.testing.assert_allclose(base + end, every, atol=1e-12)
    assert base[:, 2].sum() == pytest.approx(end[:, 2].sum(), rel=0.05)


def test_a_step_in_wind_takes_the_momentum_that_the_wind_gives() -> None:
    """F dt on free flesh and bones, and the report has the same force."""
    model, dt = bar(), 1e-3
    world = World.at_rest(Setup(model, winds=(WindFaces((5.0, 0.0, 0.0), RHO),)))
    report = step(world, dt)
    force = report.wind_wrench[:, :3].sum(axis=0)
    assert force[0] == pytest.approx(2 * RHO * 0.08 * 25.0, rel=1e-3)
    gained = momentum(model, world.solid)[0]
    np.testing.assert_allclose(gained, dt * force, atol=1e-6 * dt * force[0])
