"""Tiny runs that the exporters are tried on. Not to be written into."""

from __future__ import annotations

from pathlib import Path

import pytest

import flowborne as fb

from ..made_runs import drift_scene

WALK = """
name = "walk"
gravity = [0.0, 0.0, -9.81]
[time]
frames_per_second = 30.0
frames = 6
[human]
[clip]
"""


@pytest.fixture(scope="session")
def runs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder of scene files and runs."""
    return tmp_path_factory.mktemp("runs")


@pytest.fixture(scope="session")
def chain(runs: Path) -> Path:
    """A chain of two links in a slab with dye, controlled; no flesh."""
    scene = fb.load_scene("ns-chain-2", {"domain.resolution": "24"})
    fb.run(scene, runs / "chain", frames=4, film=False)
    return runs / "chain"


@pytest.fixture(scope="session")
def fish(runs: Path) -> Path:
    """Two bones in flesh that swim in a room with dye, and a buoy that stays."""
    fb.run(Path(__file__).with_name("fish.toml"), runs / "fish", film=False)
    return runs / "fish"


@pytest.fixture(scope="session")
def walk(runs: Path) -> Path:
    """A human of 23 bodies that follows a clip, without fluid."""
    (runs / "walk.toml").write_text(WALK)
    fb.run(runs / "walk.toml", runs / "walk", film=False)
    return runs / "walk"


@pytest.fixture(scope="session")
def drift(runs: Path) -> Path:
    """A sphere with dye around it that sets out through a far-sided domain, which follows it."""
    fb.run(drift_scene(runs), runs / "drift", film=False)
    return runs / "drift"
