"""Divergence and pressure gradient on cut cells against NumPy."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from flowborne.fluid.ghosts import plane, planes
from flowborne.fluid.grid import Grid
from flowborne.kernels.arrays import FREE, PERIODIC, PRESCRIBED
from flowborne.kernels.projection import net_out, open_outflow, subtract_gradient

from .references.outflow import outflow_reference
from .references.pressure_gradient import subtract_gradient_reference

SHAPES = [(5, 7, 6), (9, 8, 1), (1, 4, 3)]
SIDES = [*itertools.product((PRESCRIBED, FREE), repeat=2), (PERIODIC, PERIODIC)]


def faces(shape: tuple[int, int, int], seed: int) -> list[np.ndarray]:
    """Random values on the faces, a third of them 0."""
    random = np.random.default_rng(seed)
    sizes = [tuple(n + (axis == d) for d, n in enumerate(shape)) for axis in range(3)]
    return [random.random(size) * (random.random(size) > 1 / 3) for size in sizes]


@pytest.mark.parametrize("shape", SHAPES)
def test_outflow(shape: tuple[int, int, int]) -> None:
    velocity, opened, out = faces(shape, 0), faces(shape, 1), np.empty(shape)
    grid, expected = Grid(shape, 0.1), outflow_reference(velocity, opened)
    if grid.is_slab:
        expected = outflow_reference([*velocity[:2], 0.0 * velocity[2]], opened)
    x, y, z = (a * u for a, u in zip(opened, velocity, strict=True))
    net_out(plane(out, grid), *planes((x, y, z), grid))
    np.testing.assert_allclose(out, expected, atol=1e-14)


@pytest.mark.parametrize("shape", SHAPES[:2])
def test_open_outflow(shape: tuple[int, int, int]) -> None:
    velocity, opened, out = faces(shape, 0), faces(shape, 1), np.empty(shape)
    rate = np.random.default_rng(2).standard_normal(shape)
    if shape[2] == 1:  # no fluid moves across a slab
        velocity[2][:] = 0.0
    open_outflow(out, tuple(opened), tuple(velocity), rate, 0.3)
    expected = 0.3 * outflow_reference(velocity, opened) - rate
    np.testing.assert_allclose(out, expected, atol=1e-14)


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("axis", [0, 1, 2])
@pytest.mark.parametrize("sides", SIDES)
def test_push_faces(shape: tuple[int, int, int], axis: int, sides: tuple[int, int]) -> None:
    velocity, rate = faces(shape, 2)[axis], faces(shape, 3)[axis]
    pressure = np.random.default_rng(4).standard_normal(shape)
    for end in np.flatnonzero(np.array(sides) == PRESCRIBED):
        np.moveaxis(rate, axis, 0)[-end] = 0.0
    expected = subtract_gradient_reference(velocity, rate, pressure, axis, 0.7, sides)
    thin, periodic = velocity.copy(), sides[0] == PERIODIC
    twin = velocity.copy()
    subtract_gradient.parallel(twin, rate, pressure, axis, 0.7, periodic)
    subtract_gradient(velocity, rate, pressure, axis, 0.7, periodic)
    np.testing.assert_array_equal(twin, velocity)
    np.testing.assert_allclose(velocity, expected, atol=1e-14)
    if shape[2] == 1 and axis < 2:
        grid = Grid(shape, 0.1)
        fields = (plane(values, grid) for values in (thin, rate, pressure))
        subtract_gradient(*fields, axis + 1, 0.7, periodic)
        np.testing.assert_array_equal(thin, velocity)
