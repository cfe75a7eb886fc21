"""Where edges of the grid cross bodies: against where lines cross the geometries."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from flowborne.coupling.shapes import UNSAMPLED
from flowborne.kernels.arrays import Array, Nodes
from flowborne.kernels.edge_crossings import (
    PIECES,
    Crossings,
    Placed,
    cross_geometry,
    merge_crossings,
    new_crossings,
)
from flowborne.kernels.node_distance import lower_to_body
from flowborne.kernels.skin import cross_skin
from flowborne.shapes.mesh import ShapeMesh, smooth_sheets
from flowborne.shapes.primitives import PRIMITIVES
from flowborne.shapes.shape import Primitive

H, NODES = 0.1, 14
BOX = np.array([[0, NODES], [0, NODES], [0, NODES]])
SIZES = {
    "sphere": (0.33, 0.0, 0.0),
    "capsule": (0.18, 0.21, 0.0),
    "cylinder": (0.27, 0.31, 0.0),
    "box": (0.31, 0.22, 0.27),
    "ellipsoid": (0.36, 0.21, 0.3),
}
PLACES = np.random.default_rng(5)


def placed(shape: Primitive, middle: Array, turn: Array) -> Placed:
    return Placed(shape.code, shape.size, middle, turn, UNSAMPLED)


def crossed(body: Placed, origin: Array) -> tuple[Array, Crossings]:
    """Distances at the nodes, and where edges cross a geometry."""
    phi = np.full((NODES,) * 3, np.inf)
    lower_to_body(phi, BOX, body, Nodes(origin, H, False))
    found = new_crossings(phi, H, False)
    used = np.zeros(1, np.int64)
    cross_geometry(found, used, phi, BOX, body, 0, Nodes(origin, H, False))
    assert 100 < used[0] <= found.part.size
    return phi, found._replace(piece=found.piece[: used[0]])


def ends(found: Crossings, phi: Array, d: int) -> tuple[Array, Array, Array]:
    """(n, 3) open node of each crossed edge along d; (n,) way to the other, cells; (n,) number."""
    lower = np.stack(np.nonzero(found.at[d] >= 0), axis=1)
    number = found.at[d][tuple(lower.T)]
    inside = phi[tuple(lower.T)] < 0.0
    return lower + inside[:, None] * np.eye(3, dtype=int)[d], np.where(inside, -1.0, 1.0), number


@pytest.mark.parametrize("kind", SIZES)
def test_crossings_of_geometries(kind: str) -> None:
    """The first place beyond the open node where the grid's line crosses the geometry."""
    for _ in range(4):
        shape = PRIMITIVES[kind](np.array(SIZES[kind]))
        turn = Rotation.random(random_state=PLACES).as_matrix()
        origin = -H * (0.5 * NODES + PLACES.random(3))
        phi, found = crossed(placed(shape, np.zeros(3), turn), origin)
        for d in range(3):
            node, way, number = ends(found, phi, d)
            start = (origin + H * node) @ turn
            direction = np.eye(3)[d] @ turn
            enter, leave = shape.interval(start, direction)
            place = np.where(way > 0.0, enter, -leave)
            np.testing.assert_allclose(found.part[number], place / H, atol=1e-9)
            at = start + (way * H * found.part[number])[:, None] * direction
            shifts = 1e-6 * turn  # the world's axes in the geometry's frame
            slope = [shape.distance(at + s) - shape.distance(at - s) for s in shifts]
            normal = np.stack(slope, axis=1) / 2e-6
            error = np.abs(found.normal[number] - normal).max(axis=1)
            assert np.quantile(error, 0.98) < 1e-4, kind  # some are on an edge of the geometry


def test_pieces() -> None:
    """A box has six, a cylinder three, what is round one."""
    count = {"sphere": 1, "capsule": 1, "cylinder": 3, "box": 6, "ellipsoid": 1}
    for kind, pieces in count.items():
        shape = PRIMITIVES[kind](np.array(SIZES[kind]))
        _, found = crossed(placed(shape, np.zeros(3), np.eye(3)), np.full(3, -0.66))
        assert np.unique(found.piece).size == pieces, kind


@pytest.mark.parametrize("flat", [False, True])
def test_crossings_of_a_mesh_are_those_of_its_geometry(flat: bool) -> None:
    shape = PRIMITIVES["box"](np.array([0.31, 0.22, 5.0 if flat else 0.27]))
    mesh = ShapeMesh(*shape.triangles())
    sheets = smooth_sheets(mesh.vertices, mesh.faces)
    assert np.unique(sheets).size == 6
    box = np.array([[0, NODES], [0, NODES], [0, 2 if flat else NODES]])
    for _ in range(4):
        turn = Rotation.from_euler("z", PLACES.uniform(0.0, 6.0)).as_matrix()
        turn = turn if flat else Rotation.random(random_state=PLACES).as_matrix()
        origin = -H * (0.5 * NODES + PLACES.random(3))
        body, phi = placed(shape, np.zeros(3), turn), np.full(box[:, 1], np.inf)
        nodes = Nodes(origin, H, flat)
        lower_to_body(phi, box, body, nodes)
        one, other = new_crossings(phi, H, flat), new_crossings(phi, H, flat)
        cross_geometry(one, np.zeros(1, np.int64), phi, box, body, 0, nodes)
        skin = mesh.vertices @ turn.T, mesh.faces, 3 * PIECES + sheets
        cross_skin(other, np.zeros(1, np.int64), phi, *skin, box, nodes)
        both = (one.at >= 0) & (other.at >= 0)
        for n in other.at[(other.at >= 0) & ~both]:  # an edge of the box grazes the edge
            assert other.part[n] + other.part[n + 1] > 0.999
        assert (other.at >= 0)[one.at >= 0].all()
        a, b = (found.at[both] for found in (one, other))
        np.testing.assert_allclose(one.part[a], other.part[b], atol=1e-9)
        assert (np.linalg.norm(one.normal[a] - other.normal[b], axis=1) < 1e-6).mean() > 0.97
        assert (other.piece[b] // PIECES == 3).all()


def test_of_several_bodies_the_nearest_crossing_is_kept() -> None:
    """Two balls, one a little larger than the other about the same middle."""
    small, large = (
        placed(PRIMITIVES["sphere"](np.array([r, 0.0, 0.0])), np.zeros(3), np.eye(3))
        for r in (0.30, 0.31)
    )
    origin = np.array([-0.63, -0.64, -0.66])
    each = [crossed(bodies, origin) for bodies in (small, large)]
    distance = np.minimum(each[0][0], each[1][0])
    part = np.concatenate([found.part for _, found in each])
    at, first = np.full_like(each[0][1].at, -1), 0
    for phi, found in each:
        merge_crossings(at, part, distance, found.at, phi, BOX, first)
        first += found.part.size
    outer = each[1][1].at
    np.testing.assert_array_equal(at[outer >= 0], outer[outer >= 0] + each[0][1].part.size)


def test_a_crossing_at_the_node_inside_has_its_normal() -> None:
    """What rounding puts just inside leaves the whole edge open."""
    ball = placed(PRIMITIVES["sphere"](np.array([0.3, 0.0, 0.0])), np.zeros(3), np.eye(3))
    origin = np.full(3, -6.0 * H)
    phi, _ = crossed(ball, origin)
    phi[9, 6, 6] = -1e-18
    found = new_crossings(phi, H, False)
    found.normal[:] = np.nan
    cross_geometry(found, np.zeros(1, np.int64), phi, BOX, ball, 0, Nodes(origin, H, False))
    n = found.at[0, 9, 6, 6]
    assert found.part[n] == pytest.approx(1.0)
    np.testing.assert_allclose(found.normal[n], [1.0, 0.0, 0.0], atol=1e-9)


def test_an_edge_that_a_corner_passes_is_crossed_twice() -> None:
    """A box on its edge, whose uppermost line lies 0.2 cells above a plane of nodes."""
    turn = Rotation.from_euler("z", 45.0, degrees=True).as_matrix()
    box = PRIMITIVES["box"](np.array([0.2, 0.2, 0.2]))
    origin = np.array([-0.65, -0.05 - 0.1 * np.round(4.0 * np.sqrt(2.0)), -0.65])
    top = 0.2 * np.sqrt(2.0)
    origin[1] = top - 0.2 * H - 10 * H
    _, found = crossed(placed(box, np.zeros(3), turn), origin)
    n = found.at[0, 6, 10, 6]
    assert found.part[n : n + 2] == pytest.approx([0.3, 0.3], abs=1e-9)
    side = np.sqrt(0.5)
    np.testing.assert_allclose(
        found.normal[n : n + 2, :2], [[-side, side], [side, side]], atol=1e-6
    )
