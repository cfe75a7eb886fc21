"""What `check` says beside what is wrong."""

from __future__ import annotations

import pytest

from flowborne.scenes.build import build
from flowborne.scenes.load import load_scene
from flowborne.scenes.notes import notes_of


@pytest.mark.parametrize(
    ("settings", "told"),
    [
        ({"controller.rule": "fixed"}, True),
        ({"controller.rule": "resilient"}, False),
        ({"controller.rule": "fixed", "control.0.probe": "0.8"}, False),
    ],
)
def test_probes_wider_than_fixed_steps_are_told(settings: dict[str, str], told: bool) -> None:
    """The block's steps are 20 / 24 degrees, its probes 5."""
    scene = load_scene("block-drag-min", settings)
    notes = list(notes_of(scene, build(scene).world.setup.solid))
    assert len(notes) == told
    if told:
        assert "probes of 5 degrees are wider than steps of 0.833" in notes[0]


@pytest.mark.parametrize(("strength", "told"), [("120.0", True), ("360.0", False)])
def test_joints_slower_than_the_clip_that_they_are_to_be_close_to_are_told(
    strength: str, told: bool, swing: str
) -> None:
    """A servo of 4 Hz goes at half of its strength."""
    scene = load_scene(swing, {"control.0.strength": strength})
    notes = list(notes_of(scene, build(scene).world.setup.solid))
    assert len(notes) == 2 * told
    if told:
        assert "[[objectives]] 2: 'left_shoulder' is to be close to a motion of up to" in notes[0]
        assert "and goes at 62.8 at most; a larger strength in [[control]] 1" in notes[0]
