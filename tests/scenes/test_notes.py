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


def test_sides_that_whole_cells_make_longer_are_told() -> None:
    for resolution, told in (("36", ""), ("48", "y to 0.164 m for 0.16, z to 0.136 m for 0.128")):
        scene = load_scene("fish", {"domain.resolution": resolution})
        notes = " ".join(notes_of(scene, build(scene).world.setup.solid))
        assert ("longer" in notes) == bool(told)
        assert told in notes


def test_a_flow_that_creeps_is_told() -> None:
    for viscosity, told in (("1e-3", False), ("1e6", True)):
        scene = load_scene("ns-block-drag-max", {"fluid.viscosity": viscosity})
        notes = " ".join(notes_of(scene, build(scene).world.setup.solid))
        assert ("[fluid]: creeping: nu dt / h^2 is" in notes) == told


def test_a_film_without_the_dye_is_told() -> None:
    for field, told in (("dye", False), ("vorticity", True)):
        scene = load_scene("ns-block-drag-max", {"film.field": field})
        notes = " ".join(notes_of(scene, build(scene).world.setup.solid))
        assert ('[[dye]]: the film shows vorticity; [film] field = "dye"' in notes) == told
