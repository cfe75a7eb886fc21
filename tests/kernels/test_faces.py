"""Whole fields on the faces, against NumPy."""

from __future__ import annotations

import numpy as np
import pytest

from flowborne.kernels.faces import (
    accelerate,
    changes_of_step,
    is_finite,
    largest_open,
    mean_flux,
    mean_row,
    still_to_come,
    weigh,
    weighted_sums,
)

from .cut_cells import face_shape
from .references.faces import accelerate_reference, face_means

Shape = tuple[int, int, int]

SHAPES = pytest.mark.parametrize("shape", [(9, 8, 77), (9, 8, 1), (1, 2, 3)])


def fields(shape: Shape, count: int) -> np.ndarray:
    """(count, shape) random values, a third of them 0."""
    random = np.random.default_rng(5)
    return random.standard_normal((count, *shape)) * (random.random((count, *shape)) > 1 / 3)


@SHAPES
@pytest.mark.parametrize("axis", [0, 1, 2])
@pytest.mark.parametrize("periodic", [False, True])
def test_mean_row(shape: Shape, axis: int, periodic: bool) -> None:
    (cells,), out = fields(shape, 1), np.empty(face_shape(shape, axis))
    for i, j in np.ndindex(out.shape[:2]):
        mean_row(out[i, j], cells, i, j, axis, periodic)
    np.testing.assert_allclose(out, face_means(cells, axis, periodic), rtol=1e-15)


def test_threads_change_no_bit() -> None:
    """Of what is not one operation for each face."""
    first, before, after, weight = fields((40, 33, 37), 4)
    sums = weighted_sums(weight, 1.7, first, before, after)
    assert (weighted_sums.parallel(weight, 1.7, first, before, after) == sums).all()
    assert largest_open.parallel(before, after, 0.0) == largest_open(before, after, 0.0)


@SHAPES
def test_rates(shape: Shape) -> None:
    opened, volume = np.abs(fields(shape, 2))
    rate = np.empty(shape)
    accelerate(rate, opened, volume, 1.7, 0.3)
    expected = accelerate_reference(opened, 1.7 * volume, 0.3)
    np.testing.assert_allclose(rate, expected, rtol=1e-14)


@SHAPES
def test_weights(shape: Shape) -> None:
    opened, rate = np.abs(fields(shape, 2))
    weight = np.empty(shape)
    weigh(weight, opened, rate, 0.3)
    np.testing.assert_allclose(weight, 0.3 * opened * rate, rtol=1e-15)


@SHAPES
def test_mean_flux(shape: Shape) -> None:
    u, change, before, after = fields(shape, 4)
    flux, weight = np.empty(shape), np.empty(shape)
    mean_flux(flux, weight, u, change, before, after, 0.3, 7.0)
    np.testing.assert_allclose(weight, 3.5 * (before + after), rtol=1e-14, atol=1e-16)
    np.testing.assert_allclose(
        flux, 0.15 * (before + after) * (u + 0.5 * change), rtol=1e-14, atol=1e-16
    )


@SHAPES
def test_a_velocity_goes_on(shape: Shape) -> None:
    u, opened, inside, was = fields(shape, 4)
    rate, change = np.empty(shape), was.copy()
    changes_of_step(rate, change, u, opened, inside, 0.1)
    np.testing.assert_allclose(rate, (u - inside + opened - was) / 0.1, rtol=1e-14)
    np.testing.assert_array_equal(change, u - was)
    still_to_come(rate, opened, u, was, 0.1)
    np.testing.assert_allclose(rate, opened - 2.0 * (u - was) / 0.1, rtol=1e-14, atol=1e-14)


@SHAPES
def test_weighted_sums(shape: Shape) -> None:
    volume, first, before, after = fields(shape, 4)
    mass = 1.7 * volume
    change = mass * (after - before)
    parts = mass * first, mass * before, mass * after, change, np.abs(change)
    sums = [part.sum() for part in parts]
    found = weighted_sums(volume, 1.7, first, before, after)
    np.testing.assert_allclose(found, sums, rtol=1e-12)


@SHAPES
@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_one_value_that_is_no_number_is_found(shape: Shape, value: float) -> None:
    (field,) = fields(shape, 1)
    assert is_finite(field)
    field[tuple(n // 2 for n in shape)] = value
    assert not is_finite(field)


@SHAPES
def test_largest_size(shape: Shape) -> None:
    field, opened = fields(shape, 2)
    for part in (0.0, 0.5):
        expected = np.abs(field).max(where=opened > part, initial=0.0)
        assert largest_open(field, opened, part) == expected
