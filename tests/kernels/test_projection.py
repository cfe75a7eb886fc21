"""Divergence and pressure gradient on cut cells against NumPy."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from flowborne.fluid.ghosts import plane, planes
from flowborne.fluid.grid import Grid
from flowborne.kernels.arrays import FREE, PERIODIC, PRESCRIBED
from flowborne.kernels.projection import (
    fill_around,
    mark_unsettled,
    net_out,
    open_outflow,
    subtract_gradient,
)

from .references.outflow import fill_around_reference, outflow_reference
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
    rate, grid = np.random.default_rng(2).standard_normal(shape), Grid(shape, 0.1)
    if shape[2] == 1:  # no fluid moves across a slab
        velocity[2][:] = 0.0
    fields = planes(tuple(opened), grid), planes(tuple(velocity), grid), plane(rate, grid)
    open_outflow(plane(out, grid), *fields, 0.3)
    expected = 0.3 * outflow_reference(velocity, opened) - rate
    np.testing.assert_allclose(out, expected, atol=1e-14)


@pytest.mark.parametrize("shape", SHAPES[:2])
def test_cells_that_are_cut_or_that_fluxes_do_not_fill_are_marked(
    shape: tuple[int, int, int],
) -> None:
    random, grid, dt, slack = np.random.default_rng(5), Grid(shape, 1.0), 0.3, 1e-6
    flux, rate, marks = faces(shape, 0), random.random(shape), np.empty(shape, np.uint8)
    if grid.is_slab:
        flux[2][:] = 0.0
    before, end = (np.where(random.random(shape) < 0.2, 0.7, 1.0) for _ in range(2))
    net = outflow_reference(flux, [np.ones(q.shape) for q in flux])
    off = slack * random.choice([-2.0, -0.6, 0.0, 0.6, 2.0], shape)
    start = end - dt * (rate - net) + off
    volumes = tuple(plane(v, grid) for v in (start, rate, before, end))
    given = planes((flux[0], flux[1], flux[2]), grid), dt, 1.0, slack
    mark_unsettled(plane(marks, grid), volumes, *given)
    expected = (before < 1.0) | (end < 1.0) | (np.abs(off) > slack)
    np.testing.assert_array_equal(marks.astype(bool), expected)
    marks[:] = 2
    mark_unsettled.parallel(plane(marks, grid), volumes, *given)
    np.testing.assert_array_equal(marks.astype(bool), expected)


@pytest.mark.parametrize(
    ("shape", "box"),
    [
        ((9, 7, 6), (slice(3, 5), slice(2, 6), slice(1, 3))),
        ((5, 8, 7), (slice(0, 5), slice(1, 3), slice(4, 7))),
        ((9, 8, 1), (slice(2, 5), slice(3, 4), slice(0, 1))),
    ],
)
def test_fluxes_fill_the_cells_around_a_box(
    shape: tuple[int, int, int], box: tuple[slice, slice, slice]
) -> None:
    random, grid, dt = np.random.default_rng(6), Grid(shape, 1.0), 0.3
    x, y, z = faces(shape, 0)
    start, rate, end = (random.random(shape) for _ in range(3))
    if grid.is_slab:
        z[:] = 0.0
    expected = fill_around_reference((x, y, z), (start - end) / dt + rate, box)
    volumes = tuple(plane(v, grid) for v in (start, rate, end, end))
    ends = tuple((c.start, c.stop) for c in box)
    ends = ((0, 1), *ends[:2]) if grid.is_slab else ends
    for version in (fill_around, fill_around.parallel):
        flux = x.copy(), y.copy(), z.copy()
        version(planes(flux, grid), volumes, ends, dt)
        for found, known in zip(flux, expected, strict=True):
            np.testing.assert_allclose(found, known, atol=1e-13)
        left = start + dt * (rate - outflow_reference(flux, (np.ones(1),) * 3)) - end
        left[box] = 0.0
        assert np.abs(left).max() < 1e-14


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("axis", [0, 1, 2])
@pytest.mark.parametrize("sides", SIDES)
def test_push_faces(shape: tuple[int, int, int], axis: int, sides: tuple[int, int]) -> None:
    velocity, rate = faces(shape, 2)[axis], faces(shape, 3)[axis]
    pressure = np.random.default_rng(4).standard_normal(shape)
    for end in np.flatnonzero(np.array(sides) == PRESCRIBED):
        np.moveaxis(rate, axis, 0)[-end] = 0.0
    expected = subtract_gradient_reference(velocity, rate, pressure, axis, 0.7, sides)
    thin, threaded, periodic = velocity.copy(), velocity.copy(), sides[0] == PERIODIC
    out = np.empty(velocity.shape)
    subtract_gradient((velocity, velocity, rate), pressure, axis, 0.7, periodic)
    subtract_gradient.parallel((out, threaded, rate), pressure, axis, 0.7, periodic)
    np.testing.assert_allclose(velocity, expected, atol=1e-14)
    np.testing.assert_array_equal(velocity, out)
    if shape[2] == 1 and axis < 2:
        grid = Grid(shape, 0.1)
        flat, rates, cells = (plane(values, grid) for values in (thin, rate, pressure))
        subtract_gradient((flat, flat, rates), cells, axis + 1, 0.7, periodic)
        np.testing.assert_array_equal(thin, velocity)
