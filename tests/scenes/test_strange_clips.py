"""Clips by others: with the file alone the walker is where the file has it."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from flowborne.scenes.build import build
from flowborne.scenes.capture import capture_of
from flowborne.scenes.load import check_scene, load_scene
from flowborne.scenes.notes import notes_of

from .walkers import CONTROL, worst

CLIPS = Path(__file__).parent / "clips"
OTHERS = Path(__file__).parents[3] / "shared" / "mocap" / "others"

READ = {
    "mixamo-freebvh.bvh": (0.01, "y", ("upper_neck",)),
    "pybvh-test2.bvh": (0.01, "y", ("upper_neck",)),
    "pybvh-test3.bvh": (0.0254, "z", ()),
    "rokoko-jesse.bvh": (0.01, "y", ("upper_neck",)),
    "fair1-zombie.bvh": (0.0395, "z", ("upper_neck",)),
}
"""File -> unit and axis that is up, as found, and joints that it lacks."""

PLACE, TURN, BEND = 0.003, 0.5, 90.0
"""m, and degrees: the most by which a joint is off, and by which a body is bent from its rest."""


@pytest.mark.parametrize("name", READ)
def test_a_walker_is_where_its_file_has_it(name: str, tmp_path: Path) -> None:
    path = Path(shutil.copy(CLIPS / name, tmp_path))
    off = worst(path, range(0, 16, 3))
    assert off.place < PLACE
    assert off.turn < TURN
    assert off.bend[0] < BEND, off.bend[1]
    assert off.joints >= 22
    scene = load_scene(path.with_suffix(".toml"))
    capture = capture_of(scene)
    assert capture is not None
    assert (capture.unit, capture.up, capture.held) == READ[name]
    model = build(scene).world.setup.solid
    assert not set(capture.held) & set(model.joint_names), "what the file lacks is welded"
    notes = list(notes_of(scene, model))
    assert any(f"read with unit = {capture.unit:g}" in note for note in notes)
    assert any("held: upper_neck" in note for note in notes) == bool(capture.held)


@pytest.mark.parametrize("name", ["mixamo-freebvh.bvh", "pybvh-test3.bvh"])
def test_a_controlled_back_leaves_the_legs_where_they_are(name: str, tmp_path: Path) -> None:
    path = Path(shutil.copy(CLIPS / name, tmp_path))
    off = worst(path, (0, 2), ["lower_back"], CONTROL)
    assert off.place < PLACE
    assert off.turn < TURN
    assert off.joints == 9


@pytest.mark.skipif(not OTHERS.is_dir(), reason="the whole clips are not here")
@pytest.mark.parametrize("name", READ)
def test_scenes_with_walkers_take_the_whole_clips(name: str) -> None:
    """All joints above the hips controlled in one, those that the file lacks among them."""
    for scene in ("human-gravity-arms", "human-wind-all"):
        assert check_scene(scene, {"clip.file": str(OTHERS / name)}) == []
