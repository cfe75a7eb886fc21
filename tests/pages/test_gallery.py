"""The gallery shows every built-in scene, with a picture and a command that runs it."""

from __future__ import annotations

import re

import pytest
from PIL import Image

import gallery
from flowborne.scenes.load import library, read_scene, scene_names
from gallery import EARLIER, FOLDER, MAX_BYTES, PAGE, SIZE, picture_of, with_section

TEXT = PAGE.read_text(encoding="utf-8")


def test_the_page_is_that_of_the_library(monkeypatch: pytest.MonkeyPatch) -> None:
    """Scenes are read and not checked: tests/scenes/test_library.py does that."""
    monkeypatch.setattr(gallery, "load_scene", lambda name: read_scene(library() / f"{name}.toml"))
    assert with_section(TEXT) == TEXT, "docs/gallery.md is out of date: run `make gallery`"


def test_every_built_in_scene_has_one_command_and_no_other_scene_has() -> None:
    commands = re.findall(r"`flowborne run (\S+)`", TEXT)
    assert sorted(commands) == sorted(scene_names())


def test_every_picture_of_the_page_is_there_and_small() -> None:
    shown = re.findall(r"\]\((gallery/\S+\.webp)\)", TEXT)
    assert {PAGE.parent / path for path in shown} == {picture_of(name) for name in scene_names()}
    for name in scene_names():
        path = picture_of(name)
        assert path.is_file(), f"{path} is missing: run `make gallery`"
        with Image.open(path) as picture:
            assert picture.size == SIZE
        assert 2_000 < path.stat().st_size <= MAX_BYTES


def test_no_picture_is_left_of_a_scene_that_is_gone() -> None:
    assert {path.stem for path in FOLDER.glob("*")} == set(scene_names())
    assert set(EARLIER) <= set(scene_names())
