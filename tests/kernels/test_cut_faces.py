"""Closed parts of edges and faces: against NumPy, and against lines, corners and circles."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from flowborne.kernels.arrays import Array
from flowborne.kernels.cut_faces import closed_face, open_edge
from flowborne.kernels.edge_crossings import Crossings, new_crossings

from .references.closed_fractions import face_closed_reference
from .references.cut_faces import closed_polygon_reference, open_edge_reference

DISTANCE = st.one_of(st.just(0.0), st.floats(-2.0, 2.0, allow_subnormal=False))
FOUR = st.tuples(DISTANCE, DISTANCE, DISTANCE, DISTANCE)
TURN = st.integers(0, 720).map(lambda n: np.pi / 360.0 * n + 1e-3)


def square(corners: tuple[float, ...]) -> Array:
    """(2, 2, 2) distances at the nodes of a slab of one cell from those at its corners in turn."""
    a, b, c, d = corners
    return np.repeat(np.array([[a, d], [b, c]])[..., None], 2, axis=2)


def on_edges(phi: Array, line: Array, normals: Array, pieces: list[int]) -> Crossings:
    """Crossings of the edges of one cell with the body behind lines n . x = c: where an edge passes
    the last of them.

    line  (n,) c;  normals  (n, 2)
    """
    found, used = new_crossings(phi, 1e-9, True), 0
    for d, side in product((0, 1), (0, 1)):
        node = (0, side) if d == 0 else (side, 0)
        ends = np.array([node, np.add(node, np.eye(2, dtype=int)[d])])
        inside = phi[ends[:, 0], ends[:, 1], 0] < 0.0
        if inside[0] == inside[1]:
            continue
        outer, inner = (ends[1], ends[0]) if inside[0] else (ends[0], ends[1])
        along = (inner - outer)[d]
        way = np.full(len(line), np.inf)
        way[normals[:, d] != 0.0] = [
            (c - n @ outer) / (along * n[d])
            for c, n in zip(line, normals, strict=True)
            if n[d] != 0.0
        ]
        way[(way < 0.0) | (normals[:, d] * along >= 0.0)] = np.inf
        last = int(np.argmax(np.where(np.isfinite(way), way, -1.0)))
        found.at[d, node[0], node[1]] = used
        found.part[used], found.piece[used] = way[last], pieces[last]
        found.normal[used] = [*normals[last], 0.0]
        used += 1
    return found


@given(DISTANCE, DISTANCE)
@settings(deadline=None)
def test_part_of_an_edge(a: float, b: float) -> None:
    phi = square((a, b, a, a))
    expected = open_edge_reference(np.array([a]), np.array([b]))[0]
    assert open_edge(phi, new_crossings(phi, 1e-9, True), 0, 0, 0, 0) == pytest.approx(
        expected, abs=1e-14
    )


@given(FOUR)
@settings(deadline=None)
def test_part_of_a_square_without_crossings(corners: tuple[float, float, float, float]) -> None:
    phi = square(corners)
    closed, x, y, kinks, _, _ = closed_face(
        phi, new_crossings(phi, 1e-9, True), 2, 0, 0, 0, True, False
    )
    assert kinks == 0
    assert closed == pytest.approx(face_closed_reference(phi, 2)[0, 0, 0], abs=1e-14)
    expected = closed_polygon_reference(np.array(corners))
    assert (closed, x, y) == pytest.approx(tuple(map(float, expected)), abs=1e-14)


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
    phi = square(corners)
    found = closed_face(phi, new_crossings(phi, 1e-9, True), 2, 0, 0, 0, True, False)
    assert found[0] == pytest.approx(part, abs=1e-15)


def clipped(normals: Array, line: Array) -> tuple[float, Array]:
    """Area and centroid of the part of the unit square where all n . x < c, by clipping."""
    points = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    for n, c in zip(normals, line, strict=True):
        kept = []
        for p, q in zip(points, np.roll(points, -1, axis=0), strict=True):
            a, b = n @ p - c, n @ q - c
            kept += [p] if a < 0.0 else []
            kept += [p + a / (a - b) * (q - p)] if (a < 0.0) != (b < 0.0) else []
        points = np.array(kept).reshape(-1, 2)
    x, y = points.T
    xn, yn = np.roll(points, -1, axis=0).T
    cross = x * yn - xn * y
    area = 0.5 * cross.sum()
    moment = np.array([((x + xn) * cross).sum(), ((y + yn) * cross).sum()]) / 6.0
    return area, moment - 0.5 * area


@given(st.floats(0.02, 0.98), st.floats(0.02, 0.98), TURN)
@settings(deadline=None, max_examples=300)
def test_a_corner_of_a_body_is_where_it_is(x: float, y: float, turn: float) -> None:
    """A right angle, turned, with its tip in the cell: wherever both sides leave by different
    nodes, the closed area and its moments are exact."""
    normals = np.array([[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]])
    line = normals @ [x, y]
    nodes = np.array([[0, 0], [1, 0], [1, 1], [0, 1]])
    phi = square(tuple((nodes @ normals.T - line).max(axis=1)))
    inside = (phi[:, :, 0] < 0.0).ravel()[[0, 2, 3, 1]]
    sides = (inside != np.roll(inside, -1)).sum()
    if sides != 2:
        return
    # each crossing is that of the side of the angle that an edge really meets
    found = closed_face(phi, on_edges(phi, line, normals, [1, 2]), 2, 0, 0, 0, True, False)
    area, moment = clipped(normals, line)
    lost = 0.0 if found[3] == 1 else area
    assert found[0] == pytest.approx(area, abs=1e-10 + lost)
    if found[3] == 1:
        assert found[1:3] == pytest.approx(tuple(moment), abs=1e-10)


@given(st.floats(1.2, 20.0), st.floats(0.1, 0.9), TURN)
@settings(deadline=None, max_examples=200)
def test_an_arc_has_its_segment(radius: float, place: float, turn: float) -> None:
    """A disc whose rim passes through the cell, against the polygon of its chord."""
    out = np.array([np.cos(turn), np.sin(turn)])
    middle = [0.5, 0.5] - (radius + 0.4 * (place - 0.5)) * out
    nodes = np.array([[0, 0], [1, 0], [1, 1], [0, 1]], float)
    phi = square(tuple(np.linalg.norm(nodes - middle, axis=1) - radius))
    inside = (phi[:, :, 0] < 0.0).ravel()[[0, 2, 3, 1]]
    if (inside != np.roll(inside, -1)).sum() != 2:
        return
    crossings, used = new_crossings(phi, 1e-9, True), 0
    for d, side in product((0, 1), (0, 1)):
        node = (0, side) if d == 0 else (side, 0)
        a, b = phi[(*node, 0)], phi[(*np.add(node, np.eye(2, dtype=int)[d]), 0)]
        if (a < 0.0) == (b < 0.0):
            continue
        across = node[1 - d] - middle[1 - d]
        root = np.sqrt(radius**2 - across**2)
        at = min((middle[d] - root, middle[d] + root), key=lambda t: abs(t - 0.5))
        crossings.at[d, node[0], node[1]] = used
        crossings.part[used], crossings.piece[used] = at if a >= 0.0 else 1.0 - at, 0
        normal = np.zeros(3)
        normal[d], normal[1 - d] = at - middle[d], across
        crossings.normal[used] = normal / radius
        used += 1
    found = closed_face(phi, crossings, 2, 0, 0, 0, True, False)[0]
    fine = (np.indices((400, 400)).reshape(2, -1).T + 0.5) / 400
    exact = (np.linalg.norm(fine - middle, axis=1) < radius).mean()
    assert found == pytest.approx(exact, abs=4e-3)
