"""A domain of fluid that follows bodies, in three dimensions."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import closing

import numpy as np
import pytest
from numpy.testing import assert_allclose

from flowborne.fluid.grid import Grid
from flowborne.scenes.schema_film import CameraTable
from flowborne.view import style
from flowborne.view.fields import FieldDye, FieldVortices, side_weight
from flowborne.view.pictures import Picture
from flowborne.view.run import Run
from flowborne.view.shot import Shot
from flowborne.view.space.camera import FILLED_BY_FLUID, Camera, camera_of
from flowborne.view.space.stage import MapSpace
from flowborne.view.space.surroundings import water_of

from .projecting import project
from .test_fields import turning
from .test_map_space import drawn, of_hue, pixel_of

Make = Callable[..., Run]

BALL = ("sphere", (0.4, 0.0, 0.0))
LARGE = ("sphere", (1.0, 0.0, 0.0))
FRAMES = 49
MOVED = np.trunc(np.outer(np.arange(FRAMES), [0.25, 0.0, 0.1]))
"""Cells by which the domain has moved in each frame."""


@pytest.fixture
def run(run_of: Make, box_of_fluid: Grid) -> Run:
    """A ball that goes along with its domain, which is much larger."""
    return followed(run_of, box_of_fluid, BALL)


@pytest.fixture
def filled(run_of: Make, box_of_fluid: Grid) -> Run:
    """The same with a ball that fills its domain."""
    return followed(run_of, box_of_fluid, LARGE)


def followed(run_of: Make, box_of_fluid: Grid, ball: tuple[str, tuple[float, ...]]) -> Run:
    centres = 0.2 * np.outer(np.arange(FRAMES), [0.25, 0.0, 0.1])[:, None]
    origins = np.array(box_of_fluid.origin) + box_of_fluid.spacing * MOVED
    return run_of([ball], centres, grid=box_of_fluid, origins=origins)


def camera(run: Run, follow: str) -> Camera:
    return camera_of(run, Shot(field="none", camera=CameraTable(follow=follow)))


def corners_of(run: Run, number: int) -> np.ndarray:
    grid = run.grid_at(run.state(number))
    return np.array(np.meshgrid(*zip(grid.origin, grid.upper, strict=True))).reshape(3, -1).T


def test_a_camera_along_with_the_bodies_has_the_domain_in_view(filled: Run) -> None:
    found = camera(filled, "bodies")
    steps = np.diff(found.focus[10:-10], axis=0) / 0.2
    assert np.abs(steps - [0.25, 0.0, 0.1]).max() < 0.01
    sizes = [np.ptp(project(found, n, corners_of(filled, n)), axis=0).max() for n in range(FRAMES)]
    assert sizes == pytest.approx([FILLED_BY_FLUID] * FRAMES, abs=0.12)


def test_a_camera_that_follows_nothing_has_the_whole_way_in_view(filled: Run) -> None:
    found = camera(filled, "nothing")
    assert np.ptp(found.focus, axis=0).max() == 0.0
    places = np.concatenate([project(found, n, corners_of(filled, n)) for n in range(FRAMES)])
    assert np.ptp(places, axis=0).max() == pytest.approx(FILLED_BY_FLUID, abs=0.01)


def with_dye(run: Run, dye: np.ndarray) -> None:
    for path in run._states:
        with np.load(path) as file:
            arrays = dict(file)
        np.savez(path, **arrays, open=np.ones_like(dye), scalar_dye=dye)


@pytest.mark.parametrize("follow", ["bodies", "nothing"])
def test_dye_glows_where_it_is_and_the_box_is_around_it(
    run: Run, box_of_fluid: Grid, follow: str
) -> None:
    dye = np.zeros(box_of_fluid.shape, np.float32)
    dye[8:11, 3:7, 4:7] = 1.0
    with_dye(run, dye)
    run.shot = Shot(field="dye", camera=CameraTable(follow=follow, distance=12.0))
    with closing(Picture(run)) as picture:
        assert isinstance(picture.map, MapSpace)
        for number in (0, 40):
            grid = run.grid_at(run.state(number))
            cyan = of_hue(drawn(picture, number), style.DYES[0])
            middle = np.array(grid.origin) + grid.spacing * np.array([9.5, 5.0, 5.5])
            row, column = np.argwhere(cyan).mean(axis=0)
            assert (row, column) == pytest.approx(pixel_of(picture, number, middle), abs=15.0)
            moved = [np.array(edge.position) for _, edge in picture.map._edges]
            assert np.abs(moved - 0.2 * MOVED[number]).max() < 1.6 * 0.2


def test_dye_and_vortices_end_softly_at_the_sides(run: Run, box_of_fluid: Grid) -> None:
    state = turning(box_of_fluid, np.array([0.0, 0.0, 2.0]))
    state["scalar_dye"] = np.ones(box_of_fluid.shape, np.float32)
    with_dye(run, state["scalar_dye"])
    run.sampled = lambda most: [state]  # type: ignore[method-assign]
    weight = side_weight(box_of_fluid.shape, (0, 1, 2))
    assert_allclose(FieldVortices(run).q(state), 4.0 * weight, rtol=1e-4)
    smoke = FieldDye(run).smoke(state)[1]
    assert_allclose(smoke, weight, rtol=1e-5)


def test_weights_fall_to_nothing_at_the_sides() -> None:
    weight = side_weight((100, 3), (0,))
    assert_allclose(weight, weight[::-1])
    assert_allclose(weight[8:-8], 1.0)
    assert (np.diff(weight[:8, 0]) > 0.0).all()
    assert weight[0].max() < 0.02


def test_water_goes_on_where_the_domain_may_go(run: Run, box_of_fluid: Grid) -> None:
    low, high = water_of(run)
    assert np.isneginf(low).all()
    assert np.isposinf(high).all()
    run.tables = {"domain": {"follow": "bodies", "along": ["x"]}}
    low, high = water_of(run)
    assert np.array_equal(low, [-np.inf, *box_of_fluid.origin[1:]])
    assert np.array_equal(high, [np.inf, *box_of_fluid.upper[1:]])
