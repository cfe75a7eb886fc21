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


def test_render_modes_are_of_the_class(small_scene: Path) -> None:
    """Gymnasium asks the class before there is an environment; the rate is of the scene."""
    assert SceneEnv.metadata == {"render_modes": ["rgb_array"]}
    env = SceneEnv(small_scene)
    rate = env.scene.time.frames_per_second
    assert env.metadata == {"render_modes": ["rgb_array"], "render_fps": rate}
    assert "render_fps" not in SceneEnv.metadata
    env.close()


@pytest.mark.parametrize("action", [0.5, [0.5, 0.5], [[0.5]], []])
def test_an_action_of_another_shape_is_refused_with_the_right_one(
    small_scene: Path, action: object
) -> None:
    env = SceneEnv(small_scene)
    env.reset()
    said = r"an action has the shape \(1,\), a number for each of hinge, and this one \("
    with pytest.raises(ValueError, match=said):
        env.step(np.array(action))
    assert env.simulation.frame == 0
    env.step([0.5])  # type: ignore[arg-type]
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


THRUSTERS = """<mujoco><worldbody><body name="hull"><freejoint name="free"/>
  <geom name="hull" type="sphere" size="0.1" mass="4"/><site name="left" pos="0 .05 0"/>
  <site name="right" pos="0 -.05 0"/>
  <body name="fin" pos="-.1 0 0"><joint name="fin" axis="0 0 1" range="-60 60"/>
    <geom type="box" size=".04 .01 .04" pos="-.05 0 0" density="1000"/></body></body></worldbody>
<actuator><motor name="port" site="left" gear="1 0 0 0 0 0" ctrlrange="-50 60"/>
  <motor name="starboard" site="right" gear="1 0 0 0 0 0" ctrlrange="-50 60"/>
  <position name="rudder" joint="fin" kp="5" ctrlrange="-.5 .5"/></actuator>
<sensor><gyro name="gyro" site="left"/><framepos name="at" objtype="body" objname="hull"/></sensor>
</mujoco>"""


def along_x(simulation: fb.Simulation, report: fb.FrameReport) -> float:
    return float(simulation.body("hull").velocity[0])


def vehicle(folder: Path) -> Path:
    (folder / "hull.xml").write_text(THRUSTERS)
    (folder / "hull.toml").write_text(
        '[time]\nframes_per_second = 50\nframes = 4\n[solids]\nmodel = "hull.xml"\n'
    )
    return folder / "hull.toml"


def test_a_policy_tells_the_actuators_of_the_model(tmp_path: Path) -> None:
    """Two thrusters of 20 N on 4.1 kg, and a rudder by its servo; sensors are observed."""
    env = SceneEnv(vehicle(tmp_path), reward=along_x)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        warnings.filterwarnings("ignore", ".*observation space (m|is a Box).*")
        warnings.filterwarnings("ignore", ".*infinity.*")
        check_env(env, skip_render_check=True)
    env.reset()
    thrust = (20.0 + 50.0) / 110.0 * 2.0 - 1.0
    env.step(np.array([thrust, thrust, 1.0], np.float32))
    observed, reward, *_ = env.step(np.array([thrust, thrust, 1.0], np.float32))
    named = dict(zip(env.observed, observed, strict=True))
    assert named["force_port"] == named["force_starboard"] == pytest.approx(20.0, rel=1e-6)
    assert named["position_fin_rad"] > 0.0
    assert named["sensor_at_x_m"] > 0.0
    assert "sensor_gyro_z_rad/s" in named
    mass = env.simulation.setup.solid.body_mass.sum()
    acceleration = env.simulation.body("hull").acceleration[0]
    assert acceleration == pytest.approx(40.0 / mass, rel=0.05)
    assert reward > 0.0


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"actuators": ("prot",)}, "no actuator 'prot' in the model; did you mean 'port'"),
        ({"actuators": ("port",), "reward": None}, r"has no \[\[objectives\]\].*Give one"),
        ({"joints": ("fin",)}, "'fin' is not among the controlled ones"),
    ],
)
def test_actuators_that_cannot_be_told_are_refused(
    tmp_path: Path, given: dict[str, object], said: str
) -> None:
    with pytest.raises(fb.SceneError, match=said):
        SceneEnv(vehicle(tmp_path), **{"reward": along_x, **given})  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("fin", "actuators", "said"),
    [
        ("fin", ("rudder",), "'rudder' drives joint 'fin', which is among the joints"),
        ("port", ("port",), "the policy tells two of the name 'port'"),
        ("fin", ("port", "port"), "the policy tells two of the name 'port'"),
    ],
)
def test_a_joint_or_a_name_is_told_once(
    tmp_path: Path, fin: str, actuators: tuple[str, ...], said: str
) -> None:
    """Of two commands one would be lost."""
    path = vehicle(tmp_path)
    named = THRUSTERS.replace('<joint name="fin"', f'<joint name="{fin}"')
    (tmp_path / "hull.xml").write_text(named.replace('joint="fin"', f'joint="{fin}"'))
    control = f'[[control]]\njoints = ["{fin}"]\nstrength = 60.0\n[[objectives]]\nkind = "effort"\n'
    path.write_text(path.read_text() + control)
    with pytest.raises(fb.SceneError, match=said):
        SceneEnv(path, joints=(fin,), actuators=actuators)


def test_an_actuator_without_a_range_is_no_action(tmp_path: Path) -> None:
    path = vehicle(tmp_path)
    (tmp_path / "hull.xml").write_text(THRUSTERS.replace(' ctrlrange="-.5 .5"', ""))
    with pytest.raises(fb.SceneError, match="'rudder' has no limit for actions"):
        SceneEnv(path, reward=along_x)


def test_a_vehicle_is_told_by_its_thrusters() -> None:
    """Half ahead by the four of the plane; the reward is minus the way from the start."""
    env = SceneEnv(coarse("rov"))
    assert env.action_space.shape == (8,)
    assert env.observed[-7:] == ("offset_x_m", "offset_y_m", "offset_z_m", "qw", "qx", "qy", "qz")
    with pytest.raises(ValueError, match=r"\(8,\), .*each of front_left, .* and this one \(7,\)"):
        env.step(np.zeros(7))
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
