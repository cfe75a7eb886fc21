"""A run in Python and in notebooks: scene, summary, table, plots and film."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_array_equal

import flowborne as fb
from flowborne.runs.history import UnknownColumnError


@pytest.fixture
def result(small_scene: Path, tmp_path: Path) -> fb.RunResult:
    """The small scene run for three frames, without a film."""
    return fb.run(small_scene, tmp_path / "run", frames=3, film=False)


@pytest.fixture
def opened(result: fb.RunResult) -> fb.OpenRun:
    return result.open()


def test_a_run_is_a_line_and_its_preview(result: fb.RunResult, opened: fb.OpenRun) -> None:
    folder = result.folder
    assert repr(opened) == f"OpenRun 'small' in {folder}: 3 frames, no fluid"
    assert repr(result) == f"RunResult in {folder}: the run is complete, 3 frames"
    for one in (result, opened):
        assert "<img" not in one._repr_html_()
        assert "<p>" in one._repr_html_()
    opened.film()
    for one in (result, opened):
        assert '<img width="480" src="data:image/png;base64,iVBOR' in one._repr_html_()


def test_its_scene_is_a_scene(opened: fb.OpenRun) -> None:
    assert isinstance(opened.scene, fb.Scene)
    assert opened.scene.time.frames == 3
    assert repr(opened.scene) == "Scene 'small': 2D, no fluid, 3 frames of 0.04167 s"
    assert opened.tables["solids"]["density"] == 100.0


def test_its_summary_is_that_of_the_file(opened: fb.OpenRun, result: fb.RunResult) -> None:
    assert opened.summary["outcome"] == "done"
    assert opened.summary["objective_unit"] == "N/m"
    assert opened.summary["final_mean"] == result.summary["final_mean"]
    (result.folder / "summary.json").write_text("{")
    with pytest.raises(fb.RunFolderError, match=r"the files of run .* cannot be read"):
        _ = opened.summary


def test_its_table_has_a_row_for_each_frame(opened: fb.OpenRun) -> None:
    table = opened.table()
    assert list(table.index) == [1, 2, 3]
    assert table.index.name == "frame"
    assert list(table.columns) == [name for name in opened.history if name != "frame"]
    assert_array_equal(table["angle_hinge_rad"], opened.history["angle_hinge_rad"])


def test_without_pandas_there_is_no_table(
    opened: fb.OpenRun, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "pandas", None)
    with pytest.raises(
        fb.SceneError, match=r"data frames are made by pandas, .*'flowborne\[xarray\]'"
    ):
        opened.table()


def test_columns_are_plotted_over_time(opened: fb.OpenRun, tmp_path: Path) -> None:
    figure = opened.plot("angle_hinge_rad", "objective")
    assert [axes.get_title(loc="left") for axes in figure.axes] == ["angle_hinge_rad", "objective"]
    x, y = figure.axes[0].lines[0].get_data()
    assert_array_equal(np.asarray(x), opened.history["time_s"])
    assert_array_equal(np.asarray(y), opened.history["angle_hinge_rad"])
    assert figure._repr_png_().startswith(b"\x89PNG")
    figure.savefig(tmp_path / "plot.svg")
    assert (tmp_path / "plot.svg").stat().st_size > 1000
    with pytest.raises(ValueError, match=r"no column to plot; name some of frame, time_s"):
        opened.plot()


def test_an_unknown_column_suggests_the_one_that_was_meant(opened: fb.OpenRun) -> None:
    said = r"no column 'angle_hinge' in the history; did you mean 'angle_hinge_rad'\?"
    with pytest.raises(KeyError) as raised:
        opened.history["angle_hinge"]
    assert isinstance(raised.value, UnknownColumnError)
    with pytest.raises(KeyError, match=f"^{said}$"):
        opened.plot("angle_hinge")
    assert "angle_hinge" not in opened.history
    assert opened.history.get("angle_hinge") is None


def test_its_film_is_drawn_once_and_shown(opened: fb.OpenRun, tmp_path: Path) -> None:
    film = opened.film()
    assert film.path == opened.folder / "preview.mp4"
    assert film._repr_html_().startswith('<video controls loop src="data:video/mp4;base64,')
    drawn = film.path.stat().st_mtime_ns
    assert opened.film().path.stat().st_mtime_ns == drawn
    moving = opened.film(tmp_path / "film.webp")
    assert moving._repr_html_().startswith('<img src="data:image/webp;base64,')
    frames = opened.film(tmp_path / "frames.png")
    assert frames._repr_html_() == str(tmp_path / "frames.png")
    assert len(list(tmp_path.glob("frames_*.png"))) == 4
    with pytest.raises(ValueError, match="neither a film nor an image sequence"):
        opened.film(tmp_path / "film.avi")


def test_true_shows_the_progress(
    small_scene: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    fb.run(small_scene, tmp_path / "run", frames=2, film=False, progress=True)
    assert "frame 2/2  objective" in capsys.readouterr().err
    fb.run(small_scene, tmp_path / "run", frames=2, film=False, progress=False, replace=True)
    assert capsys.readouterr().err == ""
