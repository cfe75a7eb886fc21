"""R1: the comparison by what is known of the measured runs, and the robot on a coarse grid."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from flowborne_validation import rexeel
from flowborne_validation.cases import case
from flowborne_validation.rexeel import (
    LINK_LENGTH,
    MASS,
    TIMES,
    mass_centre,
    measured,
    rmse,
    scatter,
    table,
)

swim = cache(rexeel.swim)
"""Each swim once for all tests."""

STILL = {20: [2.367, 17.360, 3.699, 16.741, 17.093], 40: [5.064, 30.963, 6.584, 28.579, 31.261]}
"""Errors of a robot that does not move at all. Genesis' head never turns: the last is published."""

MEAN = {20: [0.909, 0.957, 1.023, 0.964, 1.328], 40: [1.396, 0.767, 1.446, 0.765, 2.147]}
"""Errors of the mean of all runs."""


@pytest.mark.parametrize(("amplitude", "count"), [(20, 20), (40, 19)])
def test_R1_errors_of_known_trajectories(amplitude: int, count: int) -> None:
    runs = measured(amplitude)
    assert len(runs) == count
    np.testing.assert_allclose(rmse(np.zeros((len(TIMES), 5)), runs), STILL[amplitude], atol=5.1e-4)
    np.testing.assert_allclose(scatter(runs), MEAN[amplitude], atol=5.1e-4)


def test_mass_centre_of_a_straight_and_of_a_bent_robot() -> None:
    middles = np.cumsum(LINK_LENGTH) - 0.5 * LINK_LENGTH - 6.0
    straight = MASS @ middles / MASS.sum()
    head, joints = np.array([[1.0, 2.0, -90.0]]), np.zeros((1, 5))
    np.testing.assert_allclose(mass_centre(head, joints), [[1.0, 2.0 - straight]], atol=1e-12)
    joints[0, 0] = 90.0
    behind = MASS[1:] @ (middles[1:] - 6.0) / MASS.sum()
    down = 6.0 * MASS[1:].sum() / MASS.sum()
    np.testing.assert_allclose(mass_centre(head, joints), [[1.0 + behind, 2.0 - down]], atol=1e-12)


def test_motors_follow_the_gait_a_fortieth_of_a_second_late() -> None:
    log = table("motor_angles_20deg")
    joint = np.arange(1, 6)
    for kind, late, within in (("target", 0.0, 0.02), ("actual", 0.0275, 0.6)):
        t = log["time_s"][:, None] - late
        s = np.clip(t, 0.0, 1.0)
        gait = 20.0 * s**2 * (3.0 - 2.0 * s) * np.sin(2.0 * np.pi * (0.5 * t - 0.14 * joint))
        angles = np.stack([log[f"{kind}_{n}"] for n in joint], axis=1)
        assert np.abs(angles - gait).max() < within


def test_the_scenes_robot_has_the_links_of_the_measured_one() -> None:
    """Mass centre by the model, whose masses have four digits, and by the published ones."""
    path, _ = swim(20, 61, scene="eel")
    t, head = TIMES[:, None], path[:, 2:]
    s = np.minimum(t, 1.0)
    gait = 20.0 * s**2 * (3.0 - 2.0 * s) * np.sin(2.0 * np.pi * (0.5 * t - 0.14 * np.arange(1, 6)))
    to_tail = np.column_stack([head[:, :2], head[:, 2] - 90.0])
    np.testing.assert_allclose(path[:, :2], mass_centre(to_tail, gait), atol=2e-4)


def test_R1_robot_swims_nearer_to_the_real_one_than_to_its_own_start(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(rexeel, "swim", swim)
    found = case("R1").judge(rexeel.compared(20, (61,)))
    for finding, still, least in zip(found, STILL[20], MEAN[20], strict=True):
        assert isinstance(finding.value, float)
        assert least < finding.value < 0.8 * still, finding.quantity
        assert f"mean of the 20 runs {least:.3f}" in finding.lines[-1]
