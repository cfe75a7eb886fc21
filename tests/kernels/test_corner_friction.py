"""Friction at corners: its quadratic form, and which corners have one."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from flowborne.kernels.arrays import Array
from flowborne.kernels.corner_friction import AROUND, corner_form, find_corners
from flowborne.kernels.edge_crossings import Crossings, new_crossings

from .references.corner_friction import added_reference, removed_reference

PART = st.floats(0.05, 0.95)
LINK = st.floats(0.5, 2.0)


@given(PART, PART, PART, st.booleans(), st.tuples(LINK, LINK, LINK), st.integers(0, 100))
@settings(deadline=None)
def test_the_form_is_what_the_least_dissipation_adds(
    narrow: float, b: float, h: float, stays: bool, links: tuple[float, float, float], seed: int
) -> None:
    """With whole and cut faces beyond; with what it takes away it is positive."""
    beyond = 0.9 if stays else 1.0
    volume = 0.5 * b * (narrow + h) + (1.0 - b) * (0.5 * (h + beyond) if stays else 1.0)
    walls = 2.0 / narrow, 1.3
    given_parts = narrow, beyond, volume, b
    form = corner_form(*given_parts, h, stays, links, walls)[:AROUND, :AROUND]
    removed = removed_reference(*given_parts, stays, links, walls)
    np.testing.assert_allclose(form, form.T, rtol=0.0, atol=1e-9 * np.abs(form).max())
    around = np.random.default_rng(seed).standard_normal(AROUND)
    added = added_reference(*given_parts, h, stays, around)
    assert around @ (form + removed) @ around == pytest.approx(added, rel=1e-7, abs=1e-9)


def crossed(phi: Array, normals: Array, line: Array) -> Crossings:
    """Crossings of the edges of a slab with the body behind two lines n . x = c, convex."""
    found, used = new_crossings(phi, 1.0, True), 0
    for d, (i, j) in product((0, 1), np.ndindex(phi.shape[:2])):
        node, step = np.array([i, j]), np.eye(2, dtype=int)[d]
        end = node + step
        if end[d] == phi.shape[d] or (phi[i, j, 0] < 0.0) == (phi[end[0], end[1], 0] < 0.0):
            continue
        inner, outer = (node, end) if phi[i, j, 0] < 0.0 else (end, node)
        along = (inner - outer)[d]
        way = [(c - n @ outer) / (along * n[d]) if n @ outer > c else -1.0
               for c, n in zip(line, normals, strict=True)]  # fmt: skip
        piece = int(np.argmax(way))
        found.at[d, i, j, 0] = used
        found.part[used], found.piece[used] = way[piece], piece
        found.normal[used] = [*normals[piece], 0.0]
        used += 1
    return found


def normals_of(turn: float, opening: float) -> Array:
    """(2, 2) normals of two walls whose directions differ by an angle."""
    angles = np.array([turn, turn + opening])
    return np.stack([np.cos(angles), np.sin(angles)], axis=1)


@pytest.mark.parametrize("degrees", [15.0, 25.0, 90.0])
def test_sharp_convex_corners_are_found_where_they_are(degrees: float) -> None:
    """In the middle of twelve by twelve cells; walls that turn by 15 degrees have none."""
    place = np.array([6.37, 5.61])
    nodes = np.moveaxis(np.indices((13, 13)), 0, -1)
    for turn in np.radians([10.0, 130.0, 250.0]):
        normals = normals_of(turn, np.radians(degrees))
        line = normals @ place
        phi = np.repeat((nodes @ normals.T - line).max(axis=-1)[..., None], 2, axis=2)
        cells, corner = find_corners(phi, crossed(phi, normals, line), 1.0)
        if degrees < 20.0:
            assert len(cells) == 0
            continue
        assert cells.tolist() == [[6, 5, 0, 2]]
        np.testing.assert_allclose(corner[0, 0], place % 1.0, atol=1e-12)
        found = corner[0, 1:][np.argsort(corner[0, 1:] @ normals[1])]
        np.testing.assert_allclose(found, normals, atol=1e-12)


def test_concave_corners_have_none() -> None:
    """The body is behind either line, not both."""
    place, normals = np.array([6.37, 5.61]), normals_of(0.3, 0.5 * np.pi)
    line, nodes = normals @ place, np.moveaxis(np.indices((13, 13)), 0, -1)
    phi = np.repeat((nodes @ normals.T - line).max(axis=-1)[..., None], 2, axis=2)
    found = crossed(phi, normals, line)
    assert len(find_corners(phi, found, 1.0)[0]) == 1
    outside = found._replace(part=1.0 - found.part, normal=-found.normal)
    assert len(find_corners(-phi, outside, 1.0)[0]) == 0
