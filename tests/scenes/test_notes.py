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
