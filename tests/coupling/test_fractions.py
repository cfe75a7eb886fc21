"""Closed parts of faces: areas and volumes of the bodies, and how bodies share a face."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from flowborne.coupling.fractions import Geometry
from flowborne.fluid.boundary import Boundaries
from flowborne.fluid.grid import Array, Grid
from flowborne.fluid.sides.inflow import BoundaryInflow
from flowborne.fluid.sides.open import BoundaryOpen
from flowborne.kernels.closed_fractions import add_closed, closed_fraction

Cut = Callable[..., Geometry]

OFFSETS = np.random.default_rng(3).random((8, 3))
"""Places of the domain's corner relative to the bodies, in cells: an error is a mean over them."""

FLAT = {
    "disc": ('type="sphere" size="0.2"', np.pi * 0.2**2),
    "box": ('type="box" size="0.25 0.15 1" euler="0 0 0.4"', 4 * 0.25 * 0.15),
    "capsule": (
        'type="capsule" size="0.1 0.2" euler="1.5707963267948966 0 0.7"',
        4 * 0.1 * 0.2 + np.pi * 0.1**2,
    ),
    "ellipse": ('type="ellipsoid" size="0.3 0.15 1" euler="0 0 0.4"', np.pi * 0.3 * 0.15),
}
"""Geometry in MJCF and its cross-section, m^2."""

ROUND = {
    "sphere": ('type="sphere" size="0.3"', 4.0 / 3.0 * np.pi * 0.3**3),
    "box": ('type="box" size="0.25 0.2 0.3" euler="0.3 0.2 0.4"', 8 * 0.25 * 0.2 * 0.3),
    "capsule": (
        'type="capsule" size="0.2 0.2" euler="0.8 0.3 0"',
        2.0 * np.pi * 0.2**2 * 0.2 + 4.0 / 3.0 * np.pi * 0.2**3,
    ),
}
"""Geometry in MJCF and its volume, m^3."""


def closed_across_z(cut: Geometry, grid: Grid) -> Array:
    """(nx, ny, nz+1) closed part of the faces across z, those of a slab included."""
    nx, ny, nz = grid.shape
    total = np.zeros((nx, ny, nz + 1))
    add_closed(total, cut.distance, np.array([[0, nx + 1], [0, ny + 1], [0, nz + 1]]), 2)
    return total


def order_of(errors: list[float], grids: tuple[int, ...]) -> float:
    return -float(np.polyfit(np.log(grids), np.log(errors), 1)[0])


@pytest.mark.parametrize("shape", FLAT)
def test_cross_section_on_a_slab_is_second_order(cut: Cut, shape: str) -> None:
    geom, area = FLAT[shape]
    grids, errors = (16, 32, 64, 128), []
    for n in grids:
        h = 1.0 / n
        found = []
        for x, y, _ in OFFSETS:
            grid = Grid.slab(n, n, h, (-0.5 - x * h, -0.5 - y * h))
            closed = closed_across_z(cut(grid, f"<geom {geom}/>"), grid)[:, :, 0]
            found.append(h**2 * closed.sum())
        errors.append(float(np.abs(np.array(found) / area - 1.0).mean()))
    assert order_of(errors, grids) == pytest.approx(2.0, abs=0.2), errors
    assert errors[-1] < 4e-4, errors


@pytest.mark.parametrize("shape", ROUND)
def test_volume_is_second_order(cut: Cut, shape: str) -> None:
    geom, volume = ROUND[shape]
    grids, errors = (12, 24, 48), []
    for n in grids:
        h = 1.1 / n
        found = []
        for offset in OFFSETS:
            grid = Grid((n, n, n), h, tuple(-0.55 - offset * h))
            opened = cut(grid, f"<geom {geom}/>").open
            found.append([h**3 * (1.0 - opened[axis]).sum() for axis in range(3)])
        errors.append(float(np.abs(np.array(found) / volume - 1.0).mean()))
    if shape == "box":
        assert order_of(errors, grids) == pytest.approx(2.0, abs=0.2), errors
        assert errors[-1] < 6e-3, errors
    else:  # facets alone would leave 0.03, 0.008 and 0.002
        assert errors[0] > errors[1] > errors[2], errors
        assert errors[1] < 3e-3, errors
        assert errors[2] < 1e-3, errors


@pytest.mark.parametrize("axis", [0, 1])
def test_chords_of_a_disc_are_its_own(cut: Cut, axis: int) -> None:
    """Sum of the closed parts along a line of faces against the chord that the circle cuts."""
    grids, errors, radius = (32, 64, 128, 256), [], 0.2
    for n in grids:
        h = 1.0 / n
        found = []
        for x, y, _ in OFFSETS:
            grid = Grid.slab(n, n, h, (-0.5 - x * h, -0.5 - y * h))
            closed = 1.0 - cut(grid, f'<geom type="sphere" size="{radius}"/>').open[axis][:, :, 0]
            place = grid.face_coordinates(axis)[axis]
            inner = np.abs(place) < 0.5 * radius
            chord = 2.0 * np.sqrt(radius**2 - place[inner] ** 2)
            found.append(float(np.abs(h * closed.sum(axis=1 - axis)[inner] / chord - 1.0).mean()))
        errors.append(float(np.mean(found)))
    assert order_of(errors, grids) == pytest.approx(2.0, abs=0.2), errors
    assert errors[-1] < 2e-5, errors


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


@pytest.mark.parametrize(
    ("corners", "part"),
    [
        ((1.0, 2.0, 0.0, 1.0), 0.0),
        ((-1.0, -2.0, -0.5, -1.0), 1.0),
        ((-1.0, 1.0, 1.0, -1.0), 0.5),
        ((-1.0, 3.0, 3.0, -1.0), 0.25),
        ((-1.0, 1.0, 3.0, 1.0), 0.125),
        ((1.0, -1.0, -3.0, -1.0), 0.875),
        ((-1.0, 1.0, -1.0, 1.0), 0.75),
        ((1.0, -1.0, 1.0, -1.0), 0.75),
    ],
)
def test_part_of_a_square_that_lies_inside(corners: tuple[float, ...], part: float) -> None:
    """Corners inside across a diagonal are taken as joined: a thin body stays in one piece."""
    assert closed_fraction(*corners) == pytest.approx(part, abs=1e-15)


def shares(cut: Geometry, body: int, grid: Grid) -> list[Array]:
    """What one body closes of every face, per axis."""
    parts = []
    for axis in range(3):
        own = (cut.axis == axis) & (cut.body == body)
        part = np.zeros(grid.face_shape(axis))
        np.add.at(part.reshape(-1), cut.face[own], cut.closed[own])
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
    x, y = found.cells // 32 + 0.5, found.cells % 32 + 0.5
    assert np.abs(np.hypot(x - 16, y - 16) - 8).max() < np.sqrt(2.0)
    assert np.unique(found.cells).size == found.cells.size


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
