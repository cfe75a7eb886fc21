"""Every built-in scene keeps what scenes promise."""

from __future__ import annotations

import math
import pickle
from functools import cache

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from flowborne.scenes import warn_units
from flowborne.scenes.build import Built, build
from flowborne.scenes.load import library, load_scene, scene_names
from flowborne.scenes.schema import Scene
from flowborne.scenes.warn import WARNINGS, accepted_of, warnings_of

NAMES = scene_names()
UNCONTROLLED = (
    "flyer-base",
    "swimmer-jet-only",
    "swimmer-no-control",
    "eel",
    "eel-room",
    "eel-pair",
    "fish-robot",
    "rov",
)


@cache
def loaded(name: str) -> Scene:
    """A built-in scene, loaded and checked once for all tests."""
    return load_scene(name)


def test_the_list_of_scenes_is_what_lies_in_the_library() -> None:
    assert sorted(NAMES) == sorted(path.stem for path in library().glob("*.toml"))


@pytest.mark.parametrize("name", NAMES)
def test_scene_is_sound_and_says_what_it_shows(name: str) -> None:
    scene = loaded(name)  # raises what is wrong with it
    assert scene.name == name
    assert scene.figure
    assert scene.description
    assert "\n" not in scene.description
    assert scene.controlled_joints() or name in UNCONTROLLED
    still = ("human-gravity", "flyer", "swimmer", "eel", "fish")
    assert scene.stream() is not None or name.startswith(still)


@pytest.fixture(scope="module", params=NAMES)
def scene(request: pytest.FixtureRequest) -> Scene:
    """A built-in scene."""
    return loaded(request.param)


@pytest.fixture(scope="module")
def built(scene: Scene) -> Built:
    """It, built once for the tests that leave it as it is."""
    return build(scene)


def test_everything_in_the_model_has_a_name(built: Built) -> None:
    model = built.world.setup.solid.mj
    elements = [model.body(i) for i in range(model.nbody)]
    elements += [model.joint(i) for i in range(model.njnt)]
    elements += [model.geom(i) for i in range(model.ngeom)]
    assert all(element.name for element in elements)


def test_what_a_worker_needs_survives_pickling(built: Built) -> None:
    world, controller = pickle.loads(pickle.dumps((built.world, built.controller)))
    for key, values in built.world.arrays().items():
        assert_array_equal(world.arrays()[key], values)
    if built.controller is not None:
        assert controller.strength == built.controller.strength


ACCEPTED = {
    "human-wind-drag": ("[[objectives]] 3: 'left_shoulder'", "[[objectives]] 5: 'right_shoulder'"),
    "flyer-base": ("[domain]: left_inner is 0.25 m thick, 1 cell,",),
    "flyer-twist": ("[domain]: left_inner is 0.25 m thick, 1 cell,",),
    "flyer-flesh": ("[domain]: wings is 0.43 m thick, 1.7 cells,",),
    "swimmer-held": ("[time]: leg_5 crosses up to 1.12 cells in one step",),
    "eel": ("[domain]: head is 0.016 m thick, 1.6 cells,",),
    "eel-room": ("[domain]: head is 0.016 m thick, 1.6 cells,",),
    "eel-free": ("[domain]: head is 0.016 m thick, 1.6 cells,",),
    "fish-robot": ("[domain]: segment_0 is 0.003 m thick, 0.2 cells,",),
}
"""Scene -> how the warnings begin that it accepts. Arms that a wind holds back cannot follow the
walk; wings and links are thinner than two cells; held legs at their full strength cross a little
over one."""


def test_no_scene_warns_about_itself_and_each_says_why(scene: Scene, built: Built) -> None:
    assert warnings_of(scene, built.world.setup) == []
    accepted = accepted_of(scene, built.world.setup)
    begins = ACCEPTED.get(scene.name, ())
    assert len(accepted) == len(begins), accepted
    for warning, begin in zip(accepted, begins, strict=True):
        assert warning.startswith(begin)
        assert len(warning.split(". Accepted: ")[1]) > 20


def test_no_scene_is_in_another_unit(scene: Scene, built: Built) -> None:
    """Nor does it accept a warning that it is."""
    kinds = [kind for kind in WARNINGS if kind.__module__ == warn_units.__name__]
    assert len(kinds) == 9
    assert [w for kind in kinds for w in kind(scene, built.world.setup)] == []


def test_two_worlds_of_a_scene_are_equal_and_share_nothing(scene: Scene, built: Built) -> None:
    first, second = built.world.arrays(), build(scene).world.arrays()
    assert first.keys() == second.keys()
    for key, values in first.items():
        assert_array_equal(values, second[key])
        assert not np.shares_memory(values, second[key])


def test_effort_scenes_come_to_rest_within_their_frames() -> None:
    """K1: at rest tan(psi) = wind / weight; the film lasts longer than the way there."""
    for name in ("block-effort-wind", "block-effort-weak-wind"):
        scene = loaded(name)
        made = build(scene)
        model = made.world.setup.solid
        weight = model.body_mass[model.body("block")] * 9.81
        wind = scene.wind[0].model_dump()["force"][0]
        angle = math.degrees(math.atan2(wind, weight))
        assert angle == pytest.approx({"block-effort-wind": 42.4}.get(name, 18.1), abs=0.1)
        assert angle / scene.control[0].strength < 0.75 * scene.time.frames * scene.frame_time
