"""preview.png and preview.mp4: readable, of the right size and length, and whole."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import imageio.v3 as imageio
import numpy as np
import pytest

from flowborne.view.film import make_preview, write_film
from flowborne.view.pictures import Picture
from flowborne.view.plots import ChainCost, plot_chain_cost, plot_history, straight_line
from flowborne.view.run import Run

Write = Callable[..., Path]


def frames_of(path: Path) -> np.ndarray:
    return np.asarray(imageio.imread(path, plugin="FFMPEG"))


def test_film_and_picture_show_every_frame(write_run: Write) -> None:
    folder = write_run(frames=8)
    seen: list[tuple[int, int]] = []
    make_preview(folder, lambda done, of: seen.append((done, of)))
    assert seen == [(n, 9) for n in range(1, 10)]
    picture = Picture(Run.read(folder))
    film = frames_of(folder / "preview.mp4")
    assert film.shape == (9, picture.layout.height, picture.layout.width, 3)
    assert imageio.immeta(folder / "preview.mp4", plugin="FFMPEG")["fps"] == 24.0
    for number in (0, 4, 8):
        drawn = picture.draw(number)[:, :, :3].astype(int)
        assert np.abs(film[number] - drawn).mean() < 4.0
    drawn = picture.draw(1)[:, :, :3].astype(int)
    assert np.abs(film[8] - drawn).mean() > np.abs(film[1] - drawn).mean() + 1.0
    still = imageio.imread(folder / "preview.png")
    assert still.shape[:2] == (1.5 * picture.layout.height, 1.5 * picture.layout.width)
    np.testing.assert_array_equal(still, Picture(Run.read(folder), 1.5).draw(8)[:, :, :3])
    assert not list(folder.rglob("*.partial"))


def test_a_film_that_cannot_be_written_leaves_the_earlier_one(write_run: Write) -> None:
    folder = write_run(frames=4)
    film = folder / "preview.mp4"
    film.write_bytes(b"earlier")

    def fill_up(done: int, of: int) -> None:
        if done == 3:
            raise OSError(28, "No space left on device")

    with pytest.raises(OSError, match="No space left"):
        write_film(Run.read(folder), film, fill_up)
    assert film.read_bytes() == b"earlier"
    assert not list(folder.rglob("*.partial"))


def test_one_frame_makes_a_picture_and_no_film(write_run: Write) -> None:
    folder = write_run(frames=0)
    with pytest.raises(ValueError, match="has one frame, which makes a picture and no film"):
        make_preview(folder)
    assert (folder / "preview.png").exists()
    assert not (folder / "preview.mp4").exists()


def test_a_folder_without_frames_says_so(write_run: Write) -> None:
    folder = write_run(frames=1)
    for path in (folder / "states").iterdir():
        path.unlink()
    with pytest.raises(ValueError, match="has no frame to draw; let the run go on with --resume"):
        make_preview(folder)


def test_a_wide_and_a_high_run_have_even_sides(write_run: Write) -> None:
    folder = write_run(frames=1)
    model = json.loads((folder / "model.json").read_text())
    for shape in ((96, 41, 1), (31, 96, 1)):
        model["grid"]["shape"] = list(shape)
        (folder / "model.json").write_text(json.dumps(model))
        picture = Picture(Run.read(folder))
        box = picture.layout.map
        assert picture.layout.width % 2 == picture.layout.height % 2 == 0
        assert box.height / box.width == pytest.approx(shape[1] / shape[0], rel=0.02)


def test_the_course_of_a_run_is_plotted(write_run: Write, tmp_path: Path) -> None:
    folder = write_run(frames=5)
    plot_history(folder, tmp_path / "course.png")
    assert imageio.imread(tmp_path / "course.png").shape[0] > 300
    with pytest.raises(ValueError, match=r"course\.gif has no known format"):
        plot_history(folder, tmp_path / "course.gif")
    assert not (tmp_path / "course.gif").exists()


def test_the_cost_of_chains_is_plotted_with_its_line(tmp_path: Path) -> None:
    rows = [ChainCost(n, 0.1 + 0.2 * n, 0.3) for n in (1, 2, 3, 4)]
    plot_chain_cost(rows, tmp_path / "cost.svg")
    assert (tmp_path / "cost.svg").read_text().startswith("<?xml")
    slope, start, off = straight_line(np.array([1.0, 2, 3, 4]), np.array([0.3, 0.5, 0.7, 1.0]))
    assert (slope, start) == pytest.approx((0.23, 0.05))
    assert off == pytest.approx(0.02 / 0.28, rel=1e-6)
    with pytest.raises(ValueError, match="two different x"):
        plot_chain_cost(rows[:1], tmp_path / "one.svg")
