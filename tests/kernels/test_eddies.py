"""Eddies of two cells: taken away as the matrices say, and nothing else."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest

from flowborne.kernels.arrays import Array, Integers
from flowborne.kernels.eddies import edges_near, exchange, exchanges

from .references.eddies import circulation_matrix, exchange_matrix

CASES = [
    ((1, 6, 7), 0, (0, 0, 0)),
    ((1, 6, 7), 0, (0, 1, 0)),
    *(((4, 5, 6), axis, wraps) for axis in range(3) for wraps in ((0, 0, 0), (1, 0, 1))),
]
"""Cells, axis of the edges, which axes are periodic."""


@dataclass(frozen=True)
class Edges:
    """Random velocities and volumes, a fifth of them of closed faces, and edges around all faces.

    places  (n, 3) indices
    listed  as by `edges_near`
    C       circulation of all faces
    """

    axis: int
    wraps: Integers
    velocity: tuple[Array, Array]
    volumes: tuple[Array, Array]
    places: Integers
    listed: tuple[Integers, Integers, Array]
    C: Array

    @property
    def held(self) -> Array:
        return np.concatenate([values.ravel() for values in self.volumes])

    @property
    def all_faces(self) -> Array:
        return np.concatenate([values.ravel() for values in self.velocity])

    def exchange_matrix(self, rate: float) -> Array:
        u, v = (np.where(half, self.all_faces, 0.0) for half in self.halves())
        speed = sum(np.abs(np.abs(self.C) @ values) for values in (u, v))
        part, least = np.minimum(0.5 * rate * speed, 1.0), self.listed[2]
        return exchange_matrix(self.places, self.axis, self.wraps, least, part)

    def halves(self) -> tuple[Array, Array]:
        first = np.arange(self.held.size) < self.velocity[0].size
        return first, ~first


def edges_of(shape: tuple[int, int, int], axis: int, periodic: tuple[int, int, int]) -> Edges:
    random, fields, volumes, cut = np.random.default_rng(axis), [], [], []
    for own in ((axis + 1) % 3, (axis + 2) % 3):
        faces = [n + (a == own) for a, n in enumerate(shape)]
        fields.append(random.normal(size=faces))
        volumes.append(np.where(random.random(faces) < 0.2, 0.0, random.random(faces)))
        once = range(shape[own] + (not periodic[own]))  # the last ones may be the first ones
        cut.append(np.arange(fields[-1].size).reshape(faces).take(once, own).ravel())
    number = np.zeros([n + (a != axis) for a, n in enumerate(shape)], np.int32)
    wraps, held = np.array(shape) * np.array(periodic), (volumes[0], volumes[1])
    listed = edges_near(number, held, (cut[0], cut[1]), axis, wraps, 0)
    at = np.argsort(number.ravel())[number.size - len(listed[0]) :]
    places, velocity = np.array(np.unravel_index(at, number.shape)).T, (fields[0], fields[1])
    C = circulation_matrix(places, axis, velocity)
    return Edges(axis, wraps, velocity, held, places, listed, C)


@pytest.mark.parametrize(("shape", "axis", "periodic"), CASES)
def test_edges_exchange_what_the_matrices_say(shape, axis, periodic):
    edges, rate = edges_of(shape, axis, periodic), 0.7
    assert len(edges.places) > 8
    smallest = [edges.held[row != 0.0].min() for row in edges.C]
    np.testing.assert_array_equal(edges.listed[2], smallest)
    before, faces, beside = edges.all_faces, *edges.listed[:2]
    given = exchanges(*edges.velocity, *edges.listed, rate)
    wanted = edges.exchange_matrix(rate) @ edges.C @ before / 64.0
    np.testing.assert_allclose(given, wanted, atol=1e-15)
    exchange(*edges.velocity, edges.volumes, faces, beside, given)
    taken = np.divide(
        edges.C.T @ given, edges.held, out=np.zeros(before.size), where=edges.held > 0.0
    )
    np.testing.assert_allclose(edges.all_faces, before - taken, rtol=1e-12, atol=1e-15)


@pytest.mark.parametrize(("shape", "axis", "periodic"), CASES)
def test_no_wave_is_turned_over(shape, axis, periodic):
    """The largest part of any flow that goes in one turn is below 1, whatever the volumes."""
    edges = edges_of(shape, axis, periodic)
    open_face = edges.held > 0.0
    C = edges.C[:, open_face] / np.sqrt(edges.held[open_face])
    values = np.linalg.eigvalsh(C.T @ edges.exchange_matrix(1e9) @ C) / 64.0
    assert values[0] > -1e-12
    assert values[-1] < 1.0


@pytest.mark.parametrize(("shape", "part"), [((1, 4, 4), 1.0), ((1, 4, 4), 0.3), ((4, 4, 4), 1.5)])
def test_an_eddy_of_two_cells_loses_its_part(shape: tuple[int, int, int], part: float) -> None:
    """Across one axis just that; one of two cells along all three axes half as much again, so that
    it is turned over with a quarter of its energy where `part` is 1."""
    sign = (-1.0) ** np.indices(shape).sum(axis=0)
    flow, change = (0.0 * sign, sign, -sign), np.zeros((3, *shape))
    rate, wraps = (1.0 if shape[0] > 1 else part) / 2.0, np.array(shape)
    for axis in range(3 if shape[0] > 1 else 1):
        own = (axis + 1) % 3, (axis + 2) % 3
        u, v = (np.concatenate([flow[a], flow[a].take([0], a)], a) + 1.0 for a in own)
        volumes, number = (np.ones(u.shape), np.ones(v.shape)), np.zeros(wraps + 1, np.int32)
        number = number[tuple(slice(-1 if a == axis else None) for a in range(3))].copy()
        once = [
            np.arange(f.size).reshape(f.shape).take(range(4), a)
            for f, a in zip((u, v), own, strict=True)
        ]
        listed = edges_near(number, volumes, (once[0].ravel(), once[1].ravel()), axis, wraps, 0)
        was, given = (u.copy(), v.copy()), exchanges(u, v, *listed, rate)
        exchange(u, v, volumes, *listed[:2], given)
        for a, now, before in zip(own, (u, v), was, strict=True):
            change[a] += (now - before).take(range(4), a)
    np.testing.assert_allclose(change, -part * np.array(flow), atol=1e-14)


@pytest.mark.parametrize(("reach", "count"), [(0, 2), (1, 8), (2, 14)])
def test_edges_near_a_cut_face_are_listed_once(reach, count):
    """Those at both of its ends, and at the ends of faces up to `reach` away along an axis."""
    number, held = np.zeros((1, 13, 13), np.int32), (np.ones((1, 13, 12)), np.ones((1, 12, 13)))
    face, none = np.array([6 * 12 + 5]), np.zeros(0, np.int64)
    listed = edges_near(number, held, (face, none), 0, np.zeros(3, np.int64), reach)
    assert len(listed[0]) == count
    np.testing.assert_array_equal(np.sort(number[number > 0]), np.arange(count) + 1)
