"""A geometry of one's own: a ring."""

from __future__ import annotations

import shutil
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import flowborne as fb
from flowborne.parts import PlacedShape
from flowborne.scenes.load import check_scene
from flowborne.shapes.own import ShapeOwn, allow_for_curvature, triangulated
from flowborne.worlds import advance, cut_by_bodies, make_world

from ..own_parts.torus import Torus

RING, RADIUS, TUBE = Torus(0.3, 0.1), 0.3, 0.1
VOLUME = 2.0 * np.pi**2 * RADIUS * TUBE**2
ACROSS, ABOUT = RADIUS**2 / 2.0 + 5.0 / 8.0 * TUBE**2, RADIUS**2 + 0.75 * TUBE**2
"""Moments of inertia over mass about an axis across the ring and about its own, m^2."""

TURN = Rotation.from_euler("XYZ", [20.0, 30.0, 40.0], degrees=True).as_matrix()
MODEL = '<mujoco><worldbody><body name="ring"><freejoint/></body></worldbody></mujoco>'


def ring(*shapes: PlacedShape) -> fb.SolidModel:
    return fb.SolidModel.from_string(MODEL, shapes=shapes, gravity=(0.0, 0.0, 0.0))


PLACED = PlacedShape(RING, "ring", np.array([0.02, -0.01, 0.03]), TURN, 10.0)


def test_mass_and_inertia_are_those_of_a_ring() -> None:
    model = ring(PLACED)
    assert model.volume[1] == pytest.approx(VOLUME, rel=3e-3)
    assert model.body_mass[1] == pytest.approx(10.0 * VOLUME, rel=3e-3)
    np.testing.assert_allclose(model.centroid[1], PLACED.position, atol=1e-6)
    expected = model.body_mass[1] * np.array([ABOUT, ACROSS, ACROSS])
    np.testing.assert_allclose(np.sort(model.mj.body_inertia[1])[::-1], expected, rtol=3e-3)


def test_its_density_wins_over_that_of_all_bodies() -> None:
    for own, expected in ((10.0, 10.0), (None, 500.0)):
        shape = replace(PLACED, density=own)
        model = fb.SolidModel.from_string(MODEL, density=500.0, shapes=[shape])
        assert model.body_mass[1] == pytest.approx(expected * VOLUME, rel=3e-3)


def test_the_distance_is_its_own_wherever_the_model_puts_it() -> None:
    """In the body's frame, and not that of the triangles."""
    model = ring(PLACED)
    points = np.random.default_rng(0).uniform(-0.5, 0.5, (50, 3))
    exact = RING.distance((points - PLACED.position) @ TURN)
    local = (points - model.geom_offset[0]) @ model.geom_rotation[0]
    np.testing.assert_allclose(model.geom_shape[0].distance(local), exact, atol=1e-7)


@pytest.mark.parametrize("n", [24, 48])
def test_the_fluid_sees_its_volume(n: int) -> None:
    h = 1.2 / n
    grid = fb.Grid((n, n, n), h, (-0.61, -0.6, -0.593))
    cut = cut_by_bodies(make_world(ring(PLACED), grid))
    solid = grid.shape[0] ** 3 * h**3 - cut.volume.sum()
    assert solid == pytest.approx(VOLUME, rel=0.03 if n == 24 else 6e-3)


def test_curvature_counts_where_the_distance_has_no_kink() -> None:
    """Of a ball with a radius of 20 pitches, h^2/12 2/R; not of a thin plate."""
    x, y, z = 0.5 * (np.indices((48, 48, 48)) - 23.5)
    ball, plate = np.sqrt(x**2 + y**2 + z**2) - 10.0, np.abs(x) - 0.25
    less = (ball - allow_for_curvature(ball, 0.5))[np.abs(ball) < 0.5]
    np.testing.assert_allclose(less, 0.25 / 60.0, rtol=0.15)
    np.testing.assert_array_equal(allow_for_curvature(plate, 0.5), plate)


def test_fluid_goes_through_the_hole_and_not_through_the_ring() -> None:
    n = 24
    grid = fb.Grid((n, n, n), 1.2 / n, (-0.6, -0.6, -0.6))
    cut = cut_by_bodies(make_world(ring(PlacedShape(RING, "ring")), grid))
    assert cut.open[2][n // 2, n // 2, n // 2] == 1.0
    x = grid.cell_coordinates()[0]
    tube = int(np.argmin(np.abs(x - RADIUS)))
    assert cut.open[2][tube, n // 2, n // 2] == 0.0


def test_a_thin_ring_is_thickened_all_around() -> None:
    model = ring(PlacedShape(Torus(0.3, 0.04), "ring"))
    shape = model.geom_shape[0]
    assert shape.thickness == pytest.approx(0.08, rel=0.03)
    thick = shape.thickened(0.08)
    assert thick.thickness == pytest.approx(0.16, rel=1e-9)
    np.testing.assert_allclose(thick.reach - shape.reach, 0.5 * (0.16 - shape.thickness))


def test_a_light_ring_in_a_flow_is_pushed_along() -> None:
    """The step goes through, and its momentum is what the fluid lost."""
    grid = fb.Grid((20, 20, 20), 0.06, (-0.6, -0.6, -0.6))
    world = make_world(ring(PlacedShape(RING, "ring", density=0.1)), grid)
    world.solid.v[2] = 1.0
    report = advance(world, 0.01, 2)
    assert 0.0 < world.solid.v[2] < 0.5
    assert report.divergence < 1e-6


@dataclass(frozen=True)
class Bad:
    half: float
    shift: float

    def distance(self, points: np.ndarray) -> np.ndarray:
        return np.linalg.norm(points, axis=1) - self.shift

    def half_extents(self) -> tuple[float, float, float]:
        return self.half, self.half, self.half


class Several(Bad):
    def distance(self, points: np.ndarray) -> np.ndarray:
        return points


class Broken(Bad):
    def distance(self, points: np.ndarray) -> np.ndarray:
        return points.nothing


@pytest.mark.parametrize(
    ("geometry", "said"),
    [
        (Bad(1.0, 1.2), "shape 'Bad' reaches beyond its half extents"),
        (Bad(1.0, -0.1), "holds none of its box"),
        (Bad(0.0, 1.0), "has the half extents"),
        (Several(1.0, 0.5), "gave an array of shape"),
        (Broken(1.0, 0.5), "failed in test_own.py, line"),
    ],
)
def test_what_is_no_geometry_is_said(geometry: Bad, said: str) -> None:
    with pytest.raises(fb.PartError, match=said):
        triangulated(geometry)
    with pytest.raises(ValueError, match=said):
        ring(PlacedShape(geometry, "ring"))


SCENE = """
plugins = ["torus.py"]
gravity = [0.0, 0.0, -1.0]

[time]
frames = 2

[domain]
lower = [-0.6, -0.6, -0.6]
upper = [0.6, 0.6, 0.6]
resolution = 16

[fluid]
density = 1.0

[solids]
model = "ring.xml"

[[shapes]]
kind = "torus"
body = "ring"
radius = 0.3
tube = 0.1
axis = [1.0, 0.0, 0.0]
density = 2.0
"""


@pytest.fixture
def scene(tmp_path: Path) -> Path:
    shutil.copy(Path(__file__).parents[1] / "own_parts" / "torus.py", tmp_path)
    (tmp_path / "ring.xml").write_text(MODEL)
    file = tmp_path / "sinking.toml"
    file.write_text(SCENE)
    return file


def test_a_ring_from_a_scene_file_sinks_and_its_run_stands_on_its_own(
    scene: Path, tmp_path: Path
) -> None:
    result = fb.run(scene, tmp_path / "run", film=False)
    assert result.outcome.name == "DONE", result.message
    model = fb.Simulation(tmp_path / "run" / "scene.toml").world.setup.solid
    shape = model.geom_shape[0]
    assert isinstance(shape, ShapeOwn)
    assert model.body_mass[1] == pytest.approx(2.0 * VOLUME, rel=3e-3)
    upright = (model.geom_rotation[0] * shape.reach) ** 2
    np.testing.assert_allclose(np.sqrt(upright.sum(axis=1)).argmin(), 0)
    assert (tmp_path / "run" / "torus.py").is_file()


@pytest.mark.parametrize(
    ("before", "after", "said"),
    [
        ('kind = "torus"', 'kind = "tours"', "'tours' is not known. Plugins have registered"),
        ("tube = 0.1", "", "of kind 'torus': key 'tube' is missing. Add it"),
        ('body = "ring"', 'body = "rung"', "there is no body 'rung' for a shape. There are: world"),
        ("axis = [1.0, 0.0, 0.0]", "axis = [0.0, 0.0, 0.0]", "has an axis of no length"),
        ("density = 2.0", "density = 2.0\neuler = [0.0, 0.0, 90.0]", "both euler and axis"),
        ("tube = 0.1", "tube = -0.1", "half extents"),
    ],
)
def test_what_is_wrong_with_a_table_is_one_message(
    scene: Path, before: str, after: str, said: str
) -> None:
    scene.write_text(SCENE.replace(before, after, 1))
    problems = check_scene(scene)
    assert len(problems) == 1, problems
    assert said in problems[0]
