"""Distances to the skin of flesh, their signs, and the weights of its vertices."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
import pyvista as pv

from flowborne.fluid.grid import Grid
from flowborne.kernels.arrays import Array, Integers
from flowborne.kernels.closed_fractions import Piece, close_faces
from flowborne.kernels.cut_faces import nodes_inside
from flowborne.kernels.edge_crossings import new_crossings
from flowborne.kernels.node_distance import BAND
from flowborne.kernels.skin import BESIDE, ON_SKIN, sample_skin, skin_box, skin_weights
from flowborne.kernels.triangles import distances_to_mesh

Skin = tuple[Array, Integers]
"""Vertices (n, 3) in m and triangles (k, 3)."""

OFFSETS = np.random.default_rng(3).random((6, 3))
"""Places of the domain's corner relative to the skin, in cells: an error is a mean over them."""

SIDES = [(axis, side) for axis in range(3) for side in (0, 1)]


def sphere(radius: float, nsub: int, centre: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> Skin:
    """Each subdivision halves the edges; the first, 0, has 20 triangles."""
    found = pv.Icosphere(radius=1.0, nsub=nsub)
    points = np.array(found.points, dtype=np.float64)
    points *= radius / np.linalg.norm(points, axis=1, keepdims=True)
    return points + np.array(centre), found.faces.reshape(-1, 4)[:, 1:].astype(np.int64)


def cube(low: Array, high: Array) -> Skin:
    """A box of 12 triangles."""
    vertices = np.array(list(itertools.product(*zip(low, high, strict=True))), dtype=np.float64)
    squares = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    triangles = [half for a, b, c, d in squares for half in ((a, b, c), (a, c, d))]
    return vertices, np.array(triangles, dtype=np.int64)


def octahedron(radius: float) -> Skin:
    vertices = radius * np.array([[1, 0, 0], [0, 1, 0], [-1, 0, 0], [0, -1, 0], [0, 0, 1.0]])
    upper = [(n, (n + 1) % 4, 4) for n in range(4)]
    lower = [((n + 1) % 4, n, 5) for n in range(4)]
    return np.vstack([vertices, [0, 0, -radius]]), np.array(upper + lower, dtype=np.int64)


def prism(radius: float, sides: int) -> Skin:
    """A disc of unit depth around z = 0, its ends fans about their middles."""
    angle = 2.0 * np.pi * np.arange(sides) / sides
    rim = radius * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    ends = [np.column_stack([np.vstack([rim, [0, 0]]), np.full(sides + 1, z)]) for z in (-0.5, 0.5)]
    triangles, top = [], sides + 1
    for n in range(sides):
        m = (n + 1) % sides
        triangles += [(n, m, top + m), (n, top + m, top + n)]
        triangles += [(m, n, sides), (top + n, top + m, top + sides)]
    return np.vstack(ends), np.array(triangles, dtype=np.int64)


def together(*skins: Skin) -> Skin:
    """Several skins as one."""
    first = np.cumsum([0, *(len(vertices) for vertices, _ in skins)])
    moved = [triangles + n for (_, triangles), n in zip(skins, first[:-1], strict=True)]
    return np.vstack([vertices for vertices, _ in skins]), np.vstack(moved)


def box_of(skin: Skin, grid: Grid) -> Integers:
    return skin_box(skin[0], grid.nodes, np.array(grid.shape))


def sample(skin: Skin, grid: Grid, box: Integers) -> tuple[Array, Array]:
    """Distances, and whether the skin is within BAND cells."""
    phi = sample_skin(*skin, box, grid.nodes, BAND)
    return phi, np.abs(phi) < BAND * grid.spacing


def on_skin(corners: Integers, weights: Array, values: Array) -> Array:
    """(m, 3) places or velocities at points of the skin from those of its vertices (n, 3)."""
    return np.einsum("mc,mcd->md", weights, values[corners])


def everywhere(grid: Grid) -> Integers:
    return np.array([[0, n + 1] for n in grid.shape])


def nodes(grid: Grid, box: Integers) -> Array:
    """(box shape, 3) places of the nodes, m."""
    axes = [grid.origin[m] + grid.spacing * np.arange(*box[m]) for m in range(3)]
    return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)


def order_of(errors: list[float], edges: list[float]) -> float:
    return float(np.polyfit(np.log(edges), np.log(errors), 1)[0])


def assert_as_all_pairs(skin: Skin, grid: Grid) -> None:
    """Against the closest of all triangles at every node, and the solid angle for the sign."""
    phi, nearest = sample(skin, grid, everywhere(grid))
    places = nodes(grid, everywhere(grid)).reshape(-1, 3)
    exact = distances_to_mesh(places, *skin).reshape(phi.shape)
    h = grid.spacing
    near = np.abs(exact) < BAND * h
    off = np.abs(exact) > 1e-7 * h
    np.testing.assert_array_equal((phi < 0.0)[off], (exact < 0.0)[off])
    np.testing.assert_array_less(phi[~off], 0.0)
    np.testing.assert_allclose(phi[near & off], exact[near & off], rtol=1e-9, atol=1e-12 * h)
    np.testing.assert_array_equal(np.abs(phi[~near]), BAND * h)
    np.testing.assert_array_equal(nearest, near)


def test_distances_are_those_of_a_search_through_all_triangles() -> None:
    vertices, triangles = sphere(0.3, 2, (0.02, -0.01, 0.03))
    vertices = vertices * (1.0 + 0.3 * np.sin(17.0 * vertices[:, [1]] + 9.0 * vertices[:, [2]]))
    assert_as_all_pairs((vertices, triangles), Grid((24, 23, 22), 0.05, (-0.6, -0.55, -0.57)))


@pytest.mark.parametrize("shift", [(0, 0, 0), (0.5, 0, 0), (0, 0.5, 0), (0, 0, 0.5)])
@pytest.mark.parametrize("shape", ["octahedron", "rounded sphere"])
def test_signs_hold_where_lines_meet_edges_and_vertices(
    shape: str, shift: tuple[float, float, float]
) -> None:
    """All vertices lie on nodes or half-way between them, so grid lines pass through them."""
    vertices, triangles = octahedron(5.0) if shape == "octahedron" else sphere(6.0, 1)
    skin = (np.round(vertices) + np.array(shift), triangles)
    assert_as_all_pairs(skin, Grid((18, 18, 18), 1.0, (-9.0, -9.0, -9.0)))


def test_tetrahedra_between_nodes_have_the_signs_of_integer_arithmetic() -> None:
    """One edge runs at 45 degrees through nodes far from its ends: two neighbours that found
    different places on it would leave a gap there."""
    n, random = 53, np.random.default_rng(8)
    grid = Grid((n + 1, n + 1, n + 1), 1.0)
    triangles = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]])
    places = nodes(grid, everywhere(grid)).astype(np.int64)
    for _ in range(40):
        vertices = random.integers(2, n, (4, 3))
        length = random.integers(39, n - 2)
        low = random.integers(2, n - length, 2)
        vertices[:2, 1] = low[0], low[0] + length
        vertices[:2, 2] = random.permutation([low[1], low[1] + length])
        edges = vertices[1:] - vertices[0]
        volume = np.dot(np.cross(edges[0], edges[1]), edges[2])
        if volume < 0:
            vertices = vertices[[1, 0, 2, 3]]
        depth = np.full(places.shape[:3], np.abs(volume))
        for a, b, c in vertices[triangles]:
            depth = np.minimum(depth, np.dot(a - places, np.cross(b - a, c - a)))
        phi, _ = sample((vertices.astype(np.float64), triangles), grid, everywhere(grid))
        np.testing.assert_array_equal(phi < 0.0, depth >= 0)


def test_distance_to_a_sphere_is_second_order_in_the_edges_of_its_triangles() -> None:
    radius, grid = 0.4, Grid((24, 24, 24), 0.05, (-0.61, -0.59, -0.605))
    exact = np.linalg.norm(nodes(grid, everywhere(grid)), axis=-1) - radius
    errors, edges = [], []
    for nsub in (2, 3, 4, 5):
        phi, nearest = sample(sphere(radius, nsub), grid, everywhere(grid))
        errors.append(float(np.abs(phi - exact)[nearest].max()))
        edges.append(0.5**nsub)
    assert order_of(errors, edges) == pytest.approx(2.0, abs=0.1), errors
    assert errors[-1] < 5e-4 * radius, errors


def test_signs_are_right_deep_inside_and_far_outside() -> None:
    radius, grid = 0.9, Grid((64, 64, 64), 0.03125, (-1.0, -0.99, -1.01))
    skin = sphere(radius, 4)
    box = box_of(skin, grid)
    phi, nearest = sample(skin, grid, box)
    exact = np.linalg.norm(nodes(grid, box), axis=-1) - radius
    off = np.abs(exact) > 0.003 * radius
    np.testing.assert_array_equal((phi < 0.0)[off], (exact < 0.0)[off])
    assert exact.min() < -20 * grid.spacing
    np.testing.assert_array_equal(np.abs(phi[~nearest]), BAND * grid.spacing)
    np.testing.assert_array_less(np.abs(phi[nearest]), BAND * grid.spacing)


def test_box_holds_the_band_and_stays_in_the_grid() -> None:
    grid = Grid((40, 10, 40), 0.5, (-10.0, -1.0, 0.0))
    skin = cube(np.array([-1.1, -1.1, 18.0]), np.array([1.1, 1.1, 19.0]))
    np.testing.assert_array_equal(box_of(skin, grid), [[13, 28], [0, 10], [32, 41]])


@pytest.mark.parametrize("shift", list(itertools.product((0.0, 0.5), repeat=3)))
def test_cube_along_the_grid_has_no_wrong_signs(shift: tuple[float, float, float]) -> None:
    """Nodes on its sides belong to it, on all six alike."""
    h = 0.1
    grid = Grid((20, 20, 20), h, (-0.3, 0.2, 0.7))
    low = np.array(grid.origin) + h * (np.array([6, 5, 4]) + shift)
    high = low + h * np.array([8, 9, 10])
    phi, _ = sample(cube(low, high), grid, everywhere(grid))
    apart = np.abs(nodes(grid, everywhere(grid)) - 0.5 * (low + high)) - 0.5 * (high - low)
    exact = np.linalg.norm(np.maximum(apart, 0.0), axis=-1) + np.minimum(apart.max(-1), 0.0)
    on = np.abs(exact) < 1e-12
    assert on.any() == (min(shift) == 0.0)
    np.testing.assert_array_equal(phi[on], -ON_SKIN * h)
    np.testing.assert_array_equal((phi < 0.0)[~on], (exact < 0.0)[~on])
    near = (np.abs(exact) < 1.99 * h) & ~on
    np.testing.assert_allclose(phi[near], exact[near], atol=1e-14)


def test_overlapping_spheres_are_inside_both() -> None:
    grid = Grid((40, 30, 30), 0.05, (-1.0, -0.75, -0.75))
    centres = [(-0.2, 0.01, 0.02), (0.25, -0.02, 0.0)]
    phi, _ = sample(together(*(sphere(0.45, 4, c) for c in centres)), grid, everywhere(grid))
    places = nodes(grid, everywhere(grid))
    each = [np.linalg.norm(places - np.array(c), axis=-1) - 0.45 for c in centres]
    union = np.minimum(*each)
    off = np.abs(union) > 0.003 * 0.45
    assert (np.maximum(*each) < -0.1).any()
    np.testing.assert_array_equal((phi < 0.0)[off], (union < 0.0)[off])


def test_a_covered_sheet_along_the_grid_opens_no_face() -> None:
    """Two boxes overlap by whole cells: all faces inside of their union are closed."""
    grid = Grid((20, 12, 12), 1.0)
    first = cube(np.full(3, 3.5), np.array([10.0, 8.5, 8.5]))
    second = cube(np.array([8.0, 3.5, 3.5]), np.array([16.5, 8.5, 8.5]))
    phi, _ = sample(together(first, second), grid, everywhere(grid))
    for i in range(4, 17):
        assert nodes_inside(phi, 0, i, 5, 5) == 4, i
    for i in range(4, 16):
        assert nodes_inside(phi, 1, i, 5, 5) == nodes_inside(phi, 2, i, 5, 5) == 4, i


@pytest.mark.parametrize(("axis", "side"), SIDES)
def test_a_skin_half_outside_of_the_grid_is_as_in_a_larger_one(axis: int, side: int) -> None:
    n, h, cut = 32, 0.04, 17
    large = Grid((n, n, n), h, (-0.63, -0.64, -0.65))
    shape, origin = [n, n, n], list(large.origin)
    shape[axis] = n - cut if side == 0 else cut
    origin[axis] += h * cut if side == 0 else 0.0
    small = Grid((shape[0], shape[1], shape[2]), h, (origin[0], origin[1], origin[2]))
    skin = sphere(0.4, 3)
    whole, whole_nearest = sample(skin, large, everywhere(large))
    box = box_of(skin, small)
    part, part_nearest = sample(skin, small, box)
    moved = box.copy()
    moved[axis] += cut if side == 0 else 0
    here = tuple(slice(*moved[m]) for m in range(3))
    np.testing.assert_allclose(part, whole[here], atol=1e-13)
    np.testing.assert_array_equal(part_nearest, whole_nearest[here])
    assert (part < 0.0).any()


def test_a_skin_that_has_left_the_grid_has_an_empty_box() -> None:
    grid = Grid((16, 16, 16), 0.1)
    skin = sphere(0.2, 2, (0.8, -2.0, 0.8))
    phi, nearest = sample(skin, grid, box_of(skin, grid))
    assert phi.size == nearest.size == 0


@pytest.mark.parametrize("h", [0.02, 1.0])
def test_a_prism_in_a_slab_is_its_cross_section(h: float) -> None:
    """Also where cells are larger than the prism is deep."""
    radius, sides = 12.3 * h, 600
    grid = Grid.slab(40, 41, h, (-20.2 * h, -20.7 * h))
    skin = prism(radius, sides)
    box = box_of(skin, grid)
    np.testing.assert_array_equal(box[2], [0, 2])
    phi, nearest = sample(skin, grid, box)
    places = nodes(grid, box)[..., :2]
    exact = np.linalg.norm(places, axis=-1) - radius
    near = np.abs(exact) < 1.99 * h
    np.testing.assert_array_equal(phi < 0.0, exact < 0.0)
    np.testing.assert_allclose(phi[near], exact[near], atol=3e-4 * h)
    np.testing.assert_array_equal(phi[:, :, 0], phi[:, :, 1])
    np.testing.assert_array_equal(nearest[:, :, 0], nearest[:, :, 1])


def test_weights_carry_a_rigid_motion_to_the_closest_points() -> None:
    grid = Grid((24, 24, 24), 0.05, (-0.61, -0.59, -0.605))
    vertices, triangles = skin = sphere(0.4, 3)
    phi, _ = sample(skin, grid, everywhere(grid))
    near = np.abs(phi) < BESIDE * grid.spacing
    x = nodes(grid, everywhere(grid))[near]
    corners, weights = skin_weights(x, vertices, triangles, grid.spacing)
    np.testing.assert_allclose(weights.sum(axis=1), 1.0, atol=1e-14)
    assert weights.min() > -1e-15
    closest = on_skin(corners, weights, vertices)
    np.testing.assert_allclose(np.linalg.norm(x - closest, axis=1), np.abs(phi[near]), atol=1e-14)
    linear, angular = np.array([0.3, -0.2, 0.5]), np.array([1.0, 2.0, -0.7])
    carried = on_skin(corners, weights, linear + np.cross(angular, vertices))
    np.testing.assert_allclose(carried, linear + np.cross(angular, closest), atol=1e-14)


def test_weights_are_of_the_closest_point_alone() -> None:
    """Above a face, beyond an edge and beyond a vertex; and farther away there are none."""
    vertices, triangles = cube(np.zeros(3), np.ones(3))
    x = np.array([[0.7, 0.4, 1.5], [0.3, -1.0, 1.5], [1.3, 1.2, 1.1], [0.5, 0.5, 3.1]])
    corners, weights = skin_weights(x, vertices, triangles, 1.0)
    closest = on_skin(corners, weights, vertices)
    expected = [[0.7, 0.4, 1.0], [0.3, 0.0, 1.0], [1.0, 1.0, 1.0], [0.0, 0.0, 0.0]]
    np.testing.assert_allclose(closest, expected, atol=1e-15)
    assert not weights[3].any()
    assert not corners[3].any()


@pytest.mark.parametrize("axis", range(3))
def test_closed_area_of_a_sphere_is_second_order(axis: int) -> None:
    """Its section by the plane of faces nearest to its middle; edges shrink with the cells."""
    radius, errors, edges = 0.35, [], []
    for n, nsub in ((12, 2), (24, 3), (48, 4), (96, 5)):
        h, skin, found = 1.0 / n, sphere(radius, nsub), []
        for offset in OFFSETS:
            grid = Grid((n, n, n), h, tuple(-0.5 - 0.5 * offset * h))
            box = box_of(skin, grid)
            phi, _ = sample(skin, grid, box)
            total = np.zeros(grid.face_shape(axis))
            own = np.empty(np.array(phi.shape) - 1 + (np.arange(3) == axis))
            crossings, centre = new_crossings(phi, grid.spacing, False), np.zeros((2, *own.shape))
            piece = Piece(0, box, grid.nodes, phi, crossings, (own,) * 3, (centre,) * 3)
            close_faces(piece, total, axis)
            place = grid.face_coordinates(axis)[axis]
            middle = int(np.argmin(np.abs(place)))
            area = h**2 * np.take(total, middle, axis).sum()
            found.append(abs(area / (np.pi * (radius**2 - place[middle] ** 2)) - 1.0))
        errors.append(float(np.mean(found)))
        edges.append(h)
    assert order_of(errors, edges) == pytest.approx(2.0, abs=0.2), errors
    assert errors[-1] < 1e-3, errors
