"""The bound on the energy of what is carried."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from flowborne.fluid.energy import energy, without_gain
from flowborne.fluid.grid import Faces, Grid

GRID = Grid((4, 3, 2), 0.5)


def random_faces(random: np.random.Generator, low: float = -1.0) -> Faces:
    x, y, z = (random.uniform(low, 1.0, GRID.face_shape(axis)) for axis in range(3))
    return x, y, z


@given(seed=st.integers(0, 10_000), part=st.floats(0.0, 1.2))
@settings(max_examples=60, deadline=None)
def test_the_bound_is_held_with_the_least_change(seed: int, part: float) -> None:
    random = np.random.default_rng(seed)
    mass, plain = random_faces(random, 0.0), random_faces(random)
    for axis in range(3):
        plain[axis][:] *= 0.5
    carried = random_faces(random)
    start = tuple(u.copy() for u in carried)
    high, low = energy(carried, mass), energy(plain, mass)
    most = low + part * (high - low)
    share = without_gain(carried, plain, mass, most)
    found = energy(carried, mass)
    for axis in range(3):
        expected = start[axis] + share * (plain[axis] - start[axis])
        assert carried[axis] == pytest.approx(expected)
    if part >= 1.0 and high > low:
        assert share == 0.0
    elif 0.0 < share < 1.0:
        assert found == pytest.approx(most, rel=1e-10)
    assert share == 1.0 or found <= most * (1.0 + 1e-10)


def test_what_even_the_plain_scheme_exceeds_is_left_to_it() -> None:
    random = np.random.default_rng(1)
    mass, plain, carried = (random_faces(random, 0.1) for _ in range(3))
    assert without_gain(carried, plain, mass, 0.5 * energy(plain, mass)) == 1.0
    for axis in range(3):
        assert carried[axis] == pytest.approx(plain[axis])
