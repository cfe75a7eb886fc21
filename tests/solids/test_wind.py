"""Simple winds: cases K1 to K3 as forces."""

from __future__ import annotations

import pickle
from dataclasses import dataclass

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from flowborne.solids.dynamics import kinematics
from flowborne.solids.model import SolidModel
from flowborne.solids.wind import Wind, WindFaces, WindForce

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
