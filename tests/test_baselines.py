"""The baselines of the environments: episodes, training, and the page of their results."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("cmaes")
pytest.importorskip("gymnasium")

import baselines
import learning_page

TINY = {"domain.resolution": "24", "time.frames": "8"}


@pytest.fixture
def tiny(monkeypatch: pytest.MonkeyPatch) -> None:
    """Environments that take no time."""
    for name in ("eel", "block"):
        task = replace(baselines.TASKS[name], grids={"tiny": TINY}, generations=2, seeds=(1,))
        monkeypatch.setitem(baselines.TASKS, name, task)
    walker = replace(baselines.TASKS["walker"], grids={"tiny": {"time.frames": "4"}})
    monkeypatch.setitem(baselines.TASKS, "walker", walker)
    baselines.environment.cache_clear()


def test_the_same_seed_gives_the_same_curve(tiny: None) -> None:
    first, again, other = (baselines.train("block", seed, workers=1) for seed in (1, 1, 2))
    assert first["best"] == again["best"]
    assert first["numbers"] == again["numbers"]
    assert first["mean"] != other["mean"]
    assert len(first["best"]) == 2
    assert first["best"][1] >= first["best"][0]
    reward = baselines.episode("block", "tiny", first["numbers"]).reward
    assert reward == first["best"][-1]


def test_the_first_gait_follows_the_scene_as_far_as_strength_allows(tiny: None) -> None:
    """Joints end where the formula of the scene `eel` has them."""
    task = baselines.TASKS["eel"]
    env, _ = baselines.environment("eel", "tiny")
    observation, _ = env.reset()
    act = task.policy(task.numbers.start, env)
    for _ in range(2):
        observation, *_ = env.step(act(env.simulation.time, observation.astype(float)))
    time, n = env.simulation.time, np.arange(2, 5)  # joints 1 and 5 start elsewhere
    ramp = 3.0 * time**2 - 2.0 * time**3
    wanted = np.radians(20.0) * ramp * np.sin(2.0 * np.pi * (0.5 * time - 0.14 * n))
    assert observation[[3, 6, 9]] == pytest.approx(wanted, abs=1e-6)


@pytest.mark.parametrize("name", ["eel", "walker"])
def test_the_gradient_controller_gets_the_reward_of_the_environment(name: str, tiny: None) -> None:
    """It is measured as policies are, and its trials are counted."""
    own = baselines.scene_itself(name, "tiny", control=True)
    held = baselines.episode(name, "tiny", baselines.TASKS[name].numbers.start)
    assert own.frames == held.frames
    assert own.trials > 0
    assert np.isfinite([own.reward, own.power, held.reward, held.power]).all()


def test_a_breakdown_counts_as_the_worst_frame(tiny: None) -> None:
    env, _ = baselines.environment("block", "tiny")
    meter = baselines.Meter(baselines.TASKS["block"], baselines.controller_of(env), frames=4)
    env.reset()
    report = env.simulation.advance_frame()
    reward = meter(env.simulation, report)
    assert meter.outcome().reward == pytest.approx(reward)
    assert meter.outcome().frames == 1


def test_the_page_has_the_committed_results() -> None:
    text = learning_page.PAGE.read_text(encoding="utf-8")
    assert text == learning_page.with_section(text), "run `make baselines`"
