"""K11 in short: what the swimmer's measures say, and its first strokes on a coarse grid."""

from __future__ import annotations

import numpy as np
import pytest

from flowborne import Simulation, load_scene
from flowborne.validation.swimmer import CYCLE, Swim


def test_force_is_the_mean_while_legs_close_and_while_they_open() -> None:
    time = np.arange(1, 106) / 30.0
    spread = 20.0 + 20.0 * np.cos(2.0 * np.pi * time / CYCLE)
    push = np.append(0.0, np.where(np.diff(spread) < 0.0, 5.0, -2.0))
    run = Swim(time, 0.1 * time, 0.0 * time, push, time, spread)
    assert run.pushed(-1.0) == 5.0
    assert run.pushed(1.0) == -2.0
    assert run.risen() == pytest.approx(0.35)


def test_the_first_decision_closes_all_legs_alike_and_lifts_the_head() -> None:
    """In a lower room, on cells of 0.4 m: the legs are far from its top and bottom."""
    settings = {"domain.upper": "[8.0, 8.0, 6.0]", "domain.lower": "[-8.0, -8.0, -10.0]"}
    scene = load_scene("swimmer", {**settings, "domain.resolution": "40"})
    with Simulation(scene) as simulation:
        report = simulation.advance_frame()
        before = report.gradient
        assert before.min() > 0.8 * before.max() > 0.0
        world = simulation.world
        legs = world.solid.q[7:12]
        assert np.degrees(legs).max() < 56.0
        assert np.degrees(np.ptp(legs)) < 2.0
        assert report.step.work > 0.0
        assert report.step.momentum.budget_error < 1e-10
        simulation.advance_frame()
    assert simulation.world.solid.q[2] > 0.02
