"""The camera keeps the bodies in the map, of one size, without shaking."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from flowborne.fluid.grid import Grid
from flowborne.scenes.schema_film import CameraTable
from flowborne.shapes.primitives import shape_of
from flowborne.view.framing import swept
from flowborne.view.run import Run
from flowborne.view.shot import Shot
from flowborne.view.space.camera import FILLED, FILLED_BY_FLUID, Camera, camera_of

from .projecting import project

Make = Callable[..., Run]

BALL = ("sphere", (0.1, 0.0, 0.0))
TIMES = np.arange(97) / 24.0


def seen_by_default(run: Run) -> Camera:
    return camera_of(run, Shot())


def on_map(run: Run) -> np.ndarray:
    """(frames, n, 2) places on the map of what the bodies sweep."""
    camera = camera_of(run, run.shot)
    places = swept(run, range(len(run.geoms)))
    return np.stack([project(camera, n, points) for n, points in enumerate(places)])


def walk(sway: float = 0.0) -> np.ndarray:
    """(97, 2, 3) two balls, one over the other, that walk along x and bob up and down."""
    middle = np.outer(TIMES, [1.3, 0.2, 0.0])
    middle[:, 2] += sway * np.sin(2.0 * np.pi * 2.0 * TIMES)
    return middle[:, None] + np.array([[0.0, 0.0, 0.3], [0.2, 0.0, 1.6]])


def test_bodies_fill_the_map_and_stay_within_it_over_the_whole_run(run_of: Make) -> None:
    run = run_of([BALL, BALL], walk(0.1))
    places = on_map(run)
    low, high = 0.5 - 0.5 * FILLED, 0.5 + 0.5 * FILLED
    assert places.min() > low - 1e-3
    assert places.max() < high + 1e-3
    assert np.ptp(places[..., 1]) == pytest.approx(FILLED, abs=0.02)


def test_a_body_keeps_its_size_and_place_while_it_walks(run_of: Make) -> None:
    places = on_map(run_of([BALL, BALL], walk()))
    np.testing.assert_allclose(places, np.broadcast_to(places[:1], places.shape), atol=1e-4)


def test_the_camera_does_not_bob_with_the_bodies(run_of: Make) -> None:
    """Steps at 2 Hz come through with less than a tenth of their size."""
    focus = seen_by_default(run_of([BALL, BALL], walk(0.1))).focus
    assert np.ptp(focus[:, 2]) < 0.02
    speed = 24.0 * np.diff(focus[:, 0])
    np.testing.assert_allclose(speed, 1.3, rtol=1e-3)


def test_bodies_that_fly_apart_are_kept_in_the_map(run_of: Make) -> None:
    centres = np.zeros((49, 3, 3))
    rng = np.random.default_rng(3)
    centres += np.linspace(0.0, 2.0, 49)[:, None, None] * rng.normal(size=(3, 3))
    places = on_map(run_of([BALL, BALL, ("box", (0.5, 0.1, 0.2))], centres))
    assert 0.05 < places.min() < places.max() < 0.95


def test_lost_numbers_do_not_lose_the_camera(run_of: Make) -> None:
    centres = walk()
    whole = seen_by_default(run_of([BALL, BALL], centres[:80]))
    centres[80:] = np.nan
    camera = seen_by_default(run_of([BALL, BALL], centres))
    np.testing.assert_allclose(camera.focus[:80], whole.focus)
    np.testing.assert_allclose(camera.focus[80:], np.broadcast_to(whole.focus[-1], (17, 3)))
    assert camera.distance == whole.distance


def test_a_fluid_is_seen_whole_unless_it_is_much_larger(run_of: Make, box_of_fluid: Grid) -> None:
    centres = walk()[:, :1] - [2.0, 0.0, 0.3]
    camera = seen_by_default(run_of([("sphere", (1.0, 0.0, 0.0))], centres, grid=box_of_fluid))
    assert np.ptp(camera.focus, axis=0).max() == 0.0
    low, high = np.array(box_of_fluid.origin), np.array(box_of_fluid.upper)
    corners = np.array(np.meshgrid(*zip(low, high, strict=True))).reshape(3, -1).T
    places = project(camera, 0, corners)
    assert np.ptp(places, axis=0).max() == pytest.approx(FILLED_BY_FLUID, abs=0.01)
    lake = Grid((50, 50, 50), 0.4, (-10.0, -10.0, -10.0))
    followed = seen_by_default(run_of([BALL], centres, grid=lake))
    assert np.ptp(followed.focus[:, 0]) == pytest.approx(np.ptp(centres[..., 0]), rel=0.01)
    assert followed.height < 2.0


def shot_by(**camera: object) -> Shot:
    return Shot(camera=CameraTable(**camera))  # type: ignore[arg-type]


def test_the_maps_axes_are_a_frame_and_x_leads_to_the_right_and_nearer(run_of: Make) -> None:
    axes = seen_by_default(run_of([BALL], walk()[:, :1])).axes(3)
    np.testing.assert_allclose(axes @ axes.T, np.eye(3), atol=1e-15)
    assert np.linalg.det(axes) > 0.0
    right, up, toward = axes
    assert right[0] > 0.5
    assert toward[0] > 0.3
    assert up[2] > 0.9


def test_a_camera_that_orbits_goes_around_at_its_pace(run_of: Make) -> None:
    camera = camera_of(run_of([BALL, BALL], walk()), shot_by(orbit=30.0))
    azimuth = np.unwrap(np.arctan2(camera.away[:, 1], camera.away[:, 0]))
    np.testing.assert_allclose(np.degrees(np.gradient(azimuth, TIMES)), 30.0, rtol=1e-6)
    np.testing.assert_allclose(np.linalg.norm(camera.away, axis=1), camera.distance)
    places = np.stack([project(camera, n, points) for n, points in enumerate(walk())])
    assert 0.05 < places.min() < places.max() < 0.95, "nothing leaves the map on the way round"


def test_a_camera_at_a_place_of_its_own_looks_at_what_it_follows(run_of: Make) -> None:
    position = (0.0, -6.0, 2.0)
    run = run_of([BALL, BALL], walk())
    camera = camera_of(run, shot_by(position=position, lens=40.0))
    np.testing.assert_allclose(camera.focus + camera.away, np.broadcast_to(position, (97, 3)))
    middles = np.stack([project(camera, n, camera.focus[n, None])[0] for n in range(97)])
    np.testing.assert_allclose(middles, 0.5)
    aimed = camera_of(run, shot_by(position=position, target=(1.0, 0.0, 1.0)))
    np.testing.assert_allclose(aimed.focus, np.broadcast_to((1.0, 0.0, 1.0), (97, 3)))


def test_distance_and_lens_say_how_much_is_seen(run_of: Make) -> None:
    run = run_of([BALL, BALL], walk())
    near, far = (camera_of(run, shot_by(distance=d, lens=60.0)) for d in (2.0, 4.0))
    assert near.height == pytest.approx(4.0 * np.tan(np.radians(30.0)))
    assert far.height == pytest.approx(2.0 * near.height)


def test_one_body_is_followed_or_nothing(run_of: Make) -> None:
    centres = walk()
    centres[:, 1] += np.outer(TIMES, [0.0, 1.0, 0.0])
    run = run_of([BALL, BALL], centres)
    camera = camera_of(run, shot_by(follow="body 1"))
    np.testing.assert_allclose(camera.focus - camera.focus[0], centres[:, 1] - centres[0, 1],
                               atol=1e-5)  # fmt: skip
    still = camera_of(run, shot_by(follow="nothing"))
    assert np.ptp(still.focus, axis=0).max() == 0.0
    places = np.stack([project(still, n, points) for n, points in enumerate(centres)])
    assert 0.0 < places.min() < places.max() < 1.0
    with pytest.raises(ValueError, match="cannot follow body 'tail'; the bodies are world, body"):
        camera_of(run, shot_by(follow="tail"))


@pytest.mark.parametrize(
    ("kind", "size", "reach"),
    [
        ("sphere", (0.2, 0.0, 0.0), (0.2, 0.2, 0.2)),
        ("capsule", (0.2, 0.5, 0.0), (0.2, 0.2, 0.7)),
        ("cylinder", (0.2, 0.5, 0.0), (0.2, 0.2, 0.5)),
        ("box", (0.2, 0.5, 0.3), (0.2, 0.5, 0.3)),
        ("ellipsoid", (0.2, 0.5, 0.3), (0.2, 0.5, 0.3)),
    ],
)
def test_outermost_places_reach_as_far_as_the_geometry(
    kind: str, size: tuple[float, ...], reach: tuple[float, ...]
) -> None:
    places = shape_of(kind, np.array(size), None).outermost()
    np.testing.assert_allclose(places.max(axis=0), reach)
    np.testing.assert_allclose(places.min(axis=0), -np.array(reach))


def test_a_source_of_dye_nearby_is_seen_where_dye_is(run_of: Make) -> None:
    """Below the body, in a lake of which all else is left out; not one that is far away."""
    centres = np.zeros((9, 1, 3))
    lake = Grid((80, 80, 80), 0.2, (-8.0, -8.0, -8.0))
    near, far = [[-0.3, -0.3, -0.5], [0.3, 0.3, -0.4]], [[3.0, 3.0, -6.0], [4.0, 4.0, -5.0]]
    ball = ("sphere", (0.5, 0.0, 0.0))
    run = run_of([ball], centres, grid=lake, sources=np.array([near, far]))
    still, dyed = (camera_of(run, Shot(field=field)) for field in ("speed", "dye"))
    corners = np.array(np.meshgrid(*zip(*near, strict=True))).reshape(3, -1).T
    inside = project(dyed, 0, corners)
    assert 0.0 < inside.min() < inside.max() < 1.0
    assert dyed.height < 2.0 * still.height
