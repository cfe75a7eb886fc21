"""preview.png and preview.mp4: readable, of the right size and length, and whole."""

from __future__ import annotations

import json
import subprocess
from collections.abc import Callable
from contextlib import closing
from pathlib import Path

import imageio.v3 as imageio
import numpy as np
import pytest
from PIL import Image

from flowborne.runs.run_folder import RunFolderError
from flowborne.view import drawing
from flowborne.view.drawing import drawn_frames
from flowborne.view.film import make_preview, write_film, write_shot
from flowborne.view.maps import MapSlab
from flowborne.view.pictures import Picture
from flowborne.view.plots import ChainCost, plot_chain_cost
from flowborne.view.run import Run
from flowborne.view.shot import Shot

Write = Callable[..., Path]


def frames_of(path: Path) -> np.ndarray:
    return np.asarray(imageio.imread(path, plugin="FFMPEG"))


def test_film_and_picture_show_every_frame(write_run: Write) -> None:
    folder = write_run(frames=8)
    seen: list[tuple[int, int]] = []
    make_preview(folder, lambda done, of: seen.append((done, of)))
    assert seen == [(n, 9) for n in range(1, 10)]
    picture = Picture(Run(folder))
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
    np.testing.assert_array_equal(still, Picture(Run(folder), 1.5).draw(8)[:, :, :3])
    assert not list(folder.rglob("*.partial"))


def test_a_film_that_cannot_be_written_leaves_the_earlier_one(write_run: Write) -> None:
    folder = write_run(frames=4)
    film = folder / "preview.mp4"
    film.write_bytes(b"earlier")

    def fill_up(done: int, of: int) -> None:
        if done == 3:
            raise OSError(28, "No space left on device")

    with pytest.raises(OSError, match="No space left"):
        write_film(Run(folder), film, fill_up)
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
    with pytest.raises(RunFolderError, match="has no frame yet; continue the run with resume=True"):
        make_preview(folder)


def test_a_body_that_the_run_does_not_have_is_named(write_run: Write) -> None:
    folder = write_run(frames=1)
    model = json.loads((folder / "model.json").read_text())
    for table, key, value in ((model["geoms"][0], "body", 42502), (model["joint_bodies"], 0, -1)):
        sound, table[key] = table[key], value
        (folder / "model.json").write_text(json.dumps(model))
        with pytest.raises(RunFolderError, match=f"model.json has body {value}, and 2 in all"):
            Run(folder)
        table[key] = sound


def test_a_wide_and_a_high_run_have_even_sides(write_run: Write) -> None:
    folder = write_run(frames=1)
    model = json.loads((folder / "model.json").read_text())
    for shape in ((96, 41, 1), (31, 96, 1)):
        model["grid"]["shape"] = list(shape)
        (folder / "model.json").write_text(json.dumps(model))
        picture = Picture(Run(folder))
        box = picture.layout.map
        assert picture.layout.width % 2 == picture.layout.height % 2 == 0
        assert box.height / box.width == pytest.approx(shape[1] / shape[0], rel=0.02)


def test_the_cost_of_chains_is_plotted_with_its_line(tmp_path: Path) -> None:
    seconds = (0.3, 0.5, 0.7, 1.0)  # by 0.05 + 0.23 n; the first is off by 0.02 / 0.28
    rows = [ChainCost(n, serial, 0.3) for n, serial in enumerate(seconds, start=1)]
    plot_chain_cost(rows, tmp_path / "cost.svg")
    drawn = (tmp_path / "cost.svg").read_text()
    assert "230 ms a joint, within 7.1 %" in drawn
    with pytest.raises(ValueError, match="chains of two lengths"):
        plot_chain_cost(rows[:1], tmp_path / "one.svg")


def shot_of(**table: object) -> Shot:
    return Shot.model_validate(table)


def test_an_image_sequence_has_alpha_where_nothing_is(write_run: Write, tmp_path: Path) -> None:
    folder = write_run(frames=2, field="vorticity")
    shot = shot_of(background="transparent", plots=False, size=[320, 240])
    assert "frames_0002.png" in write_shot(folder, tmp_path / "frames.png", shot=shot)
    images = [imageio.imread(path) for path in sorted(tmp_path.glob("frames_*.png"))]
    assert [image.shape for image in images] == 3 * [(240, 320, 4)]
    assert images[0][..., 3].min() == 0
    assert images[0][..., 3].max() == 255
    with pytest.raises(ValueError, match="a film in MP4 cannot be transparent"):
        write_shot(folder, tmp_path / "film.mp4", shot=shot)
    assert not (tmp_path / "film.mp4").exists()
    with pytest.raises(ValueError, match=r"film\.gif is neither a film nor an image sequence"):
        write_shot(folder, tmp_path / "film.gif")


def test_an_image_that_moves_has_every_frame(write_run: Write, tmp_path: Path) -> None:
    folder = write_run(frames=3, field="vorticity")
    shot = shot_of(background="transparent", plots=False, size=[320, 240])
    write_shot(folder, tmp_path / "film.webp", shot=shot)
    with Image.open(tmp_path / "film.webp") as image:
        assert (image.n_frames, image.size, image.info["loop"]) == (4, (320, 240), 0)
        for number in range(4):
            image.seek(number)
            drawn = Picture(Run(folder), shot=shot).draw(number).astype(int)
            shown = np.asarray(image.convert("RGBA")).astype(int)
            covered = drawn[..., 3:] / 255  # the colour of what is transparent means nothing
            assert np.abs(shown - drawn)[..., 3].mean() < 4.0
            assert (np.abs(shown - drawn) * covered)[..., :3].mean() < 4.0


@pytest.mark.parametrize("size", [[640, 480], [480, 640], [1280, 720]])
def test_a_picture_has_the_size_that_is_asked_for(write_run: Write, size: list[int]) -> None:
    run = Run(write_run(frames=1))
    for plots in (False, True):
        assert Picture(run, shot=shot_of(size=size, plots=plots)).draw(1).shape[1::-1] == (*size,)
    with pytest.raises(ValueError, match="has no room for its plots"):
        Picture(run, shot=shot_of(size=[400, 64]))


def test_start_stop_and_rate_choose_the_frames() -> None:
    times = np.arange(25) / 24.0
    assert shot_of().frames(times, 24.0) == list(range(25))
    assert shot_of(start=0.25, stop=0.5).frames(times, 24.0) == list(range(6, 13))
    assert shot_of(frames_per_second=12.0).frames(times, 24.0) == list(range(0, 25, 2))
    assert shot_of(frames_per_second=48.0, stop=0.1).frames(times, 24.0)[:4] == [0, 0, 1, 1]
    with pytest.raises(ValueError, match="no frame lies between 2 and 3 s; the run goes from 0 to"):
        shot_of(start=2.0, stop=3.0).frames(times, 24.0)


def test_other_processes_draw_the_same_frames_in_order(
    write_run: Write, monkeypatch: pytest.MonkeyPatch
) -> None:
    run = Run(write_run(frames=9))
    numbers = [*range(10), 3]
    with closing(drawn_frames(run, run.shot, numbers, cores=1)) as alone:
        expected = [frame.copy() for frame in alone]
    monkeypatch.setattr(drawing, "START_TIME", 0.0)
    started: list[list[str]] = []
    start = subprocess.Popen

    def note(command: list[str], **options: object) -> object:
        started.append(command)
        return start(command, **options)  # type: ignore[call-overload]

    monkeypatch.setattr(subprocess, "Popen", note)
    with closing(drawn_frames(run, run.shot, numbers, cores=2)) as together:
        found = [frame.copy() for frame in together]
    assert len(started) == 2
    np.testing.assert_array_equal(found, expected)


def test_a_film_that_is_given_up_leaves_no_process(
    write_run: Write, monkeypatch: pytest.MonkeyPatch
) -> None:
    run = Run(write_run(frames=9))
    monkeypatch.setattr(drawing, "START_TIME", 0.0)
    artists = []
    start = subprocess.Popen

    def note(*options: object, **more: object) -> object:
        artists.append(start(*options, **more))  # type: ignore[call-overload]
        return artists[-1]

    monkeypatch.setattr(subprocess, "Popen", note)
    frames = drawn_frames(run, run.shot, range(10), cores=2)
    for _ in range(5):
        next(frames)
    frames.close()
    assert len(artists) == 2
    assert all(artist.returncode is not None for artist in artists)


def test_a_window_follows_a_body_of_a_slab(write_run: Write) -> None:
    run = Run(write_run(frames=4))
    whole = MapSlab(run, shot_of())
    assert whole.views[0] == pytest.approx([-1.5, 2.5, -2.0, 2.0])
    near = MapSlab(run, shot_of(camera={"follow": "block", "distance": 2.0, "lens": 30.0}), 0.5)
    x0, x1, y0, y1 = near.views[2]
    assert y1 - y0 == pytest.approx(4.0 * np.tan(np.radians(15.0)))
    assert x1 - x0 == pytest.approx(2.0 * (y1 - y0))
    assert [0.5 * (x0 + x1), 0.5 * (y0 + y1)] == pytest.approx([0.4, 0.3], abs=0.02)
    for options, said in (
        ({"follow": "tail"}, "cannot follow body 'tail'; the bodies are world, block"),
        ({"orbit": 5.0}, "a slab is seen from straight above"),
    ):
        with pytest.raises(ValueError, match=said):
            MapSlab(run, shot_of(camera=options))


@pytest.mark.parametrize(("field", "name"), [("speed", "speed (m/s)"), ("pressure", "pressure")])
def test_speed_and_pressure_have_a_scale(write_run: Write, field: str, name: str) -> None:
    run = Run(write_run(frames=1))
    picture = Picture(run, shot=shot_of(field=field))
    assert picture.map.scale is not None
    assert name in picture.map.scale[3]


def test_a_field_that_the_run_lacks_is_said(write_run: Write) -> None:
    run = Run(write_run(frames=1, dyes=()))
    with pytest.raises(ValueError, match="the run has no dye to show; draw another field"):
        Picture(run)


def test_a_model_that_is_not_that_of_the_states_is_refused(write_run: Write) -> None:
    folder = write_run(frames=1)
    file = folder / "model.json"
    model = json.loads(file.read_text())
    file.write_text(json.dumps(model | {"geoms": model["geoms"] * 2}))
    run = Run(folder)
    for draw in (lambda: run.state(0), lambda: run.every("geom_position")):
        with pytest.raises(RunFolderError, match="geometries and its states"):
            draw()
    model["geoms"][0]["body"] = 10**30
    file.write_text(json.dumps(model))
    with pytest.raises(RunFolderError, match="cannot be read"):
        Run(folder)
