"""Without OpenGL a run keeps its numbers, and one message says what is missing."""

from __future__ import annotations

import os
import subprocess
import sys
from contextlib import closing
from pathlib import Path

import pytest

import flowborne
from flowborne.cli.main import main
from flowborne.sim.endings import RunOutcome
from flowborne.view.space import opengl

MISSING = "neither libEGL nor libOSMesa works here; install OpenGL"


@pytest.fixture
def _no_opengl(monkeypatch: pytest.MonkeyPatch) -> None:
    """A machine on which VTK has only its last resort, and no library for that."""
    with closing(opengl.off_screen(8, 8)) as plotter:
        monkeypatch.setattr(opengl, "LAST_RESORT", plotter.render_window.GetClassName())
    monkeypatch.setattr(opengl, "MESA", ("libNotThere.so",))


@pytest.mark.usefixtures("_no_opengl")
def test_a_run_is_whole_without_its_film(scene_of_things: Path, tmp_path: Path) -> None:
    result = flowborne.run(scene_of_things, tmp_path / "run", workers=1, frames=2)
    assert (result.outcome, result.frames) == (RunOutcome.DONE, 2)
    assert MISSING in result.message
    assert (tmp_path / "run" / "summary.json").exists()
    assert not list((tmp_path / "run").glob("preview.*"))


@pytest.mark.usefixtures("_no_opengl")
def test_the_command_says_what_is_missing(things: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as stopped:
        main(["film", str(things)])
    options = capsys.readouterr()
    assert (stopped.value.code, options.out) == (2, "")
    assert options.err.startswith("flowborne: three dimensions cannot be drawn without OpenGL")
    assert MISSING in options.err
    assert options.err.count("\n") == 1


def test_a_renderer_that_is_not_installed_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pyvista", None)
    with pytest.raises(ValueError, match=r"three dimensions cannot be drawn .*pyvista.* install"):
        opengl.off_screen(8, 8)


def test_nothing_is_told_of_windows_tried_in_vain() -> None:
    """Without a display VTK tries X first, and would warn of it."""
    code = "from flowborne.view.space import opengl; opengl.off_screen(8, 8).close()"
    without = {name: value for name, value in os.environ.items() if name != "DISPLAY"}
    done = subprocess.run(
        [sys.executable, "-c", code], env=without, capture_output=True, check=True
    )
    assert (done.stdout, done.stderr) == (b"", b"")


def test_two_dimensions_load_no_renderer(small_scene: Path, tmp_path: Path) -> None:
    code = (
        "import sys, flowborne; flowborne.run(sys.argv[1], sys.argv[2], workers=1, frames=2); "
        "sys.exit('pyvista' in sys.modules or 'vtkmodules' in sys.modules)"
    )
    command = [sys.executable, "-c", code, str(small_scene), str(tmp_path / "run")]
    assert subprocess.run(command).returncode == 0
    assert (tmp_path / "run" / "preview.mp4").exists()
