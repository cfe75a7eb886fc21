"""The table [film], in a scene and on the command line."""

from __future__ import annotations

from pathlib import Path

import pytest

from flowborne.base.errors import SceneError
from flowborne.runs.run_folder import RunFolder
from flowborne.scenes.save import film_settings
from flowborne.view.shot import Shot


@pytest.fixture
def folder(tmp_path: Path) -> RunFolder:
    """Of a run with a fluid, of which the scene file alone is there."""
    scene = '[fluid]\ncoupling = "two-way"\n[film]\nfield = "dye"\ncamera = { lens = 40.0 }\n'
    (tmp_path / "scene.toml").write_text(scene)
    return RunFolder(tmp_path)


def test_settings_change_the_table_of_the_run(folder: RunFolder) -> None:
    told = {"camera.orbit": "30", "camera.target": "[1, 2]", "plots": "false", "size": "[640, 480]"}
    shot = Shot.model_validate(film_settings(folder, told))
    assert (shot.field, shot.plots, shot.size) == ("dye", False, (640, 480))
    assert (shot.camera.lens, shot.camera.orbit) == (40.0, 30.0)
    assert shot.camera.target == (1.0, 2.0, 0.0)


@pytest.mark.parametrize(
    ("key", "value", "said"),
    [
        ("feild", "dye", "scene scene.toml, [film]: unknown key 'feild'; did you mean 'field'?"),
        ("camera.orbti", "3", "[film] camera: unknown key 'orbti'; did you mean 'orbit'?"),
        ("field", "speeed", "[film] field: 'speeed' is not known; did you mean 'speed'?"),
        ("camera.lens", "170", "[film] camera.lens: 170 is greater than 120"),
        ("size", "[641, 480]", "even numbers of pixels"),
        ("background", "blue", "has the background 'blue'. Give"),
        ("plots", "maybe", "[film] plots"),
    ],
)
def test_a_wrong_setting_is_one_message(folder: RunFolder, key: str, value: str, said: str) -> None:
    with pytest.raises(SceneError) as wrong:
        film_settings(folder, {key: value})
    assert len(wrong.value.problems) == 1
    assert said in wrong.value.problems[0]


def test_a_start_after_the_stop_is_told(folder: RunFolder) -> None:
    with pytest.raises(SceneError, match=r"starts at 3 s and stops at 2 s\. Let it stop after"):
        film_settings(folder, {"start": "3", "stop": "2"})


def test_a_field_without_a_fluid_is_told_where_it_was_asked_for(folder: RunFolder) -> None:
    folder.scene.write_text('[film]\nfield = "dye"\n')
    assert film_settings(folder, {"plots": "false"})["field"] == "dye"
    with pytest.raises(SceneError, match=r"\[film\] field: 'speed' is of a fluid, and this run"):
        film_settings(folder, {"field": "speed"})
