"""K11 in short: upstrokes of the flyers and first strokes of the swimmer on coarse grids."""

from __future__ import annotations

import numpy as np
import pytest

from flowborne import Simulation, load_scene
from flowborne_validation.creatures import CYCLE, Flight, Swim, fly

UPSTROKE = {
    "domain.resolution": "16",
    "time.frames_per_second": "20",
    "motion.0.phase": "-90.0",
    "motion.1.phase": "-90.0",
}
"""Both wings start at the bottom."""


def test_K11_twisted_wings_are_drawn_up_with_less_drag() -> None:
    fine = {**UPSTROKE, "domain.resolution": "24"}  # on 16 cells hinges close more than wings do
    base, twist = (fly(scene, 0.5, fine) for scene in ("flyer-base", "flyer-twist"))
    assert np.all(np.diff(base.stroke) > 0.0)
    ((_, pressed),), ((_, feathered),) = base.impulses(), twist.impulses()
    assert pressed < -60.0
    assert feathered > 0.8 * pressed


def test_K11_wings_of_flesh_fold_on_their_way_up() -> None:
    brief = {**UPSTROKE, "domain.resolution": "26"}
    straight, bent = (fly("flyer-flesh", 0.1, brief, controlled) for controlled in (False, True))
    ((_, pressed),), ((_, folded),) = straight.impulses(), bent.impulses()
    assert pressed < -8.0
    assert folded > 0.5 * pressed


def test_impulses_are_those_of_half_strokes() -> None:
    time = np.arange(1, 81) * 0.05
    stroke = np.cos(np.pi * time)
    down = np.gradient(stroke) < 0.0
    found = Flight(time, stroke, np.where(down, 3.0, -1.0), 2.0).impulses()
    np.testing.assert_allclose(found, [[3.0, -1.0], [3.0, -1.0]], atol=0.16)


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
        assert report.step.momentum_budget_error < 1e-10
        simulation.advance_frame()
    assert simulation.world.solid.q[2] > 0.02
