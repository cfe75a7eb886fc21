"""What the README tells to type is what the command takes, and its scenes take what it sets.

The pages have the same commands and more, and a test runs those (`test_pages.py`).
"""

from __future__ import annotations

import re
from pathlib import Path

import pytest
import typer.main

from flowborne.cli import main as cli
from flowborne.scenes.load import check_scene, scene_names

from .blocks import blocks_of

README = Path(__file__).parents[2] / "README.md"
MAKE = (README.parent / "Makefile").read_text(encoding="utf-8")

COMMANDS = [words for block in blocks_of(README) for words in block.commands()]
OWN = [words[1:] for words in COMMANDS if words[0] == ".venv/bin/flowborne"]


def test_it_fits_on_a_few_screens() -> None:
    assert len(README.read_text(encoding="utf-8").splitlines()) <= 120


def test_its_pictures_are_there_and_small() -> None:
    shown = re.findall(r'<img src="([^"]+)"', README.read_text(encoding="utf-8"))
    assert len(shown) > 3
    assert all((README.parent / path).stat().st_size < 600_000 for path in shown)


def test_its_python_needs_no_scene_file(capsys: pytest.CaptureFixture[str]) -> None:
    """The ball falls slower than in vacuum, and than in endless water, of which it moves half its
    volume: the box is six radii wide."""
    (script,) = (block.text for block in blocks_of(README) if block.language == "python")
    assert len([line for line in script.splitlines() if line]) == 6
    exec(compile(script, "README.md", "exec"), {})
    endless = 0.5 * 9.81 * (2000 - 1000) / (2000 + 500) * 0.1**2
    assert 0.85 * endless < -float(capsys.readouterr().out) < endless


def test_every_line_is_a_command_of_flowborne_or_a_target_of_make() -> None:
    others = [words for words in COMMANDS if words[0] != ".venv/bin/flowborne"]
    assert len(OWN) > 4
    for words in others:
        assert words[0] == "make", f"{words}: let a test see to it"
        assert f"\n{words[1]}:" in MAKE


@pytest.mark.parametrize("words", OWN, ids=" ".join)
def test_the_command_takes_it(words: list[str]) -> None:
    command = typer.main.get_command(cli.app).commands[words[0]]
    given = command.make_context(words[0], words[1:]).params
    if words[0] in ("run", "check") and words[1] in scene_names() and given.get("settings"):
        pairs = dict(pair.split("=", 1) for pair in given["settings"])
        pairs = {key: value for key, value in pairs.items() if not key.startswith("clip.")}
        assert check_scene(words[1], pairs) == []
