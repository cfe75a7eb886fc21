"""The doctor finds what is missing, says how to mend it, and survives what crashes."""

from __future__ import annotations

import sys
from importlib.metadata import PackageNotFoundError, version

import imageio_ffmpeg
import pytest

from flowborne.cli.main import main
from flowborne.kernels import jit
from flowborne.sim import doctor


def told(capsys: pytest.CaptureFixture[str]) -> tuple[object, dict[str, str]]:
    """Exit code of the command, and what -> its line."""
    with pytest.raises(SystemExit) as left:
        main(["doctor"])
    said = capsys.readouterr()
    assert said.err == ""
    return left.value.code, {line[10:22].strip(): line for line in said.out.splitlines()}


def test_a_machine_that_runs_tests_is_well(capsys: pytest.CaptureFixture[str]) -> None:
    code, lines = told(capsys)
    assert code == 0
    assert list(lines) == [*doctor.CHECKS, *(f"[{extra}]" for extra in sorted(doctor.extras()))]
    assert {line.split()[0] for line in lines.values()} == {"ok"}
    assert f"numpy {version('numpy')}" in lines["versions"]
    assert f"usd-core {version('usd-core')}" in lines["[usd]"]


def test_films_need_ffmpeg(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "imageio_ffmpeg", None)
    finding = doctor.finding("films")
    assert not finding.missing
    assert finding.found == "what draws films is not installed"
    assert "pip install 'flowborne[film]'" in finding.remedy


def test_a_film_is_read_again(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(imageio_ffmpeg, "count_frames_and_secs", lambda path: (1, 0.04))
    assert doctor.finding("films").found == "1 of 2 frames are in a film in .mp4"


def test_kernels_need_a_folder(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(doctor.os, "access", lambda path, mode: False)
    finding = doctor.finding("kernels")
    assert finding.missing
    assert finding.found.startswith("compiled kernels cannot be kept in /")
    assert "NUMBA_CACHE_DIR" in finding.remedy


def test_kernels_do_without_shared_threads(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(jit, "numba_layer", lambda: "workqueue")
    finding = doctor.finding("threads")
    assert not finding.missing
    assert finding.line().startswith("optional  threads       neither TBB nor OpenMP is there")
    assert finding.line().endswith("; " + finding.remedy)


WITHOUT_OPENGL = """
from flowborne.sim import doctor
from flowborne.view.space import opengl
plotter = opengl.off_screen(8, 8)
opengl.LAST_RESORT, opengl.MESA = plotter.render_window.GetClassName(), ()
doctor.draw_sphere()
"""
"""Code of a process for which no library of OpenGL works."""


@pytest.mark.parametrize(
    ("drawing", "said"),
    [
        ("import os; os.abort()", "drawing ends in a crash (SIGABRT)"),
        (WITHOUT_OPENGL, "three dimensions cannot be drawn without OpenGL, and neither"),
    ],
)
def test_a_driver_that_crashes_is_a_line(
    monkeypatch: pytest.MonkeyPatch, drawing: str, said: str
) -> None:
    monkeypatch.setattr(doctor, "DRAWING", drawing)
    finding = doctor.finding("OpenGL")
    assert finding.found.startswith(said)
    assert "libegl1" not in finding.found
    assert "libegl1" in finding.remedy
    assert not finding.missing


def without(name: str, number: str | None = None):
    """What stands for importlib's version where a library is old, or is not there."""

    def stand_in(asked: str) -> str:
        if asked == name and number is None:
            raise PackageNotFoundError(asked)
        return number if asked == name and number else version(asked)

    return stand_in


@pytest.mark.parametrize(
    ("name", "number", "said"),
    [("scipy", None, "scipy is not installed"), ("scipy", "1.0", "scipy 1.0 is not >=1.14")],
)
def test_a_library_is_missing_or_old(
    monkeypatch: pytest.MonkeyPatch, name: str, number: str | None, said: str
) -> None:
    monkeypatch.setattr(doctor, "version", without(name, number))
    finding = doctor.finding("libraries")
    assert (finding.found, finding.missing) == (said, True)


@pytest.mark.parametrize(("name", "row", "code"), [("scipy", "libraries", 1), ("h5py", "[vtk]", 0)])
def test_only_what_a_run_needs_is_a_failure(
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    name: str,
    row: str,
    code: int,
) -> None:
    monkeypatch.setattr(doctor, "CHECKS", {"libraries": doctor.CHECKS["libraries"]})
    monkeypatch.setattr(doctor, "version", without(name))
    left, lines = told(capsys)
    assert left == code
    assert f"{name} is not installed; " in lines[row]
    assert lines[row].startswith("missing" if code else "optional")


@pytest.mark.parametrize(("number", "missing"), [("4.0.1", False), ("3.17.0", True)])
def test_mujoco_and_mujoco_core_share_a_folder(
    monkeypatch: pytest.MonkeyPatch, number: str, missing: bool
) -> None:
    assert "share" not in doctor.finding("MuJoCo").found
    monkeypatch.setattr(
        doctor, "version", lambda name: number if name == "mujoco" else version(name)
    )
    finding = doctor.finding("MuJoCo")
    assert finding.missing is missing
    assert f"mujoco {number} and mujoco-core {version('mujoco-core')} share the folder /" in (
        finding.found
    )
    assert bool(finding.remedy) is missing
