"""The built-in robot of six links: its measures, and its first strokes."""

from __future__ import annotations

import math
import re
from pathlib import Path

import numpy as np
import pytest

from flowborne import run
from flowborne.motion.formula import Formula
from flowborne.motion.tracks import TrajectoryFormula
from flowborne.scenes.build import build
from flowborne.scenes.load import library, load_scene
from flowborne.sim.endings import RunOutcome
from flowborne.sim.simulation import Simulation

THICKNESS, LENGTH, WATER = 0.016, 0.61, 1000.0


def test_it_weighs_about_what_it_displaces() -> None:
    model = build(load_scene("eel")).world.setup.solid
    assert model.body_mass.sum() == pytest.approx(2.0535 + 5 * 1.4973)
    corners = (1.0 - 0.25 * np.pi) * THICKNESS**2
    displaced = WATER * (LENGTH * THICKNESS - corners)
    assert model.body_mass.sum() == pytest.approx(displaced, rel=0.02)


def test_in_a_room_it_is_the_same_robot() -> None:
    flat, tall = (build(load_scene(name)).world.setup.solid for name in ("eel", "eel-room"))
    height = 0.0935
    assert tall.joint_names == flat.joint_names
    assert tall.body_mass == pytest.approx(height * flat.body_mass, rel=1e-3)
    corners = (1.0 - 0.25 * np.pi) * THICKNESS**2
    displaced = height * (LENGTH * THICKNESS - corners)
    overlaps = 5 * height * (0.5 * np.pi * (0.5 * THICKNESS) ** 2)
    assert tall.volume.sum() == pytest.approx(displaced + overlaps, rel=0.02)


def test_in_a_room_it_swims_as_it_does_in_a_slab_but_less() -> None:
    """The first 0.8 s on cells of 2 cm: water gets out of the way above and below."""
    ways = []
    for name in ("eel", "eel-room"):
        settings = {"domain.resolution": "61", "time.frames_per_second": "30"}
        with Simulation(load_scene(name, settings)) as simulation:
            for _ in range(24):
                step = simulation.advance_frame().step
                assert step.momentum_budget_error < 1e-10
            ways.append(np.hypot(*simulation.world.solid.q[:2]))
    assert 0.001 < ways[1] < ways[0]


def test_free_joints_find_out_how_to_swim() -> None:
    """The first second on cells of 2 cm, at the limits of the slower gait, which is overtaken."""
    ways = []
    for name in ("eel", "eel-free"):
        with Simulation(load_scene(name, {"domain.resolution": "61"})) as simulation:
            model = simulation.world.setup.solid
            joints = model.positions_of("joint_1")[0] + np.arange(5)
            for _ in range(60):
                before = simulation.world.solid.q[joints].copy()
                simulation.advance_frame()
                angles = simulation.world.solid.q[joints]
                assert np.abs(angles).max() <= np.radians(20.0) + 1e-9
                assert np.abs(angles - before).max() <= np.radians(62.84) / 60.0
            ways.append(simulation.world.solid.q[1])
    assert ways[1] > 1.5 * ways[0] > 0.0


@pytest.mark.parametrize("hertz", ["0.5", "1.5"])
def test_one_constant_is_the_frequency_of_its_gait(hertz: str) -> None:
    """To the last bit what formulas with the number in place of its name give."""
    settings = {"domain.resolution": "61"}
    settings |= {} if hertz == "0.5" else {"constants.frequency": hertz}
    motions = build(load_scene("eel", settings)).world.setup.motions
    for n, motion in enumerate(motions, start=1):
        formula = Formula(f"20.0 * ramp(t) * sin(2*pi*({hertz}*t - 0.14*{n}))")
        expected = TrajectoryFormula(motion.dofs, formula, math.pi / 180.0)
        for t in np.linspace(0.0, 4.0, 61):
            assert motion.position(t) == expected.position(t)
            assert motion.velocity(t) == expected.velocity(t)


@pytest.mark.parametrize("amplitude", [20.0, 40.0])
def test_it_swims_forward_by_its_gait_alone(amplitude: float) -> None:
    """The first 1.5 s on cells of 2 cm."""
    settings = {"constants.amplitude": f"{amplitude}", "domain.resolution": "61"}
    told, worst = load_scene("eel", settings), 0.0
    with Simulation(told) as simulation:
        joints = simulation.world.setup.solid.positions_of("joint_1")[0] + np.arange(5)
        for _ in range(90):
            step = simulation.advance_frame().step
            t = simulation.time
            s = min(t, 1.0)
            wave = np.sin(2.0 * np.pi * (0.5 * t - 0.14 * np.arange(1, 6)))
            gait = np.radians(amplitude) * (3.0 * s**2 - 2.0 * s**3) * wave
            off = np.abs(simulation.world.solid.q[joints] - gait).max()
            worst = max(worst, step.momentum_budget_error, step.momentum_exchange_error)
            assert off < 1e-9
        _, y, heading = simulation.world.solid.q[:3]
    assert worst < 1e-10
    assert y > 0.002 * amplitude
    assert abs(np.degrees(heading)) < 2.0 * amplitude


def beside_a_wall(folder: Path, gap: float, amplitude: float, margin: float = 0.0) -> Path:
    """The robot falls along a wall that its gait (degrees) touches.

    gap, margin  from the wall at first, and of the contacts, m
    """
    scene, model = ((library() / f"eel.{end}").read_text("utf-8") for end in ("toml", "xml"))
    wall = '<geom type="plane" size="1 1 1" zaxis="1 0 0" contype="0" conaffinity="1"/>'
    model = model.replace("<worldbody>", f"<worldbody>{wall}")
    model = model.replace('contype="0" conaffinity="0"', f'conaffinity="0" margin="{margin}"')
    model = model.replace('pos="0.61 0.61 0"', f'pos="{gap + 0.5 * THICKNESS} 1.0 0"')
    scene = scene.replace("amplitude = 20.0", f"amplitude = {amplitude}")
    folder.mkdir()
    (folder / "eel.xml").write_text(model, "utf-8")
    (folder / "scene.toml").write_text(f"gravity = [0.0, -9.81]\n{scene}", "utf-8")
    return folder / "scene.toml"


def test_a_body_that_turns_over_a_pocket_at_a_wall_leaves_no_negative_volume(
    tmp_path: Path,
) -> None:
    """On cells of 1.3 cm a pocket of 0.03 of a cell had to give 0.15 to the cell beside it."""
    scene = beside_a_wall(tmp_path / "touch", 0.003, 5.0)
    with Simulation(load_scene(scene, {"domain.resolution": "92"})) as simulation:
        for _ in range(20):
            simulation.advance_frame()
            cells = simulation.world.flow()[1].cell_volume
            assert cells.min() > -1e-9 * cells.max()


def test_a_film_that_a_body_closes_has_a_remedy_that_works(tmp_path: Path) -> None:
    closing = run(beside_a_wall(tmp_path / "touch", 0.008, 20.0), tmp_path / "one", film=False)
    assert closing.outcome is RunOutcome.BLEW_UP
    assert "bodies touched in the fluid" in closing.message
    found = re.search(r"margin = ([0-9.]+) m in the model", closing.message)
    assert found is not None
    frames = closing.frames + 4
    scene = beside_a_wall(tmp_path / "film", 0.008, 20.0, float(found[1]))
    opened = run(scene, tmp_path / "two", film=False, frames=frames)
    assert opened.outcome is RunOutcome.DONE
    assert opened.frames == frames
