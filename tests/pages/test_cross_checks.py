"""The page of cross-checks has what its runs gave, and both programs have the same wing."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

import flapping
import heaving
import waterlily
from flowborne.scenes.load import load_scene


def test_the_profile_is_naca_0018() -> None:
    points = flapping.outline(400)
    assert points.min(axis=0) == pytest.approx((0.0, -0.09), abs=2e-4)
    assert points.max(axis=0) == pytest.approx((1.0, 0.09), abs=2e-4)
    assert points[points[:, 1].argmax(), 0] == pytest.approx(0.3, abs=0.01)


def test_the_scene_is_the_wing_of_the_lattice(tmp_path: Path) -> None:
    scene = load_scene(flapping.write_scene(tmp_path, 0.4, 8))
    assert scene.motion[0].period == pytest.approx(np.pi / 0.4)
    assert scene.time.frames == round(8.0 * 2 * np.pi / 0.4)
    assert flapping.WING.unit == pytest.approx(1.5)


def test_a_harmonic_is_found_again() -> None:
    period = flapping.WING.period(0.4)
    times = np.arange(200) * period / 100
    lifts = 1.5 * (0.3 + 0.7 * np.sin(2.0 * np.pi * times / period - 1.0))
    found = flapping.harmonic({"times": list(times), "lifts": list(lifts)}, 0.4)
    assert found == pytest.approx((0.3, 0.7, np.degrees(-1.0)))


def test_tables_have_a_row_for_every_run() -> None:
    kept = json.loads(flapping.FOUND.read_text(encoding="utf-8"))
    keys = [f"{reduced:g}" for reduced in flapping.WING.reduced]
    assert list(kept["rooms"]) == list(kept["lattice"]["runs"]) == keys
    assert flapping.table().count("cells a chord") == len(keys) * len(flapping.GRIDS)
    assert heaving.table().count(" to ") == 3 * len(heaving.GRIDS)
    assert waterlily.figures().count("cells in all") == len(waterlily.GRIDS)
