"""K8 to K10 in short: a standing human in gravity and wind."""

from __future__ import annotations

import numpy as np
import pytest

from flowborne import load_scene
from flowborne_validation.cases import case
from flowborne_validation.human import BACK, SPREAD, G, Load, human, settled, standing


@pytest.mark.parametrize("name", ["K8", "K9", "K10"])
def test_every_finding_passes(name: str) -> None:
    found = case(name).run(quick=True)
    assert found
    assert [result.title for result in found if result.verdict != "pass"] == []


def test_the_walker_of_a_scene_stands_still_and_the_scene_is_its_own() -> None:
    simulation = standing("human-gravity-back", {**SPREAD, BACK: (0.0, 10.0, 0.0)}, initial={})
    own = load_scene("human-gravity-back")
    assert simulation.scene.control == own.control
    assert simulation.scene.controller == own.controller
    assert simulation.scene.objectives == own.objectives
    model, standard = simulation.setup.solid, human()
    assert model.mj.body_pos[2:] == pytest.approx(standard.mj.body_pos[2:], abs=1e-8)
    assert simulation.body("pelvis").position == pytest.approx(standard.mj.body_pos[1], abs=1e-8)
    assert model.geom_size == pytest.approx(standard.geom_size, abs=1e-8)
    assert model.body_mass == pytest.approx(standard.body_mass)
    for side, sign in (("left", 1.0), ("right", -1.0)):
        half = sign * np.radians(12.5)
        turned = (np.cos(half), np.sin(half), 0.0, 0.0)
        assert simulation.joint(f"{side}_shoulder").position == pytest.approx(turned)
    leaning = (np.cos(np.radians(5.0)), 0.0, np.sin(np.radians(5.0)), 0.0)
    assert simulation.joint(BACK).position == pytest.approx(leaning)
    back, before = model.positions_of(BACK), simulation.world.solid.q.copy()
    after = settled(simulation).world.solid.q
    moved = np.abs(after - before) > 1e-9
    assert set(np.flatnonzero(moved)) <= set(back)
    assert moved.any()
    assert simulation.joint(BACK).velocity == pytest.approx(np.zeros(3), abs=1e-3)


def test_a_load_along_the_net_force_is_on_its_line() -> None:
    """Two bodies that the wind pushes by half their weight, as one whose centre it lies in."""
    mass, joint = np.array([2.0, 1.0]), np.array([1.0, 0.0, 1.0])
    along = np.array([0.5, 0.0, 1.0])
    centre = joint + np.array([0.2, 0.8])[:, None] * along
    force = mass[:, None] * np.array([-0.5 * G, 0.0, 0.0])
    load = Load(["trunk", "head"], joint, mass, centre, force, np.zeros((2, 3)))
    assert load.reach == pytest.approx(0.4 * along)
    assert load.off_centre == pytest.approx(0.2)
    assert load.lean == pytest.approx(np.degrees(np.arctan(0.5)))
    assert load.off_line == pytest.approx(0.0, abs=1e-9)
    still = Load(["trunk", "head"], joint, mass, centre, 0.0 * force, np.zeros((2, 3)))
    assert still.off_line == pytest.approx(load.lean)
