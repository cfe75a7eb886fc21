"""A base install simulates, and says what an extra is needed for."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from flowborne.base import extras
from flowborne.base.errors import SceneError
from flowborne_validation.page import curves_of
from fuzz_judge import command

HEAVY = [*extras.DRAWING, "vtkmodules", "pytetwild", "viser"]


@pytest.fixture
def without(monkeypatch: pytest.MonkeyPatch) -> None:
    """What films are drawn with is not found."""
    monkeypatch.setattr(
        extras, "find_spec", lambda name: None if name in extras.DRAWING else object()
    )


def test_a_module_that_is_not_there_is_named_with_its_extra(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setitem(sys.modules, "pytetwild", None)
    with pytest.raises(SceneError, match=r"pip install 'flowborne\[flesh\]'"):
        extras.optional("pytetwild", "pytetwild", "flesh", "meshes of flesh")


def test_a_run_goes_without_its_film(without: None, small_scene: Path, tmp_path: Path) -> None:
    said = command("run", small_scene, "--frames", "2", "--out", tmp_path / "run")
    assert said.code == 0
    assert said.out.startswith("no film will be drawn: films and pictures need imageio, ")
    assert "pip install 'flowborne[film]'" in said.out.splitlines()[0]
    assert (tmp_path / "run" / "history.csv").is_file()
    assert not (tmp_path / "run" / "preview.mp4").exists()


def test_a_film_is_refused_with_what_to_install(
    without: None, small_scene: Path, tmp_path: Path
) -> None:
    command("run", small_scene, "--frames", "2", "--no-film", "--out", tmp_path / "run")
    for words in (("film", tmp_path / "run"), ("figures", "--out", tmp_path / "figures")):
        said = command(*words)
        assert said.code == 2
        assert said.messages == [
            "flowborne: films and pictures need imageio, imageio-ffmpeg, Matplotlib, PyVista; "
            "install them with: pip install 'flowborne[film]'."
        ]


def test_a_report_without_matplotlib_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("flowborne_validation.page.find_spec", lambda name: None)
    assert "pip install 'flowborne[film]'" in curves_of({"x": "s", "y": "m", "curves": []})


def test_what_a_base_install_has_imports_nothing_of_the_extras() -> None:
    """Every module but those of drawing, viewing and other programs' files."""

    script = f"""
import sys, pkgutil, importlib
class Barred:
    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] in {HEAVY!r}:
            raise ModuleNotFoundError(name)
sys.meta_path.insert(0, Barred())
import flowborne
rooms = "fluid kernels solvers shapes solids coupling control motion scenes runs base"
rooms = ["flowborne." + room for room in rooms.split()] + ["flowborne_validation"]
for room in rooms:
    package = importlib.import_module(room)
    for found in pkgutil.walk_packages(package.__path__, package.__name__ + "."):
        if found.name != "flowborne_validation.figures":
            importlib.import_module(found.name)
import flowborne.cli.main, flowborne.sim.running, flowborne.worlds
"""
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr[-500:]
