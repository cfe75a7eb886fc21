"""Loading: overrides, files beside the scene, and a written scene that loads as it was."""

from __future__ import annotations

import errno
import re
import tomllib
from collections.abc import Callable
from pathlib import Path

import pytest
import tomli_w

from flowborne.base.errors import SceneError
from flowborne.characters.source import read_source
from flowborne.scenes.load import (
    check_scene,
    library,
    load_scene,
    override,
    read_scene,
    scene_names,
)
from flowborne.scenes.save import scene_files
from flowborne.scenes.schema import Scene

from .saved import save_scene

Write = Callable[..., Path]


def assert_same(one: Scene, other: Scene) -> None:
    assert one.model_dump() == other.model_dump()
    assert one.to_toml() == other.to_toml()


def test_overrides_change_any_value(write: Write) -> None:
    scene = load_scene(
        write(),
        {
            "name": "renamed",
            "domain.resolution": "32",
            "control.0.strength": "30.5",
            "control.0.joints": '["wrist", "rail"]',
            "boundaries.x_max": "open",
            "boundaries.y_min.kind": "no-slip",
            "boundaries.y_min.velocity": "[2.0, 0.0]",
            "initial.positions.wrist": "12.0",
            "controller.rule.kind": "golden-section",
            "controller.rule.tolerance": "0.1",
        },
    )
    assert scene.name == "renamed"
    assert scene.domain is not None
    assert scene.domain.counts() == [32, 32]
    assert scene.control[0].strength == 30.5
    assert scene.control[0].joints == ("wrist", "rail")
    assert scene.boundaries is not None
    assert scene.boundaries.y_min.model_dump() == {"kind": "no-slip", "velocity": (2.0, 0.0, 0.0)}
    assert scene.initial.positions == {"wrist": (12.0,)}
    assert scene.controller.rule.model_dump() == {
        "kind": "golden-section",
        "reach": None,
        "tolerance": 0.1,
    }


@pytest.mark.parametrize(
    ("key", "text", "message"),
    [
        ("domain.resolutoin", "3", "[domain]: unknown key 'resolutoin'; did you mean 'resolution'"),
        ("control.0.strenght", "3", "[[control]] 1: unknown key 'strenght'; did you mean"),
        ("control.1.strength", "3", "'1' is not an entry of control, which has 1"),
        ("control.strength", "3", "'strength' is not an entry of control, which has 1"),
        ("gravity.x", "3", "'x' is not an entry of gravity, which has 2"),
        ("dimensions.x", "3", "dimensions is 2 and has no keys"),
        ("fluid.density", "heavy", "[fluid] density: 'heavy' is not a number"),
        ("fluid.density", "-1", "[fluid] density: -1 is not greater than 0"),
        ("fluid..density", "1", "'fluid..density' is no key"),
        ("a" + 2000 * ".a", "1", "its arrays or tables are nested more than 30 deep"),
    ],
)
def test_bad_overrides_are_told(write: Write, key: str, text: str, message: str) -> None:
    with pytest.raises(SceneError) as caught:
        load_scene(write(), {key: text})
    assert len(caught.value.problems) == 1
    assert message in caught.value.problems[0]


def test_override_leaves_the_rest_alone() -> None:
    raw = {"control": [{"strength": 1.0, "joints": ["a"]}], "fluid": {"density": 1.0}}
    override(raw, "control.0.strength", "2.0")
    assert raw == {"control": [{"strength": 2.0, "joints": ["a"]}], "fluid": {"density": 1.0}}


def test_the_name_of_a_scene_is_that_of_its_file(write: Write) -> None:
    assert load_scene(write()).name == "swim"


@pytest.mark.parametrize("name", scene_names())
def test_built_in_scene_written_and_loaded_is_identical(name: str, tmp_path: Path) -> None:
    scene = read_scene(library() / f"{name}.toml")
    assert_same(load_scene(save_scene(scene, tmp_path)), scene)


def test_users_scene_written_and_loaded_is_identical(write: Write, tmp_path: Path) -> None:
    (tmp_path / "walk.csv").write_text("time,rail\n0,0.0\n1.5,0.25\n")
    scene = load_scene(
        write(
            append="""
[[motion]]
kind = "keyframes"
joint = "rail"
file = "walk.csv"

[initial]
positions = { drift = [-0.5, 0.4, 0.0, 1.0, 0.0, 0.0, 0.0], wrist = 0.1 }

[[sources]]
lower = [0.2, -0.9]
upper = [0.4, -0.8]
velocity = [0.0, 1.0]
dye = { smoke = 0.3 }

[[dye]]
kind = "bands"
side = "x_min"
bands = [[-0.1, 0.1]]

[[wind]]
kind = "force"
force = [0.1, 0.0]
"""
        )
    )
    assert scene.scalars() == ("dye", "smoke")
    copy = load_scene(save_scene(scene, tmp_path / "run"))
    assert_same(copy, scene)
    assert copy.folder == tmp_path / "run"
    assert not (tmp_path / "run" / "walk.csv").exists()


def test_a_run_of_an_earlier_version_names_its_advection(write: Write) -> None:
    """Its one scheme left is accepted, and not written any more; the other is not known."""
    path = write()
    text = path.read_text(encoding="utf-8")
    assert text.count("[fluid]") == 1
    path.write_text(text.replace("[fluid]", '[fluid]\nadvection = "flux"'), encoding="utf-8")
    assert "advection" not in tomllib.loads(load_scene(path).to_toml())["fluid"]
    path.write_text(text.replace("[fluid]", '[fluid]\nadvection = "other"'), encoding="utf-8")
    with pytest.raises(SceneError, match="advection"):
        load_scene(path)


def test_every_default_is_written_out(write: Write) -> None:
    text = tomllib.loads(load_scene(write()).to_toml())
    assert text["fluid"]["viscosity"] == 0.0
    assert text["boundaries"]["y_max"] == {"kind": "closed"}
    assert text["controller"]["rule"] == {"kind": "fixed"}
    assert text["control"][0]["probe"] == 5.0
    assert text["output"]["checkpoint_every"] == 24


def test_meshes_and_includes_travel_with_the_scene(write: Write, tmp_path: Path) -> None:
    (tmp_path / "shapes").mkdir()
    (tmp_path / "parts").mkdir()
    corners = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)]
    triangles = [(1, 3, 2), (1, 2, 4), (1, 4, 3), (2, 3, 4)]
    (tmp_path / "shapes" / "tetra.obj").write_text(
        "".join(f"v {0.1 * x} {0.1 * y} {0.1 * z}\n" for x, y, z in corners)
        + "".join(f"f {a} {b} {c}\n" for a, b, c in triangles)
    )
    (tmp_path / "parts" / "tail.xml").write_text(
        """<mujoco><worldbody><body name="tail" pos="0.3 0 0"><freejoint/>
        <geom type="mesh" mesh="tetra"/></body></worldbody></mujoco>"""
    )
    (tmp_path / "fish.xml").write_text(
        """<mujoco><compiler meshdir="shapes"/><asset><mesh name="tetra" file="tetra.obj"/></asset>
        <include file="parts/tail.xml"/></mujoco>"""
    )
    path = tmp_path / "fish.toml"
    path.write_text('[solids]\nmodel = "fish.xml"')
    scene = load_scene(path)
    files = scene_files(scene)
    assert sorted(files) == ["assets/tail.xml", "assets/tetra.obj", "fish.xml", "scene.toml"]
    run = tmp_path / "run"
    copy = load_scene(save_scene(scene, run))
    assert_same(copy, scene)
    again = load_scene(save_scene(copy, tmp_path / "second"))
    assert_same(again, scene)
    assert scene_files(copy) == files
    assert (run / "assets/tetra.obj").read_bytes() == files["assets/tetra.obj"]


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("frames = " + 5000 * "9", "there is a number of thousands of digits in it. Shorten it."),
        ("a = " + 3000 * "[" + 3000 * "]", "its arrays or tables are nested more than 30 deep."),
        ("[" + 2000 * "a." + "a]", "its arrays or tables are nested more than 30 deep."),
    ],
)
def test_what_toml_allows_and_no_scene_needs_is_one_message(
    tmp_path: Path, text: str, said: str
) -> None:
    (tmp_path / "swim.toml").write_text(text)
    with pytest.raises(SceneError, match=re.escape(f"scene swim.toml: {said}")):
        load_scene(tmp_path / "swim.toml")


@pytest.mark.parametrize(
    "name", ["/abs/path", "../../x", "..", "a/b", "a\\b", ".hidden", "a\nb", "a\0b", "n" * 300]
)
def test_a_name_that_leaves_the_run_folder_is_refused(tmp_path: Path, name: str) -> None:
    for keys, where in (
        ({"name": name}, ", name"),
        ({"output": {"exports": [f"{name}.csv"]}}, ", [output] exports, entry 1.file"),
    ):
        (tmp_path / "scene.toml").write_text(tomli_w.dumps({"dimensions": 2, **keys}))
        problems = check_scene(tmp_path / "scene.toml")
        said = [one for one in problems if f"scene scene.toml{where}" in one]
        assert len(said) == 1, problems
        assert "a run calls its own folder or file by it. Take a name" in said[0]


def test_a_folder_that_may_not_be_entered_is_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(path: Path) -> bool:
        raise PermissionError(errno.EACCES, "Permission denied", str(path))

    path = tmp_path / "scene.toml"
    monkeypatch.setattr(Path, "is_file", refuse)
    with pytest.raises(SceneError, match=rf"scene {path} cannot be read: Permission denied"):
        load_scene(path)
    with pytest.raises(SceneError, match=r"fish.glb cannot be read: Permission denied"):
        read_source(tmp_path / "fish.glb")
