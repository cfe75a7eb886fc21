"""Settings of the Blender extension as scenes that flowborne accepts."""

from __future__ import annotations

import tomllib
from dataclasses import replace
from pathlib import Path

import pytest
from blender.reaction import OBJECTIVES, Reaction, ReactionError, toml, write_scene
from hypothesis import given
from hypothesis import strategies as st

import flowborne as fb
from flowborne.scenes.bodies import load_model

from ..characters import rigged

PLAIN = Reaction(("tail",), {}, 11, 12, 24.0, flow=(3.0, 0.0, 4.0), gravity=(0.0, 0.0, -9.81))


@pytest.fixture
def imported(tmp_path: Path) -> Path:
    """The scene of the rigged box as `flowborne import` makes it."""
    rigged.write_glb(tmp_path / "character.glb")
    return fb.import_character(tmp_path / "character.glb", tmp_path / "scene").scene


def test_simple_wind(imported: Path) -> None:
    scene = fb.load_scene(write_scene(imported, PLAIN))
    assert not scene.has_fluid
    assert [(w.kind, w.velocity, w.density) for w in scene.wind] == [("faces", PLAIN.flow, 1.2)]
    assert (scene.time.frames, scene.time.frames_per_second) == (12, 24.0)
    assert scene.gravity == (0.0, 0.0, -9.81)
    assert scene.clip.free == ()
    assert scene.controlled_joints() == ("tail",)


def test_simulated_water(imported: Path) -> None:
    """A step crosses at most a cell of the chosen grid, by the flow too."""
    water = replace(PLAIN, simulated=True, medium=1000.0, floats=True)
    scenes = [
        fb.load_scene(write_scene(imported, replace(water, resolution=cells))) for cells in (24, 96)
    ]
    for scene in scenes:
        assert scene.is_two_way
        assert scene.stream() == PLAIN.flow
        assert scene.fluid.density == 1000.0
        assert scene.clip.free == ("handle",)
        step = 1.0 / 24.0 / scene.time.steps_per_frame
        assert 5.0 * step <= scene.domain.spacing()
        assert not scene.dye
    assert scenes[1].time.steps_per_frame >= 4 * scenes[0].time.steps_per_frame - 4
    box = (-0.1, 0.0, 0.0), (0.1, 0.2, 0.2)
    (ink,) = fb.load_scene(write_scene(imported, replace(water, ink=box))).dye
    assert (ink.kind, ink.lower, ink.upper) == ("box", *box)


@pytest.fixture(scope="module")
def soft(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The same with a tail of flesh."""
    folder = tmp_path_factory.mktemp("soft")
    rigged.write_glb(folder / "character.glb")
    return fb.import_character(folder / "character.glb", folder / "scene", flesh=["tail"]).scene


@pytest.mark.parametrize("simulated", [False, True])
def test_flesh_of_bones_that_react_or_follow(soft: Path, simulated: bool) -> None:
    """Vibrations of up to 10 Hz have ten steps; without control nothing is decided."""
    chosen = replace(PLAIN, young=3e4, simulated=simulated)
    for follows in (False, True):
        scene = fb.load_scene(write_scene(soft, replace(chosen, follows=follows)))
        (flesh,) = scene.flesh
        assert (flesh.bones, flesh.young) == (("tail",), 3e4)
        assert scene.time.steps_per_frame * scene.time.frames_per_second >= 100.0
        assert scene.controlled_joints() == (() if follows else ("tail",))
        assert len(scene.objectives) == (0 if follows else 1)
        assert load_model(scene).flesh is not None
    assert replace(chosen, follows=True, objective="most-drag", flow=(0.0, 0.0, 0.0)).follows


@pytest.mark.parametrize("simulated", [False, True])
@pytest.mark.parametrize("objective", OBJECTIVES)
def test_every_objective_is_a_scene(imported: Path, objective: str, simulated: bool) -> None:
    chosen = replace(PLAIN, objective=objective, follow=2.0, simulated=simulated)
    first, follow = fb.load_scene(write_scene(imported, chosen)).objectives
    assert (follow.kind, follow.joint, follow.weight) == ("input-motion", "tail", 2.0)
    if objective == "effort":
        assert first.kind == "effort"
    else:
        assert objective.startswith(first.goal)
        assert first.direction == ((0.0, 0.0, 1.0) if "lift" in objective else PLAIN.flow)


def test_cones_are_ranges_of_the_joints(imported: Path) -> None:
    model = load_model(fb.load_scene(write_scene(imported, replace(PLAIN, cones={"tail": 25.0}))))
    ((_, _, limit),) = model.limited_balls
    assert limit == pytest.approx(0.436332, abs=1e-5)


def test_a_bone_without_a_body_is_named(imported: Path) -> None:
    """The tip and the handle of the box have no part of it to move."""
    for bone in ("tail_tip", "handle", "none"):
        with pytest.raises(ReactionError, match=rf"bone '{bone}' moves nothing .* some of: tail$"):
            write_scene(imported, replace(PLAIN, bones=(bone,)))


def test_settings_are_checked_and_kept(tmp_path: Path) -> None:
    for wrong, said in (
        ({"bones": ()}, "no bone is free"),
        ({"frames": 0}, "the frame range is empty"),
        ({"objective": "most-drag", "flow": (0.0, 0.0, 0.0)}, "needs a flow"),
        ({"lead": 12}, "the frame range is empty"),
        ({"lead": 6, "loop": True, "floats": True}, "leaves the cycle"),
    ):
        with pytest.raises(ReactionError, match=said):
            replace(PLAIN, **wrong)
    for reaction in (PLAIN, replace(PLAIN, ink=((0.0, 0.0, 0.0), (1.0, 1.0, 1.0)))):
        reaction.save(tmp_path / "job.json")
        assert Reaction.load(tmp_path / "job.json") == reaction
    (tmp_path / "job.json").write_text("{}")
    with pytest.raises(ReactionError, match=r"job\.json cannot be read .*: start a new run"):
        Reaction.load(tmp_path / "job.json")


TEXT = st.text(st.characters(exclude_categories=["Cs"]))
FLOATS = st.floats(allow_nan=False, allow_infinity=False)
VALUES = st.recursive(
    TEXT | st.booleans() | st.integers(-9, 9) | FLOATS,
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(TEXT, inner, max_size=3),
    max_leaves=5,
)


@given(st.dictionaries(TEXT, VALUES, max_size=3))
def test_toml_is_read_back(tables: dict) -> None:
    assert tomllib.loads(toml(tables)) == tables
