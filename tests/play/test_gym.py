"""Environments of scenes, by Gymnasium's own checker and beside the scenes themselves."""

from __future__ import annotations

import warnings
from pathlib import Path

import numpy as np
import pytest

import flowborne as fb

gymnasium = pytest.importorskip("gymnasium")

from gymnasium.utils.env_checker import check_env  # noqa: E402

from flowborne.play.gym import ENVIRONMENTS, SceneEnv  # noqa: E402

COARSE = {"domain.resolution": "24"}


def coarse(name: str) -> fb.Scene:
    """A scene that takes no time."""
    scene = fb.load_scene(name)
    coarser = COARSE if scene.has_fluid and scene.is_slab else {}
    return fb.load_scene(name, {**coarser, "time.frames": "4"})


@pytest.mark.parametrize("name", [name for name in ENVIRONMENTS if not name.startswith("swimmer")])
@pytest.mark.parametrize("kind", ["velocity", "torque"])
def test_gymnasium_finds_nothing_wrong(name: str, kind: str) -> None:
    scene = coarse(ENVIRONMENTS[name])
    if kind == "torque":
        limited = tuple(t.model_copy(update={"torque_limit": 1.0}) for t in scene.control)
        scene = scene.model_copy(update={"control": limited})
    env = SceneEnv(scene, kind=kind)  # type: ignore[arg-type]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        warnings.filterwarnings("ignore", ".*observation space (m|is a Box).*")
        warnings.filterwarnings("ignore", ".*infinity.*")
        check_env(env, skip_render_check=True)


@pytest.mark.parametrize("name", [name for name in ENVIRONMENTS if not name.startswith("swimmer")])
def test_stable_baselines_finds_nothing_wrong(name: str) -> None:
    """It needs PyTorch, which is no part of the tests."""
    checker = pytest.importorskip("stable_baselines3.common.env_checker")
    with warnings.catch_warnings():
        warnings.simplefilter("error", UserWarning)
        checker.check_env(SceneEnv(coarse(ENVIRONMENTS[name])), skip_render_check=True)


def test_environments_are_made_by_name() -> None:
    env = gymnasium.make("flowborne/block-v0", scene=coarse("ns-block-drag-max"))
    assert env.unwrapped.observed[:3] == ("position_hinge_rad", "velocity_hinge", "drive_hinge")
    env.close()


def test_the_same_actions_give_the_same_episode_and_the_scene_ends_it(small_scene: Path) -> None:
    episodes = []
    env = SceneEnv(fb.load_scene(small_scene, {"time.frames": "3"}))
    for _ in range(2):
        env.reset(seed=1)
        steps = [env.step(np.array([0.5], np.float32)) for _ in range(3)]
        episodes.append([(*step[0], step[1]) for step in steps])
        assert [step[3] for step in steps] == [False, False, True]
    assert episodes[0] == episodes[1]


def test_an_action_is_part_of_the_strength_and_the_reward_that_of_the_scene(
    small_scene: Path,
) -> None:
    """What the gradient controller does in the scene gets the same reward when it is told."""
    env = SceneEnv(small_scene)
    strength = env.simulation.controller.greatest_strength()[0]  # type: ignore[union-attr]
    with fb.Simulation(small_scene) as own:
        before = own.joint("hinge").position[0]
        report = own.advance_frame()
        turned = own.joint("hinge").position[0] - before
    _, reward, _, _, _ = env.step(np.array([turned / own.frame_time / strength]))
    (term,) = env.simulation.controller.objective.terms  # type: ignore[union-attr]
    wanted = -term.weight * report.terms["wind-drag"]
    assert reward == pytest.approx(wanted, rel=1e-6)


def test_several_run_side_by_side_in_processes(small_scene: Path) -> None:
    envs = gymnasium.vector.AsyncVectorEnv([lambda: SceneEnv(small_scene)] * 2)
    first, _ = envs.reset(seed=3)
    observed, rewards, *_ = envs.step(np.array([[1.0], [-1.0]], np.float32))
    envs.close()
    assert (first[0] == first[1]).all()
    assert observed[0, 0] != observed[1, 0]
    assert rewards[0] != rewards[1]


def test_it_draws_what_the_film_shows(small_scene: Path) -> None:
    pytest.importorskip("matplotlib")
    env = SceneEnv(small_scene, render_mode="rgb_array")
    env.step(np.array([1.0]))
    picture = env.render()
    assert picture.dtype == np.uint8
    assert picture.ndim == 3
    assert picture.shape[2] == 3
    assert len(np.unique(picture.reshape(-1, 3), axis=0)) > 3


@pytest.mark.parametrize(
    ("how", "said"),
    [
        ({"joints": ("elbow",)}, "joint 'elbow' is not among the controlled ones"),
        ({"kind": "position"}, "joint 'hinge' has no limit for actions of kind 'position'"),
        ({"kind": "torque"}, "joint 'hinge' has no limit for actions of kind 'torque'"),
    ],
)
def test_what_cannot_be_is_said(small_scene: Path, how: dict[str, object], said: str) -> None:
    with pytest.raises(fb.SceneError, match=said):
        SceneEnv(small_scene, **how)  # type: ignore[arg-type]


def test_a_vehicle_is_told_by_its_thrusters() -> None:
    """Half ahead by the four of the plane; the reward is minus the way from the start."""
    env = SceneEnv(coarse("rov"))
    assert env.action_space.shape == (8,)
    assert env.observed[-7:] == ("offset_x_m", "offset_y_m", "offset_z_m", "qw", "qx", "qy", "qz")
    first, _ = env.reset(seed=1)
    assert first[-7:].tolist() == [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0]
    for _ in range(4):
        seen, reward, _, ended, _ = env.step(np.array([0.5] * 4 + [0.0] * 4))
    assert ended
    assert env.simulation.measure()["thrust_front_left_N"] == 10.0
    assert seen[-7] > 0.0
    assert reward == pytest.approx(-np.linalg.norm(seen[-7:-4]), rel=1e-5)
    env.close()


def test_without_anything_to_tell_there_is_no_environment() -> None:
    with pytest.raises(fb.SceneError, match=r"or give a \[\[thruster\]\] a range"):
        SceneEnv("fish-robot")
