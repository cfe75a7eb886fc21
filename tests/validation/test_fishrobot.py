"""R2: the comparison by paths that are known, and the robot fish on a coarse grid."""

from __future__ import annotations

import numpy as np
import pytest

from flowborne_validation.cases import case
from flowborne_validation.fishrobot import (
    COUNTED,
    FRAMES,
    HEAD,
    SKIPPED,
    Swim,
    compared,
    gait,
    measured,
    table,
)

BEAT, SPEED, SWAY, YAW = 0.75, 0.08, 0.016, 0.13


def known(course: float, turning: float = 0.0) -> Swim:
    """A swim on a straight or bent course (rad, rad/s) with one harmonic of sway and yaw."""
    time = np.arange((SKIPPED + COUNTED) * FRAMES + 1) / (FRAMES * BEAT)
    toward = course + turning * time
    step = np.stack([-np.cos(toward), -np.sin(toward)], axis=1) * SPEED / (FRAMES * BEAT)
    path = np.concatenate([np.zeros((1, 2)), np.cumsum(step[1:], axis=0)])
    left = np.stack([np.sin(toward), -np.cos(toward)], axis=1)
    sway = SWAY * np.sin(2.0 * np.pi * BEAT * time)
    yaw = YAW * np.sin(2.0 * np.pi * BEAT * time + 1.0)
    return Swim(BEAT, path + sway[:, None] * left, toward + yaw, 0.0)


@pytest.mark.parametrize("course", [0.0, 0.7, -2.0])
def test_R2_speed_sway_and_yaw_of_a_known_path(course: float) -> None:
    """Along the head: less by how it yaws, more by the part of the sway that is along it."""
    speed, sway, yaw = known(course).figures()
    gained = np.pi * BEAT * SWAY * YAW * np.sin(1.0)
    assert speed == pytest.approx(SPEED * (1.0 - 0.25 * YAW**2) + gained, rel=0.01)
    assert sway == pytest.approx(1e3 * SWAY, rel=1e-3)
    assert yaw == pytest.approx(np.degrees(YAW), rel=1e-3)


def test_R2_a_turn_is_no_yaw() -> None:
    _, sway, yaw = known(0.3, turning=np.radians(4.0)).figures()
    assert sway == pytest.approx(1e3 * SWAY, rel=0.02)
    assert yaw == pytest.approx(np.degrees(YAW), rel=0.02)


def test_R2_the_head_is_where_its_markers_are() -> None:
    assert pytest.approx(0.5 * (-0.077 + 0.065)) == HEAD


def test_R2_gait_is_the_measured_series() -> None:
    for run in ("0.50", "1.00", "1.50", "2.00"):
        assert measured(run)["run_hz"] == float(run)
        formulas = gait(run, means=True)
        rows = [row for row in table("joint_series") if row["run_hz"] == run]
        beat = measured(run)["beat_hz"]
        for t in (2.9, 3.7, 4.4):
            for row in rows:
                angle = float(row["mean_rad"]) + sum(
                    float(row[f"amplitude{n}_rad"])
                    * np.sin(2.0 * np.pi * n * beat * t + float(row[f"phase{n}_rad"]))
                    for n in (1, 2, 3)
                )
                names = {"t": t, "beat": beat, "pi": np.pi, "sin": np.sin, "ramp": lambda _: 1.0}
                found = eval(formulas[f"motion.{row['joint']}.position"], names)
                assert found == pytest.approx(np.degrees(angle), abs=1e-9)


def test_R2_degrees_that_move_from_joint_to_joint_keep_the_fin() -> None:
    names = {"t": 3.1, "beat": 0.7497, "pi": np.pi, "sin": np.sin, "ramp": lambda _: 1.0}
    angles = [
        [eval(gait("1.00", moved=moved)[f"motion.{k}.position"], names) for k in range(5)]
        for moved in (0.0, 4.0)
    ]
    change = np.subtract(*angles[::-1])
    assert change[0] == pytest.approx(-change[1])
    assert 0.1 < abs(change[0]) <= 4.0
    assert change[2:] == pytest.approx(np.zeros(3), abs=1e-12)


def test_R2_robot_swims_about_as_fast_as_the_real_one() -> None:
    """On cells of 2 cm, as the short run of the case."""
    found = case("R2").judge(compared(("1.00",), (45,)))
    speed, _, _, mean = found
    assert mean.value == pytest.approx(abs(speed.value - speed.reference))
    assert abs(speed.value - speed.reference) < 0.5 * speed.reference
