"""Closed parts of faces: areas and volumes of the bodies, and how bodies share a face."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from flowborne.coupling.fractions import Geometry
from flowborne.fluid.boundary import Boundaries
from flowborne.fluid.grid import Grid
from flowborne.fluid.sides.kinds import BoundaryInflow, BoundaryOpen
from flowborne.kernels.arrays import Array
from flowborne.shapes.primitives import PRIMITIVES
from flowborne.shapes.shape import Shape

Cut = Callable[..., Geometry]

OFFSETS = np.random.default_rng(3).random((8, 3))
"""Places of the domain's corner relative to the bodies, in cells: an error is a mean over them."""

FLAT = {
    "disc": ('type="sphere" size="0.2"', np.pi * 0.2**2),
    "box": ('type="box" size="0.35 0.25 1"', 4 * 0.35 * 0.25),
    "capsule": (
        'type="capsule" size="0.1 0.2" euler="1.5707963267948966 0 0"',
        4 * 0.1 * 0.2 + np.pi * 0.1**2,
    ),
    "ellipse": ('type="ellipsoid" size="0.3 0.15 1"', np.pi * 0.3 * 0.15),
}
"""Geometry in MJCF and its cross-section, m^2."""

ROUND = {
    "sphere": ('type="sphere" size="0.3"', 4.0 / 3.0 * np.pi * 0.3**3),
    "box": ('type="box" size="0.25 0.2 0.3"', 8 * 0.25 * 0.2 * 0.3),
    "capsule": (
        'type="capsule" size="0.2 0.2"',
        2.0 * np.pi * 0.2**2 * 0.2 + 4.0 / 3.0 * np.pi * 0.2**3,
    ),
    "cylinder": ('type="cylinder" size="0.2 0.25"', 2.0 * np.pi * 0.2**2 * 0.25),
    "ellipsoid": ('type="ellipsoid" size="0.3 0.2 0.25"', 4.0 / 3.0 * np.pi * 0.3 * 0.2 * 0.25),
}
"""Geometry in MJCF and its volume, m^3."""

PLACES = 100


def solid(cut: Geometry, grid: Grid) -> tuple[float, Array]:
    """Volume of what bodies take of the cells, and its centroid, m."""
    closed = grid.cell_volume - cut.volume
    places = np.meshgrid(*grid.cell_coordinates(), indexing="ij")
    volume = float(closed.sum())
    return volume, np.array([float((closed * x).sum()) for x in places]) / volume


def sections(cut: Geometry, grid: Grid, axis: int) -> Array:
    """Area that bodies close of each plane of faces across an axis, m^2; m in a slab."""
    others = tuple(d for d in range(3) if d != axis)
    return grid.face_area * (1.0 - cut.open[axis]).sum(axis=others)


def exact_sections(shape: Shape, turn: Array, heights: Array, axis: int, reach: float) -> Array:
    """Areas of the sections at some heights above the middle, from lines through the shape."""
    count = 240
    lines = reach * (2.0 * (np.arange(count) + 0.5) / count - 1.0)
    others = [d for d in range(3) if d != axis]
    areas = []
    for height in heights:
        start = np.zeros((count, 3))
        start[:, axis], start[:, others[0]] = height, lines
        enter, leave = shape.interval(start @ turn, np.eye(3)[others[1]] @ turn)
        areas.append(np.maximum(leave - enter, 0.0)[leave > enter].sum() * 2.0 * reach / count)
    return np.array(areas)


@pytest.mark.parametrize("shape", FLAT)
def test_a_slab_has_the_area_of_a_body_wherever_it_is(cut: Cut, shape: str) -> None:
    """Within 0.5 % in each of a hundred places and turns."""
    geom, area = FLAT[shape]
    h = 1.0 / 40
    random = np.random.default_rng(1)
    worst, away = 0.0, 0.0
    for _ in range(PLACES):
        x, y = random.random(2)
        turn = f'<body euler="0 0 {random.uniform(0.0, 6.28)}"><freejoint/><geom {geom}/></body>'
        grid = Grid.slab(40, 40, h, (-0.5 - x * h, -0.5 - y * h))
        found, centre = solid(cut(grid, turn), grid)
        worst = max(worst, abs(found / area - 1.0))
        away = max(away, float(np.linalg.norm(centre[:2])))
    assert worst < 5e-3
    assert away < 5e-3 * np.sqrt(area)


def test_a_box_of_few_cells_has_its_area_wherever_it_is(cut: Cut) -> None:
    """Its corners pass between nodes: 8 x 5 cells, to rounding."""
    random, grid, worst = np.random.default_rng(4), Grid.slab(12, 12, 1.0, (-6.0, -6.0)), 0.0
    for _ in range(PLACES):
        (x, y), turn = random.random(2) - 0.5, random.uniform(0.0, 6.28)
        box = '<geom type="box" size="4 2.5 1"/>'
        body = f'<body pos="{x} {y} 0" euler="0 0 {turn}"><freejoint/>{box}</body>'
        worst = max(worst, abs(solid(cut(grid, body), grid)[0] / 40.0 - 1.0))
    assert worst < 1e-11


@pytest.mark.parametrize("shape", ROUND)
def test_a_room_has_the_volume_of_a_body_wherever_it_is(cut: Cut, shape: str) -> None:
    """Within 0.5 % in a hundred places and turns, its sections within 3 % of the largest."""
    geom, volume = ROUND[shape]
    n = 22
    h = 1.1 / n
    random = np.random.default_rng(2)
    errors = np.empty((PLACES, 3))
    for place in range(PLACES):
        a, b, c, w = random.standard_normal(4)
        turn = f'<body quat="{w} {a} {b} {c}"><freejoint/><geom {geom}/></body>'
        grid = Grid((n, n, n), h, tuple(-0.55 - random.random(3) * h))
        made = cut(grid, turn)
        found, centre = solid(made, grid)
        axis, kind, size = place % 3, *geom.split('"')[1:4:2]
        half = PRIMITIVES[kind](np.resize(np.array(size.split(), float), 3))
        frame = Rotation.from_quat([a, b, c, w]).as_matrix()
        heights = grid.face_coordinates(axis)[axis]
        exact = exact_sections(half, frame, heights, axis, 0.55)
        off = np.abs(sections(made, grid, axis) - exact).max() / exact.max()
        errors[place] = abs(found / volume - 1.0), np.linalg.norm(centre) / np.cbrt(volume), off
    assert (errors.max(axis=0) < (5e-3, 5e-3, 3e-2)).all(), errors.max(axis=0)


@pytest.mark.parametrize("axis", [0, 1])
def test_chords_of_a_disc_are_its_own(cut: Cut, axis: int) -> None:
    """Sum of the closed parts along a line of faces against the chord that the circle cuts."""
    radius, h = 0.2, 1.0 / 32
    for x, y, _ in OFFSETS:
        grid = Grid.slab(32, 32, h, (-0.5 - x * h, -0.5 - y * h))
        closed = 1.0 - cut(grid, f'<geom type="sphere" size="{radius}"/>').open[axis][:, :, 0]
        place = grid.face_coordinates(axis)[axis]
        inner = np.abs(place) < 0.5 * radius
        chord = 2.0 * np.sqrt(radius**2 - place[inner] ** 2)
        np.testing.assert_allclose(h * closed.sum(axis=1 - axis)[inner], chord, rtol=1e-11)


def test_half_covered_faces_are_half_open(cut: Cut) -> None:
    """A box whose sides run through the middles of cells."""
    grid = Grid.slab(16, 12, 0.5, (0.0, 0.0))
    opened = cut(grid, '<geom type="box" pos="4 3 0" size="1.75 1.25 1"/>').open
    across_x, across_y = np.zeros((17, 12)), np.zeros((16, 13))
    across_x[5:12, 4:8], across_x[5:12, [3, 8]] = 1.0, 0.5
    across_y[5:11, 4:9], across_y[[4, 11], 4:9] = 1.0, 0.5
    np.testing.assert_allclose(1.0 - opened[0][:, :, 0], across_x, atol=1e-14)
    np.testing.assert_allclose(1.0 - opened[1][:, :, 0], across_y, atol=1e-14)
    assert not opened[2].any()


def shares(cut: Geometry, body: int, grid: Grid) -> list[Array]:
    """What one body closes of every face, per axis."""
    parts = []
    for axis in range(3):
        own = (cut.closed.axis == axis) & (cut.closed.body == body)
        part = np.zeros(grid.face_shape(axis))
        np.add.at(part.reshape(-1), cut.closed.face[own], cut.closed.part[own])
        parts.append(part)
    return parts


def test_touching_bodies_share_a_face_where_they_touch(cut: Cut) -> None:
    """Two boxes that meet in the middle of a column of cells close it together, half each."""
    grid = Grid.slab(16, 16, 1.0, (0.0, 0.0))
    left = '<body pos="6.25 8 0"><freejoint/><geom type="box" size="2.25 3 1"/></body>'
    right = '<body pos="10.75 8 0"><freejoint/><geom type="box" size="2.25 3 1"/></body>'
    found = cut(grid, left, right)
    first, second = (shares(found, body, grid)[1][:, :, 0] for body in (1, 2))
    inner = slice(6, 11)
    np.testing.assert_allclose(first[8, inner], 0.5, atol=1e-14)
    np.testing.assert_allclose(second[8, inner], 0.5, atol=1e-14)
    np.testing.assert_allclose(found.open[1][4:12, inner, 0], 0.0, atol=1e-14)
    np.testing.assert_allclose(first[4:8, inner], 1.0, atol=1e-14)
    np.testing.assert_allclose(second[4:8, inner], 0.0, atol=1e-14)


@pytest.mark.parametrize("gap", [-0.15, 0.0, 0.013])
def test_what_bodies_close_is_what_is_not_open(cut: Cut, gap: float) -> None:
    """Overlapping, touching and nearly touching discs, and a third on top of both."""
    grid = Grid.slab(40, 40, 0.025, (0.0, 0.0))
    discs = [(0.5 - 0.15 - gap / 2, 0.4), (0.5 + 0.15 + gap / 2, 0.4), (0.5, 0.62)]
    found = cut(
        grid,
        *(
            f'<body pos="{x} {y} 0"><freejoint/><geom type="sphere" size="0.15"/></body>'
            for x, y in discs
        ),
    )
    parts = [shares(found, body, grid) for body in (1, 2, 3)]
    for axis in (0, 1):
        together = sum(part[axis] for part in parts)
        np.testing.assert_allclose(together, 1.0 - found.open[axis], atol=1e-14)
        assert min(part[axis].min() for part in parts) >= 0.0


def test_sides_decide_what_crosses_them_and_not_the_body(cut: Cut) -> None:
    """A body through two sides: its parts are listed on the open side alone."""
    still = BoundaryInflow(lambda x, y, z, time: (0 * x, 0 * y, 0 * z))
    grid = Grid.slab(16, 16, 1.0, (0.0, 0.0))
    bar = '<body pos="8 8 0"><freejoint/><geom type="box" size="12 2 1"/></body>'
    for side, listed in ((still, False), (BoundaryOpen(), True)):
        found = cut(grid, bar, boundaries=Boundaries(x_min=side, x_max=BoundaryOpen()))
        np.testing.assert_array_equal(found.open[0][[0, -1], 6:10], 0.0)
        at_side = shares(found, 1, grid)[0][0, 6:10]
        assert at_side.all() == listed
        assert at_side.any() == listed


def test_cells_deep_inside_a_body_have_no_row(cut: Cut) -> None:
    grid = Grid.slab(32, 32, 1.0, (0.0, 0.0))
    found = cut(grid, '<body pos="16 16 0"><freejoint/><geom type="sphere" size="8"/></body>')
    x, y = found.rows[0] // 32 + 0.5, found.rows[0] % 32 + 0.5
    assert np.abs(np.hypot(x - 16, y - 16) - 8).max() < np.sqrt(2.0)
    assert np.unique(found.rows[0]).size == found.rows[0].size


@pytest.mark.parametrize("meshes", [False, True], ids=["box", "mesh"])
@pytest.mark.parametrize("thickness", [1.0, 0.25, 0.01])
def test_a_thin_plate_closes_an_unbroken_line_of_faces_at_every_angle(
    cut: Cut, thickness: float, meshes: bool
) -> None:
    """Every face between cells on two sides of the plate's mid-plane is closed."""
    n, length = 32, 0.6
    h = 1.0 / n
    grid = Grid.slab(n, n, h, (-0.5, -0.5))
    x, y = np.meshgrid(*grid.cell_coordinates()[:2], indexing="ij")
    plate = f'<body><joint/><geom type="box" size="{length / 2} {thickness * h / 2} 1"/></body>'
    for angle in np.linspace(0.0, np.pi, 37):
        opened = cut(grid, plate, q=np.array([angle]), meshes=meshes).open
        along = np.cos(angle) * x + np.sin(angle) * y
        across = np.cos(angle) * y - np.sin(angle) * x
        for axis in (0, 1):
            a, b = (np.delete(across, -end, axis) for end in (1, 0))
            middle = 0.5 * sum(np.delete(along, -end, axis) for end in (1, 0))
            between = (a * b < 0.0) & (np.abs(middle) < 0.5 * length - 0.75 * h)
            inner = np.delete(np.delete(opened[axis][:, :, 0], -1, axis), 0, axis)
            assert between.any() or abs(np.sin(2 * angle)) < 1e-9
            assert not inner[between].any(), f"at {np.degrees(angle):.0f} degrees"


@pytest.mark.parametrize("meshes", [False, True], ids=["box", "mesh"])
@pytest.mark.parametrize("thickness", [1.0, 0.1])
def test_a_thin_plate_in_a_room_closes_an_unbroken_sheet_of_faces_however_it_is_turned(
    cut: Cut, thickness: float, meshes: bool
) -> None:
    n, half = 20, 0.3
    h = 1.0 / n
    grid = Grid((n, n, n), h, (-0.5, -0.5, -0.5))
    x = np.stack(np.meshgrid(*grid.cell_coordinates(), indexing="ij"), axis=-1)
    for turn in Rotation.random(12, np.random.default_rng(3)):
        a, b, c, w = turn.as_quat()
        plate = f"""<body quat="{w} {a} {b} {c}"><joint/>
          <geom type="box" size="{half} {half} {0.5 * thickness * h}"/></body>"""
        opened, place = cut(grid, plate, meshes=meshes).open, x @ turn.as_matrix()
        for axis in range(3):
            low, high = np.delete(place, -1, axis), np.delete(place, 0, axis)
            between = low[..., 2] * high[..., 2] < 0.0
            between &= (np.abs(0.5 * (low + high)[..., :2]) < half - 0.75 * h).all(axis=-1)
            inner = np.delete(np.delete(opened[axis], -1, axis), 0, axis)
            assert not inner[between].any(), turn.as_euler("xyz", degrees=True).round()
