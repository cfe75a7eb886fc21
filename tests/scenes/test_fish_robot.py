"""The built-in robot fish: its measures, its joints, and its first strokes."""

from __future__ import annotations

import numpy as np
import pytest

from flowborne.scenes.build import build
from flowborne.scenes.load import load_scene
from flowborne.sim.simulation import Simulation
from flowborne.solids.dynamics import kinematics
from flowborne_validation import fishrobot

COARSE = {"domain.resolution": "45"}
"""Cells of 2 cm."""

MASS, CENTRE, INERTIA = 1.481, 0.1172, 0.0201
"""kg, m behind the middle of the head plate, kg m^2 about the vertical axis: of the straight
robot, by its authors' model."""


def test_it_has_the_mass_and_the_inertia_of_its_authors_model() -> None:
    world = build(load_scene("fish-robot", COARSE)).world
    model, q = world.setup.solid, np.zeros_like(world.solid.q)
    mass, place = model.body_mass, kinematics(model, q).mass_centre
    assert mass.sum() == pytest.approx(MASS, rel=1e-3)
    centre = mass @ place / mass.sum()
    assert centre[0] == pytest.approx(CENTRE, rel=2e-3)
    assert centre[1] == pytest.approx(0.0, abs=1e-6)
    about = [
        model.mj.body(name).inertia[2] if model.mj.body(name).iquat[0] > 0.99 else np.nan
        for name in model.body_names
    ]
    apart = mass @ ((place - centre)[:, :2] ** 2).sum(axis=1)
    assert np.sum(about) + apart == pytest.approx(INERTIA, rel=5e-3)


def test_only_what_is_below_its_back_meets_the_water() -> None:
    model = build(load_scene("fish-robot", COARSE)).world.setup.solid
    dry = {"back_fin", "tail_fin_top", "top_plate", "electronics", *(f"arms_{k}" for k in range(5))}
    wet = {model.mj.geom(g).name for g in model.geom_id}
    assert {model.mj.geom(g).name for g in range(model.mj.ngeom)} - wet == dry


def test_its_joints_follow_the_series_of_a_run() -> None:
    """The scene has those of 1 Hz, after a ramp of one beat."""
    scene = load_scene("fish-robot", COARSE)
    motions = build(scene).world.setup.motions
    rows = [row for row in fishrobot.table("joint_series") if row["run_hz"] == "1.00"]
    beat = scene.constants["beat"]
    assert f"{beat:g}" == rows[0]["beat_hz"]
    for t in np.linspace(1.0 / beat, 4.0, 40):
        for motion, row in zip(motions, rows, strict=True):
            angle = sum(
                float(row[f"amplitude{n}_rad"])
                * np.sin(2.0 * np.pi * n * beat * t + float(row[f"phase{n}_rad"]))
                for n in (1, 2, 3)
            )
            assert motion.position(t)[0] == pytest.approx(angle, abs=5e-4)


def test_it_swims_forward_and_straight() -> None:
    """Two beats from rest on cells of 2 cm, flush with the lid, which takes what is left where the
    robot fills a cell at it."""
    settings = COARSE | {"initial.velocities.head_x": "0.0", "time.frames_per_second": "20"}
    worst = 0.0
    with Simulation(load_scene("fish-robot", settings)) as simulation:
        for _ in range(54):
            report = simulation.advance_frame().step
            worst = max(worst, report.momentum_exchange_error, report.momentum_budget_error)
        x, y, heading = simulation.world.solid.q[:3]
    assert worst < 1e-10
    assert -0.10 < x < -0.03
    assert abs(y) < 0.02
    assert abs(np.degrees(heading)) < 12.0
