"""Pendulums against their textbook solutions, in the package's time scheme."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from flowborne.solids.dynamics import kinematics
from flowborne.solids.model import SolidModel, SolidState
from flowborne.solids.momentum import halfway_momentum, kinetic_energy, potential_energy

Advance = Callable[..., tuple[SolidState, object]]
LENGTH, WIDTH, G = 1.2, 0.3, 9.81

BLOCK = f"""<mujoco><worldbody><body><joint axis="0 0 1"/>
<geom type="box" size="{WIDTH / 2} {LENGTH / 2} .1" pos="0 {-LENGTH / 2} 0"/></body></worldbody>
</mujoco>"""

DOUBLE = """<mujoco><worldbody><body><joint axis="0 0 1"/>
<geom type="sphere" size=".001" pos="0 -1 0" mass="1"/><body pos="0 -1 0"><joint axis="0 0 1"/>
<geom type="sphere" size=".001" pos="0 -1 0" mass="1"/></body></body></worldbody></mujoco>"""

BLOCK_T0 = 2 * np.pi * np.sqrt((LENGTH**2 / 3 + WIDTH**2 / 12) / (G * LENGTH / 2))
"""Small period of a block hung at the middle of its short edge."""


def zero_crossings(angle: np.ndarray, dt: float) -> np.ndarray:
    k = np.flatnonzero(angle[:-1] * angle[1:] < 0)
    return dt * (k + angle[k] / (angle[k] - angle[k + 1]))


def swing(advance: Advance, amplitude: float, dt: float, periods: float) -> float:
    """Measured period of the block as a slab."""
    model = SolidModel.from_string(BLOCK, slab=True, gravity=(0.0, -G, 0.0))
    state = model.rest()
    state.q[0] = amplitude
    angles = [amplitude]
    for _ in range(int(periods * BLOCK_T0 / dt)):
        state, _ = advance(model, state, dt)
        angles.append(state.q[0])
    times = zero_crossings(np.array(angles), dt)
    return 2.0 * float(np.diff(times).mean())


@pytest.mark.parametrize(
    ("degrees", "ratio"), [(10, 1.001907), (45, 1.039973), (90, 1.180341), (150, 1.762204)]
)
def test_A1_period_at_amplitude(advance: Advance, degrees: float, ratio: float) -> None:
    """Within 0.1 % at 180 steps in the small period."""
    period = swing(advance, np.radians(degrees), BLOCK_T0 / 180, 4.2 * ratio)
    assert period / BLOCK_T0 == pytest.approx(ratio, rel=1e-3)


@pytest.mark.parametrize(("kick", "order"), [(0.5, 2.0), (0.0, 1.0)])
def test_A1_order_of_the_time_scheme(advance: Advance, kick: float, order: float) -> None:
    """Angle after a fixed time from 90 degrees, against the same with 20 times the steps.

    The velocity belongs to the middle of the coming step. Given as such (half a step of the first
    acceleration) the scheme is second order; taken as the velocity at the start it is first order.
    """
    model = SolidModel.from_string(BLOCK, slab=True, gravity=(0.0, -G, 0.0))
    first = -G * LENGTH / 2 / (LENGTH**2 / 3 + WIDTH**2 / 12)
    seconds = 1.3

    def angle(count: int, share: float) -> float:
        dt = seconds / count
        state = SolidState(np.array([np.pi / 2]), np.array([share * dt * first]))
        for _ in range(count):
            state, _ = advance(model, state, dt)
        return float(state.q[0])

    counts = np.array([40, 80, 160, 320])
    exact = angle(6400, 0.5)
    errors = [abs(angle(int(n), kick) - exact) for n in counts]
    slope = -np.polyfit(np.log(counts), np.log(errors), 1)[0]
    assert abs(slope - order) < 0.1, f"order {slope:.2f}, errors {errors}"
    assert errors[-1] < (1e-4 if kick else 2e-2)


@pytest.mark.parametrize(("sign", "frequency"), [(1, 0.765367), (-1, 1.847759)])
def test_A2_modes(advance: Advance, sign: int, frequency: float) -> None:
    """Equal masses and lengths: omega^2 = (g/L)(2 -+ sqrt 2), second angle +-sqrt 2 the first."""
    model = SolidModel.from_string(DOUBLE, slab=True, gravity=(0.0, -G, 0.0))
    state, dt = model.rest(), 0.01
    first = 0.005
    state.q[:] = first, first * (sign * np.sqrt(2) - 1)
    angles = [state.q.copy()]
    for _ in range(int(2.6 * 2 * np.pi / (frequency * np.sqrt(G)) / dt)):
        state, _ = advance(model, state, dt)
        angles.append(state.q.copy())
    first_angle, relative = np.array(angles).T
    times = zero_crossings(first_angle, dt)
    assert np.pi / np.diff(times).mean() == pytest.approx(frequency * np.sqrt(G), rel=1e-3)
    np.testing.assert_allclose(
        first_angle + relative, sign * np.sqrt(2) * first_angle, atol=0.02 * first
    )


def energy_drift(advance: Advance, dt: float, seconds: float, amplitude: float) -> float:
    """Change of the mean energy from the first to the last tenth, relative to the start's."""
    model = SolidModel.from_string(DOUBLE, slab=True, gravity=(0.0, -G, 0.0))
    state = model.rest()
    state.q[:] = amplitude, 0.8 * amplitude
    lowest = potential_energy(model, model.rest())
    start = potential_energy(model, state) - lowest
    energies = []
    for k in range(int(seconds / dt)):
        state, _ = advance(model, state, dt)
        if k % 5 == 0:
            half = SolidState(model.integrate(state.q, state.v, dt / 2), state.v)
            energies.append(kinetic_energy(model, half) + potential_energy(model, half) - lowest)
    tenth = len(energies) // 10
    return float(np.mean(energies[-tenth:]) - np.mean(energies[:tenth])) / start


def test_A2_energy_over_100_periods(advance: Advance) -> None:
    """100 periods of 2 s at 100 steps each; the bias forces are centred by a second solve."""
    drift = energy_drift(advance, 0.02, 200.0, 0.5)
    assert abs(drift) < 1e-3, f"energy drifted by {drift:.1e}"


def test_A2_energy_of_wild_swings(advance: Advance) -> None:
    """Swings to 155 degrees from straight down need short steps."""
    drift = energy_drift(advance, 0.005, 10.0, 1.5)
    assert abs(drift) < 2e-3, f"energy drifted by {drift:.1e}"


def test_A2_joints_hold_and_the_pivot_turns_the_angular_momentum(advance: Advance) -> None:
    """dL/dt about the pivot is the torque of gravity; the link stays at its length."""
    model = SolidModel.from_string(DOUBLE, slab=True, gravity=(0.0, -G, 0.0))
    state, dt = model.rest(), 0.005
    state.q[:] = 0.8, 0.4
    start = halfway_momentum(model, state, dt)[1, 2]
    turned = 0.0
    for _ in range(100):
        state, _ = advance(model, state, dt)
        centres = kinematics(model, state.q).mass_centre
        turned += dt * -G * centres[1:, 0].sum()
        assert np.linalg.norm(centres[2] - kinematics(model, state.q).body_position[2]) == (
            pytest.approx(1.0, abs=1e-12)
        )
    assert halfway_momentum(model, state, dt)[1, 2] - start == pytest.approx(turned, rel=1e-9)
