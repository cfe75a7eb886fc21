"""What a picture of space shows is what the run holds, where it holds it."""

from __future__ import annotations

import colorsys
from collections.abc import Callable
from contextlib import closing
from pathlib import Path

import imageio.v3 as imageio
import numpy as np
import pytest

import flowborne
from flowborne.fluid.grid import Grid
from flowborne.kernels.arrays import Pixels
from flowborne.scenes.schema_film import CameraTable
from flowborne.sim.endings import RunOutcome
from flowborne.view import style
from flowborne.view.film import make_preview
from flowborne.view.pictures import Picture
from flowborne.view.run import Run
from flowborne.view.shot import Shot
from flowborne.view.space.stage import MapSpace
from flowborne.view.space.surroundings import stands_on_ground

from .projecting import project

Make = Callable[..., Run]

BALL = ("sphere", (0.15, 0.0, 0.0))
PAIR = np.array([[0.0, 0.0, 0.0], [1.0, 0.3, 0.6]])


def moving(frames: int = 3) -> np.ndarray:
    """(frames, 2, 3) two balls of which the second rises."""
    centres = np.broadcast_to(PAIR, (frames, 2, 3)).copy()
    centres[:, 1, 2] += 0.3 * np.arange(frames)
    return centres


def drawn(picture: Picture, number: int) -> Pixels:
    """(h, w, 3) the map of a frame."""
    box = picture.layout.map
    pixels = picture.draw(number)[box.top : box.top + box.height, box.left : box.left + box.width]
    return pixels[:, :, :3].astype(int)


def pixel_of(picture: Picture, number: int, place: np.ndarray) -> tuple[int, int]:
    """(row, column) in the map of a place in m."""
    assert isinstance(picture.map, MapSpace)
    x, y = project(picture.map.camera, number, np.asarray(place, float)[None])[0]
    box = picture.layout.map
    return int((1.0 - y) * box.height), int(x * box.width)


def of_hue(pixels: Pixels, colour: str) -> Pixels:
    """Where pixels have the hue of a colour, more or less lit."""
    wanted = colorsys.rgb_to_hsv(*style.rgb(colour))[0]
    high, low = pixels.max(axis=-1), pixels.min(axis=-1)
    spread = np.maximum(high - low, 1)
    red, green, blue = np.moveaxis(pixels, -1, 0)
    hue = (
        np.select(
            [high == red, high == green],
            [(green - blue) / spread % 6.0, (blue - red) / spread + 2.0],
            (red - green) / spread + 4.0,
        )
        / 6.0
    )
    apart = np.abs((hue - wanted + 0.5) % 1.0 - 0.5)
    return (apart < 0.03) & (high - low > 40)


def test_the_accented_body_stands_where_its_projection_says(run_of: Make) -> None:
    run = run_of([BALL, BALL], moving(), accented=(2,))
    with closing(Picture(run)) as picture:
        for number in (0, 2):
            amber = of_hue(drawn(picture, number), style.ACCENT)
            row, column = np.argwhere(amber).mean(axis=0)
            centre = moving()[number, 1]
            expected = pixel_of(picture, number, centre)
            assert (row, column) == pytest.approx(expected, abs=5.0)
            radius = (
                expected[0]
                - pixel_of(picture, number, centre + 0.15 * picture.map.camera.axes(0)[1])[0]
            )
            assert amber.sum() == pytest.approx(np.pi * radius**2, rel=0.08)


def test_a_body_has_the_models_colour_where_it_gives_one(things: Path) -> None:
    with closing(Picture(Run(things))) as picture:
        pixels = drawn(picture, 2)
        state = picture.run.state(2)
        kinds = [geom.shape.kind for geom in picture.run.geoms]
        blue = of_hue(pixels, "#3399e6")
        assert blue[pixel_of(picture, 2, state["geom_position"][kinds.index("sphere")])]
        amber = of_hue(pixels, style.ACCENT)
        assert amber[pixel_of(picture, 2, state["geom_position"][kinds.index("capsule")])]
        cap = pixels[pixel_of(picture, 2, state["geom_position"][kinds.index("cylinder")])]
        assert np.ptp(cap) < 40 < cap.min()


def test_the_arrow_points_along_the_force(run_of: Make) -> None:
    force = np.array([4.0, 2.0, -3.0])
    centres = np.zeros((2, 1, 3))
    with closing(Picture(run_of([BALL], centres, force=tuple(force)))) as picture:
        rows, columns = np.nonzero(of_hue(drawn(picture, 1), style.FORCE))
        start = np.array(pixel_of(picture, 1, np.zeros(3)), float)
        along = np.array(pixel_of(picture, 1, 0.1 * force)) - start
        away = np.stack([rows, columns], axis=1) - start
        along /= np.linalg.norm(along)
        assert len(away) > 100
        assert (away @ along).min() > 0.0, "from the skin, not from behind the ball"
        assert np.abs(away @ [-along[1], along[0]]).max() < 0.15 * (away @ along).max()
        assert picture.map.forces.unit == "N"


def test_the_wind_is_shown_behind_the_bodies_and_drifts(run_of: Make) -> None:
    still = np.zeros((3, 1, 3))
    with closing(Picture(run_of([BALL], still))) as picture:
        calm = drawn(picture, 0)
    with closing(Picture(run_of([BALL], still, wind=np.array([[2.0, 0.0, 0.0]])))) as picture:
        first, next_ = drawn(picture, 0), drawn(picture, 1)
    arrows = np.abs(first - calm).max(axis=-1) > 10
    assert 0.005 < arrows.mean() < 0.1
    row, column = np.array(calm.shape[:2]) // 2
    assert not arrows[row - 150 : row + 150, column - 150 : column + 150].any(), (
        "the ball hides them"
    )
    moved = np.abs(next_ - calm).max(axis=-1) > 10
    scores = [(arrows & np.roll(moved, -shift, axis=1)).sum() for shift in range(-30, 31)]
    assert 3 < int(np.argmax(scores)) - 30 < 30, "to the right, as x goes"


def test_what_stands_on_the_ground_casts_a_shadow_on_it(run_of: Make) -> None:
    heights = np.array([0.15, 1.5])
    centres = np.zeros((2, 2, 3))
    centres[..., 2] = heights
    down = np.array([0.0, 0.0, -9.81])
    with closing(Picture(run_of([BALL, BALL], centres, gravity=down))) as picture:
        pixels = drawn(picture, 1)
        lit = pixels[pixel_of(picture, 1, np.array([0.4, 0.2, 0.0]))]
        dark = pixels[pixel_of(picture, 1, np.array([0.12, 0.9, 0.0]))]
    assert lit.sum() > dark.sum() + 40
    for options in ({"gravity": np.zeros(3)}, {"gravity": -down}, {"gravity": down[[2, 1, 0]]}):
        expected = not any(options["gravity"])
        assert stands_on_ground(run_of([BALL, BALL], centres, **options)) == expected
    assert not stands_on_ground(run_of([BALL, BALL], centres + 2.0, gravity=down))


def test_dye_glows_where_it_is(run_of: Make, box_of_fluid: Grid) -> None:
    ball = ("sphere", (0.4, 0.0, 0.0))
    run = run_of(
        [ball],
        np.zeros((2, 1, 3)),
        grid=box_of_fluid,
        shot=Shot(field="dye", camera=CameraTable(distance=8.0)),
    )
    dye = np.zeros(box_of_fluid.shape, np.float32)
    dye[8:11, 3:7, 4:7] = 1.0
    for path in run._states:
        with np.load(path) as file:
            arrays = dict(file)
        fluid = {"open": np.ones_like(dye), "scalar_dye": dye}
        np.savez(path, **arrays, **fluid)
    middle = np.array([0.7, 0.0, 0.3])
    with closing(Picture(run)) as picture:
        assert picture.map.legend == [("dye", style.DYES[0])]
        cyan = of_hue(drawn(picture, 1), style.DYES[0])
        assert cyan[pixel_of(picture, 1, middle)]
        assert not cyan[pixel_of(picture, 1, -middle)]
        row, column = np.argwhere(cyan).mean(axis=0)
        assert (row, column) == pytest.approx(pixel_of(picture, 1, middle), abs=15.0)


def test_bodies_whose_numbers_are_lost_are_not_drawn(run_of: Make) -> None:
    centres = moving()
    centres[2, 1] = np.nan
    with closing(Picture(run_of([BALL, BALL], centres, accented=(2,)))) as picture:
        assert of_hue(drawn(picture, 1), style.ACCENT).any()
        assert not of_hue(drawn(picture, 2), style.ACCENT).any()
        assert of_hue(drawn(picture, 0), style.ACCENT).any()


def test_a_run_in_space_leaves_a_picture_and_a_film(scene_of_things: Path, tmp_path: Path) -> None:
    result = flowborne.run(scene_of_things, tmp_path / "run", workers=1, frames=3)
    assert result.outcome is RunOutcome.DONE
    assert "film" not in result.message
    still = imageio.imread(tmp_path / "run" / "preview.png")
    with closing(Picture(Run(tmp_path / "run"))) as picture:
        film = imageio.imread(tmp_path / "run" / "preview.mp4", plugin="FFMPEG")
        assert film.shape == (4, picture.layout.height, picture.layout.width, 3)
        for number in (3, 0):
            whole = picture.draw(number)[:, :, :3].astype(int)
            assert np.abs(film[number] - whole).mean() < 4.0
    assert still.shape[:2] == (1.5 * film.shape[1], 1.5 * film.shape[2])


def test_a_run_in_fluid_is_drawn(scene_of_things: Path, tmp_path: Path) -> None:
    """A whole run of 12 x 8 x 8 cells: the state files hold what its film needs."""
    scene = flowborne.load_scene(
        scene_of_things,
        {
            "domain.lower": "[-1.5, -1.0, -0.2]",
            "domain.upper": "[1.5, 1.0, 1.8]",
            "domain.cells": "[12, 8, 8]",
            "fluid.velocity": "[0.5, 0.0, 0.0]",
            "boundaries.x_min": "{kind = 'inflow', velocity = [0.5, 0.0, 0.0]}",
            "boundaries.x_max": "open",
        },
    )
    flowborne.run(scene, tmp_path / "run", workers=1, frames=2, film=False)
    make_preview(tmp_path / "run")
    with closing(Picture(Run(tmp_path / "run"))) as picture:
        assert len(picture.map.legend) == 2
        assert np.ptp(drawn(picture, 2).reshape(-1, 3), axis=0).min() > 100
