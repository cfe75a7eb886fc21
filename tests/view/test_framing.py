"""A domain that follows bodies, in pictures of slabs: where the water is, and where the camera."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from flowborne.view import style
from flowborne.view.fields import FADED
from flowborne.view.framing import domain_shown, through_window, window_path, windows
from flowborne.view.maps import MapSlab
from flowborne.view.pictures import Picture
from flowborne.view.run import Run
from flowborne.view.shot import Shot

Write = Callable[..., Path]

CELLS = 0.3, -0.17
"""Of the domain in the tests per frame."""


@pytest.fixture
def run(write_run: Write) -> Run:
    """Water that stands still, past which the domain moves."""
    return Run(write_run(frames=60, window=CELLS))


def shot(**keys: object) -> Shot:
    camera = {"follow": keys.pop("follow", "bodies")}
    return Shot.model_validate({"plots": False, "scale_bar": False, "camera": camera, **keys})


def views_of(run: Run, shown: Shot) -> np.ndarray:
    return windows(run, shown)


def test_the_path_of_a_domain_has_no_steps(run: Run) -> None:
    assert run.grid is not None
    moved = run.origins() - run.grid.origin
    path = window_path(run)
    h = run.grid.spacing
    assert np.ptp(moved[:, 0]) == pytest.approx(18.0 * h)
    assert np.abs(path - moved).max() < 1.5 * h
    inside = path[15:-15, :2] / h
    assert np.abs(np.diff(inside, axis=0) - CELLS).max() < 0.01
    assert np.abs(np.diff(path, 2, axis=0)).max() < 0.02 * h


def test_a_domain_that_is_fixed_has_no_path(write_run: Write) -> None:
    run = Run(write_run())
    assert run.window_axes == ()
    assert not window_path(run).any()
    assert run.grid is not None
    low, high, path = domain_shown(run, from_world=True)
    assert (low.tolist(), high.tolist()) == (list(run.grid.origin), list(run.grid.upper))
    assert not path.any()


def test_a_view_from_the_window_is_smooth_and_inside_it(run: Run) -> None:
    views, origins = views_of(run, shot()), run.origins()
    assert run.grid is not None
    h, size = run.grid.spacing, run.grid.spacing * np.array(run.grid.shape)
    for axis in (0, 1):
        low, high = views[:, 2 * axis], views[:, 2 * axis + 1]
        assert (low >= origins[:, axis] - 1e-9).all()
        assert (high <= origins[:, axis] + size[axis] + 1e-9).all()
        assert np.ptp(high - low) < 1e-9
        assert (high - low).min() > size[axis] - 3.0 * h
        assert np.abs(np.diff(low, 2)).max() < 0.02 * h


def test_a_view_from_the_world_has_the_whole_way(run: Run) -> None:
    views, origins = views_of(run, shot(follow="nothing")), run.origins()
    assert run.grid is not None
    size = run.grid.spacing * np.array(run.grid.shape)
    assert np.ptp(views, axis=0).max() == 0.0
    low, high = views[0, [0, 2]], views[0, [1, 3]]
    assert np.allclose(low, origins.min(axis=0)[:2])
    assert np.allclose(high, (origins.max(axis=0) + size)[:2])


def drawn(run: Run, number: int, shown: Shot) -> tuple[np.ndarray, MapSlab]:
    picture = Picture(run, 1.0, shown)
    image = picture.draw(number)[:, :, :3].astype(float)
    assert isinstance(picture.map, MapSlab)
    return image, picture.map


@pytest.mark.parametrize("field", ["dye", "vorticity", "speed"])
def test_from_the_world_the_water_stands_still_while_the_domain_moves(run: Run, field: str) -> None:
    """Where the domain is in both frames, a few cells from its sides, the pictures are the same."""
    shown = shot(follow="nothing", field=field)
    pictures = [drawn(run, number, shown)[0] for number in (10, 40)]
    x0, x1, y0, y1 = views_of(run, shown)[0]
    height, width = pictures[0].shape[:2]
    assert run.grid is not None
    h, origins = run.grid.spacing, run.origins()[[10, 40], :2]
    margin = (FADED * run.grid.shape[0] + 2.0) * h
    low = origins.max(axis=0) + margin
    high = origins.min(axis=0) + h * np.array(run.grid.shape[:2]) - margin
    columns = slice(*np.rint((np.array([low[0], high[0]]) - x0) / (x1 - x0) * width).astype(int))
    rows = slice(*np.rint((y1 - np.array([high[1], low[1]])) / (y1 - y0) * height).astype(int))
    first, second = (picture[rows, columns] for picture in pictures)
    assert first.size > 0.3 * pictures[0].size
    assert first.std() > 10.0
    # the force's arrow and the block are the same; speed and vorticity are interpolated in bytes
    assert np.abs(first - second).mean() < 0.5
    assert np.percentile(np.abs(first - second), 99.0) < 8.0


def test_beyond_the_domain_is_plain_water_without_a_seam(run: Run) -> None:
    shown = shot(follow="nothing", field="speed")
    image, _ = drawn(run, 60, shown)
    x0, x1 = views_of(run, shown)[0, :2]
    height, width = image.shape[:2]
    assert run.grid is not None
    low = run.origins()[60]
    water = 255.0 * style.rgb(style.WATER)
    left = round((low[0] - x0) / (x1 - x0) * width)
    assert left > 50
    assert np.abs(image[: height // 2, : left - 2] - water).max() < 1.5
    # at the side itself the picture goes over into the water by small steps
    band = image[height // 4 : height // 2, left - 4 : left + 5]
    assert np.abs(np.diff(band, axis=1)).max() < 12.0


def test_a_plane_goes_through_the_domain_where_the_focus_is_not(run: Run) -> None:
    assert run.grid is not None
    focus = np.zeros((len(run), 3))
    assert np.array_equal(through_window(run, focus), focus)
    focus[:, 0] = run.grid.origin[0] + 0.1
    found = through_window(run, focus)
    middle = run.origins()[:, 0] + 0.5 * run.grid.spacing * run.grid.shape[0]
    assert np.abs(found[:, 0] - middle).max() < 1.5 * run.grid.spacing
    assert np.array_equal(found[:, 1:], focus[:, 1:])
