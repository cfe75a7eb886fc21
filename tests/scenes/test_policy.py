"""A policy in the scene: a function that reads the water and tells joints what to do."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest

import flowborne as fb
from flowborne.sim.running import run
from flowborne.sim.simulation import Simulation

STEER = """
import numpy as np
import flowborne as fb

CHEEKS = np.array([[0.0, 0.04, 0.0], [0.0, -0.04, 0.0]])
read, told = [], []

def steer(simulation, gain):
    left, right = simulation.flow_at("head", CHEEKS).pressure
    speed = simulation.joint("joint_5").velocity[0]
    read.append(left - right)
    slowed = 0.0 if np.isnan(speed) else 1e-3 * speed
    told.append(gain * (left - right) - slowed)
    return {"joint_5": fb.Torque(told[-1])}
"""
POLICY = """
[policy]
function = "{name}:steer"
joints = ["joint_5"]
parameters = {{ gain = 1e-4 }}
"""


def eel(folder: Path, name: str, policy: str = POLICY) -> Path:
    """An eel on a coarse grid whose last joint a policy tells."""
    source = Path(fb.__file__).parent / "scenes" / "library"
    shutil.copy(source / "eel.xml", folder)
    text = (source / "eel.toml").read_text().replace("resolution = 122", "resolution = 24")
    text = text.replace("checkpoint_every = 60", "checkpoint_every = 2")
    (folder / f"{name}.py").write_text(STEER)
    scene = folder / "steered.toml"
    scene.write_text(f'plugins = ["{name}.py"]\n{text}{policy.format(name=name)}')
    return scene


def test_a_policy_reads_the_flow_at_two_points_of_the_head(tmp_path: Path) -> None:
    with Simulation(eel(tmp_path, "steer_by_cheeks"), workers=1) as simulation:
        for _ in range(4):
            simulation.advance_frame()
        import steer_by_cheeks  # type: ignore[import-not-found]

        assert len(steer_by_cheeks.read) == 4
        assert abs(steer_by_cheeks.read[-1]) > 0.1
        assert simulation.joint("joint_5").drive[0] == steer_by_cheeks.told[-1]
        torque = simulation.measure()["torque_joint_5_Nm"]
        assert torque == pytest.approx(steer_by_cheeks.told[-1], rel=1e-12)


def test_a_run_with_a_policy_that_was_stopped_goes_on_to_the_same_numbers(tmp_path: Path) -> None:
    scene = eel(tmp_path, "steer_again")
    whole = run(scene, out=tmp_path / "whole", frames=6, workers=1, film=False)
    run(scene, out=tmp_path / "parts", frames=3, workers=1, film=False)
    parts = run(scene, out=tmp_path / "parts", frames=6, workers=1, film=False, resume=True)
    first, second = (fb.open_run(result.folder).history for result in (whole, parts))
    for column in first:
        if not column.startswith("seconds"):
            np.testing.assert_array_equal(first[column], second[column], err_msg=column)


@pytest.mark.parametrize(
    ("given", "wanted", "said"),
    [
        ('joints = ["joint_5"]', 'joints = ["joint_9"]', "joint 'joint_9' is not in model eel.xml"),
        (":steer", ":stear", "has no function 'stear'. Correct the name."),
        ("gain = 1e-4", "strength = 2", "function 'steer_wrong:steer': got an unexpected keyword"),
    ],
)
def test_wrong_policies_are_refused(tmp_path: Path, given: str, wanted: str, said: str) -> None:
    scene = eel(tmp_path, "steer_wrong", POLICY.replace(given, wanted))
    with pytest.raises(fb.SceneError, match=said.replace("(", r"\(")):
        fb.load_scene(scene)


def test_a_policy_that_fails_ends_the_run_with_its_own_message(tmp_path: Path) -> None:
    other = POLICY.replace('"joint_5"', '"joint_4"')
    with (
        Simulation(eel(tmp_path, "steer_other", other), workers=1) as simulation,
        pytest.raises(fb.BlowUpError, match=r"frame 1, step 1: policy .* tells joint_5: name it"),
    ):
        simulation.advance_frame()


def test_a_policy_is_python_that_needs_trust(tmp_path: Path) -> None:
    scene = eel(tmp_path, "steer_trusted")
    with pytest.raises(fb.SceneError, match=r"brings Python, .* function steer_trusted:steer"):
        fb.load_scene(scene, trust=False)
