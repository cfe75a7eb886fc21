"""What `check` says beside what is wrong."""

from __future__ import annotations

from pathlib import Path

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


@pytest.mark.parametrize(("solref", "steps"), [("0.02", 4), ("0.0002", 334)])
def test_steps_that_contacts_ask_for_are_told(tmp_path: Path, solref: str, steps: int) -> None:
    """A stiff floor makes a frame of hundreds of steps, which nobody would wait for unasked."""
    ball = f'<freejoint/><geom size=".1" solref="{solref} 1" solmix="1e6"/>'
    floor = '<geom name="floor" type="plane" size="1 1 1"/>'
    (tmp_path / "ball.xml").write_text(
        f'<mujoco><worldbody>{floor}<body pos="0 0 1">{ball}</body></worldbody></mujoco>'
    )
    path = tmp_path / "ball.toml"
    path.write_text('[time]\nframes_per_second = 30\nframes = 2\n[solids]\nmodel = "ball.xml"\n')
    for given in ({}, {"time.steps_per_frame": "1"}):
        scene = load_scene(path, given)
        notes = " ".join(notes_of(scene, build(scene).world.setup.solid))
        assert (f"[time]: a frame has {steps} steps, as contacts" in notes) == (not given)
