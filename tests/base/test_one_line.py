"""What objects say of themselves at a prompt: a line each."""

from __future__ import annotations

import numpy as np
import pytest

import flowborne as fb
from flowborne.scenes.listing import GROUPS


@pytest.fixture(scope="module")
def simulation() -> fb.Simulation:
    """A block in a stream on 24 x 24 cells, after a frame."""
    made = fb.Simulation(fb.load_scene("ns-block-drag-max", {"domain.resolution": "24"}), workers=1)
    made.advance_frame()
    return made


def test_each_object_is_one_short_line(simulation: fb.Simulation) -> None:
    world, report, setup = simulation.world, simulation.report, simulation.setup
    assert report is not None
    things = [
        *(simulation, simulation.scene, world, setup, setup.fluid, setup.solid, world.solid),
        *(world.fluid, simulation.snapshot(), report, report.step, simulation.controller),
        *(simulation.body("block"), simulation.flow_at("block", np.zeros((2, 3)))),
    ]
    for thing in things:
        line = repr(thing)
        assert "\n" not in line
        assert type(thing).__name__ in line
        assert "object at 0x" not in line
        assert len(line) <= 125, line


def test_a_simulation_says_where_it_is(simulation: fb.Simulation) -> None:
    assert repr(simulation) == (
        "Simulation 'ns-block-drag-max': frame 1 of 130, t = 0.04167 s, 24 x 24 cells"
    )
    assert repr(simulation.scene) == (
        "Scene 'ns-block-drag-max': 2D, 24 x 24 cells, 130 frames of 0.04167 s"
    )
    assert repr(simulation.snapshot()) == "Snapshot(frame=1, world=World, report=FrameReport)"
    assert repr(simulation.setup.solid) == "SolidModel(bodies=1, joints=1)"


def test_a_simulation_that_has_not_started_does_not_start_to_say_so() -> None:
    simulation = fb.Simulation("block-drag-max", workers=1)
    assert repr(simulation) == ("Simulation 'block-drag-max': frame 0 of 90, t = 0 s, no fluid")
    assert not simulation._started


def test_scenes_are_listed_in_python_as_on_the_command_line() -> None:
    listed = fb.scenes()
    assert {one.group for one in listed} == set(GROUPS)
    eel = next(one for one in listed if one.name == "eel")
    assert (eel.dimensions, eel.cells, eel.seconds) == (2, 122 * 122, 4.0)
    assert repr(listed).startswith("To begin with, ")


def test_names_at_a_prompt_are_the_public_ones() -> None:
    import flowborne.play.gym as gym
    import flowborne.scenes.load  # does not put another `scenes` in place of the one to call

    assert dir(fb) == sorted(fb.__all__)
    for page in (fb.bodies, fb.machine, fb.parts, fb.pictures, fb.worlds, gym):
        assert dir(page) == sorted(page.__all__)
    assert flowborne.scenes.load.load_scene is fb.load_scene
    assert len(fb.scenes()) > 30
