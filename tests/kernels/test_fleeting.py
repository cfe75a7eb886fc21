"""Fleeting control volumes against one system of equations, and what they exchange adds up."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest

from flowborne.kernels.fleeting import let_through, what_leaves

from .references.control_volumes import neighbours_reference
from .references.fleeting import let_through_reference, what_leaves_reference

NOTHING = 1e-9


@dataclass
class Case:
    """Random control volumes, more flowing through the listed ones than they hold."""

    field: np.ndarray
    later: np.ndarray
    volumes: np.ndarray
    listed: np.ndarray
    beside: np.ndarray
    row: np.ndarray
    out: np.ndarray

    def lists(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        return self.listed, self.beside, self.row


def case_of(shape: tuple[int, int, int], ring: bool, seed: int) -> Case:
    random, size = np.random.default_rng(seed), int(np.prod(shape))
    wraps = np.array([shape[0] * ring, 0, 0])
    beyond = neighbours_reference(np.array(shape), wraps)
    through = np.zeros((6, size))
    for axis in range(3):
        through[2 * axis + 1] = random.normal(size=size)
        inside = beyond[2 * axis + 1] >= 0
        through[2 * axis, beyond[2 * axis + 1][inside]] = -through[2 * axis + 1][inside]
    volumes = random.choice([0.0, 0.05, 0.3, 1.0], size)
    gone = (np.maximum(through, 0.0) * (beyond >= 0)).sum(axis=0)
    listed = np.flatnonzero((gone > volumes) & (random.random(size) < 0.7))
    place = np.full(size + 1, -1)
    place[listed] = np.arange(listed.size)
    beside = np.ascontiguousarray(beyond[:, listed].T)
    return Case(
        random.normal(size=shape),
        random.normal(size=shape),
        volumes.reshape(shape),
        listed,
        beside,
        place[beside],
        np.ascontiguousarray(through[:, listed].T),
    )


CASES = pytest.mark.parametrize("ring", [False, True])
SHAPES = pytest.mark.parametrize("shape", [(7, 6, 5), (9, 8, 1)], ids=["room", "slab"])


@SHAPES
@CASES
@pytest.mark.parametrize("seed", range(3))
def test_what_leaves_solves_all_of_them_at_once(
    shape: tuple[int, int, int], ring: bool, seed: int
) -> None:
    case = case_of(shape, ring, seed)
    given = case.field, case.later, case.volumes, *case.lists(), case.out, NOTHING
    np.testing.assert_allclose(what_leaves(*given), what_leaves_reference(*given), rtol=1e-9)


@SHAPES
@CASES
def test_what_one_gives_another_takes(shape: tuple[int, int, int], ring: bool) -> None:
    case, dt = case_of(shape, ring, 4), 0.3
    net = np.random.default_rng(5).normal(size=shape)
    arriving = case.field.ravel()[case.beside]
    leaving = np.random.default_rng(6).normal(size=case.listed.size)
    fixed = case.field, case.volumes, *case.lists(), case.out, arriving, leaving, dt, NOTHING
    later, gone = case.later.copy(), net.copy()
    let_through(later, gone, *fixed)
    expected = let_through_reference(case.later, net, *fixed)
    np.testing.assert_allclose(later, expected[0], atol=1e-12)
    np.testing.assert_allclose(gone, expected[1], atol=1e-12)
    volumes = np.where(case.volumes > NOTHING, case.volumes, 1.0)
    assert (volumes * (later - case.later)).sum() == pytest.approx(0.0, abs=1e-12)
    assert np.abs(later - case.later).max() > 1.0


@SHAPES
def test_a_uniform_field_leaves_as_it_is(shape: tuple[int, int, int]) -> None:
    case, speed = case_of(shape, True, 7), 0.7
    field, later = np.full(shape, speed), np.where(case.volumes > NOTHING, speed, 0.0)
    leaving = what_leaves(field, later, case.volumes, *case.lists(), case.out, NOTHING)
    assert leaving.size > 20
    np.testing.assert_allclose(leaving, speed, rtol=1e-12)
