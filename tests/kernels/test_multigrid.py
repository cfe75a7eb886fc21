"""The V-cycle's parts against their NumPy statements, and its symmetry."""

import numpy as np
import pytest

from flowborne.kernels.conjugate_gradients import deflated
from flowborne.kernels.levels import at_level, interpolation_at, orphans_at, weights_at, wrap_ghosts
from flowborne.kernels.smoothing import STEPS, WEIGHTS, apply_laplacian, first_smooth, smooth
from flowborne.kernels.v_cycle import interpolate, restrict, v_cycle
from flowborne.solvers.pressure import PressureSystem

from .padded import cells_of
from .references.deflation import deflated_reference
from .references.laplacian import apply_laplacian_reference, operator
from .references.smoothing import defect_reference, smooth_reference
from .references.transfer import interpolate_reference, restrict_reference
from .references.v_cycle import v_cycle_reference

SHAPES = [
    ((12, 9, 1), (False, False, False)),
    ((8, 12, 1), (True, False, False)),
    ((6, 7, 10), (False, False, True)),
]


def system_of(shape, periodic, seed=0):
    """Random weights with many closed faces, so that blocks fall apart; lower x side open."""
    rng = np.random.default_rng(seed)
    weights = []
    for axis in range(3):
        size = list(shape)
        size[axis] += 1
        w = rng.uniform(0.05, 1.0, size) * (rng.uniform(size=size) > 0.35)
        ends = np.moveaxis(w, axis, 0)
        ends[-1] = ends[0] = ends[0] if periodic[axis] and shape[axis] > 1 else 0.0
        if axis == 0 and not periodic[axis]:
            ends[0] = 2.0
        weights.append(w)
    return PressureSystem(weights, periodic)


def finest_of(system, count, seed=1):
    """Weights and 1 / diagonal of the finest level, and random fields of its padded shape."""
    table, rng = system.buffers.table, np.random.default_rng(seed)
    inverse = at_level(system.buffers.inverse, table, 0)
    fields = [rng.standard_normal(inverse.shape).astype(np.float32) for _ in range(count)]
    return weights_at(system.buffers.weights, table, 0), inverse, fields


@pytest.mark.parametrize(("shape", "periodic"), SHAPES)
@pytest.mark.parametrize("step", range(STEPS))
def test_smoothing_and_defect_are_what_numpy_says(shape, periodic, step):
    w, inverse, (x, b) = finest_of(system_of(shape, periodic), 2)
    smoothed, r = x.copy(), np.zeros_like(x)
    smooth(smoothed, x, b, operator(w, inverse), WEIGHTS[step])
    expected = smooth_reference(x, b, w, inverse, step)
    np.testing.assert_allclose(smoothed, expected, rtol=1e-5, atol=1e-5)
    smooth(r, x, b, operator(w, inverse), None)
    np.testing.assert_allclose(r, defect_reference(x, b, w, inverse), atol=1e-4)


def test_the_first_step_begins_from_nothing():
    w, inverse, (x, b) = finest_of(system_of(*SHAPES[2]), 2)
    first_smooth(x, b, inverse)
    expected = smooth_reference(np.zeros_like(x), b, w, inverse, 0)
    np.testing.assert_allclose(x, expected, rtol=1e-6)


def with_ghosts(values):
    """A field with a layer of zeros around it, but for an axis of one cell."""
    return np.pad(values, [(int(n > 1),) * 2 for n in values.shape])


def transfer_of(system):
    """Marks, interpolation coefficients, orphans and aggregates of the finest level."""
    b = system.buffers
    return (
        at_level(b.marks, b.table, 0),
        interpolation_at(b.interpolation, b.table, 0),
        orphans_at(b.orphans, b.table, 0),
        at_level(b.aggregates, b.table, 0),
    )


@pytest.mark.parametrize(("shape", "periodic"), SHAPES)
def test_transfer_is_what_numpy_says(shape, periodic):
    system = system_of(shape, periodic)
    parts, table = transfer_of(system), system.buffers.table
    assert parts[2].size > 0
    _, _, (x, r) = finest_of(system, 2)
    coarse = np.zeros_like(at_level(system.buffers.inverse, table, 1))
    coarse[:] = with_ghosts(
        np.random.default_rng(3).standard_normal(coarse[cells_of(coarse)].shape)
    )
    wrap_ghosts(coarse, system.buffers.periodic)
    expected = interpolate_reference(x, coarse, *parts)
    found = np.full_like(x, np.nan)
    interpolate(found, x, coarse, *parts)
    inside = cells_of(x)
    np.testing.assert_allclose(found[inside], expected[inside], rtol=1e-5, atol=1e-5)
    r = with_ghosts(r[cells_of(r)])
    wrap_ghosts(r, system.buffers.periodic)
    restrict(coarse, r, *parts)
    expected = restrict_reference(coarse, r, *parts, system.buffers.periodic)
    np.testing.assert_allclose(coarse[cells_of(coarse)], expected[cells_of(coarse)], atol=1e-5)


@pytest.mark.parametrize(("shape", "periodic"), [*SHAPES[:1], ((7, 6, 9), (False, False, False))])
def test_restriction_is_the_transpose_of_interpolation(shape, periodic):
    """Guests included; without periodic axes, where ghosts would have to be folded back."""
    system = system_of(shape, periodic)
    b, parts = system.buffers, transfer_of(system)
    assert parts[2].size > 0
    fine, coarse = (np.zeros_like(at_level(b.inverse, b.table, level)) for level in (0, 1))
    rng = np.random.default_rng(2)
    inside = tuple(slice(1, -1) if n > 1 else slice(None) for n in fine.shape)
    r, c = fine.copy(), coarse.copy()
    r[inside] = rng.standard_normal(r[inside].shape)
    c[inside] = rng.standard_normal(c[inside].shape)
    interpolate(fine, fine, c, *parts)
    restrict(coarse, r, *parts)
    up, down = np.vdot(fine[inside], r[inside]), np.vdot(c[inside], coarse[inside])
    assert up == pytest.approx(down, rel=1e-5)


@pytest.mark.parametrize("periodic", [(0, 0, 0), (1, 0, 1), (0, 1, 0)])
def test_ghosts_are_those_of_the_other_end(periodic):
    x = np.random.default_rng(4).standard_normal((5, 6, 7))
    expected = x.copy()
    for axis in np.flatnonzero(periodic):
        ends = np.moveaxis(expected, axis, 0)
        ends[0], ends[-1] = ends[-2], ends[1]
    wrap_ghosts(x, np.array(periodic, np.uint8))
    np.testing.assert_array_equal(x, expected)


@pytest.mark.parametrize(("shape", "periodic"), SHAPES)
def test_cycle_is_what_numpy_says(shape, periodic):
    system = system_of(shape, periodic)
    x, b, _ = (at_level(a, system.buffers.table, 0) for a in system.buffers.cycle)
    b[:] = with_ghosts(np.random.default_rng(5).standard_normal(b[cells_of(b)].shape))
    expected = v_cycle_reference(system.buffers.hierarchy, b)
    v_cycle(system.buffers.hierarchy, *system.buffers.cycle)
    np.testing.assert_allclose(x, expected, atol=1e-5 * np.abs(expected).max())


@pytest.mark.parametrize(("shape", "periodic"), SHAPES)
def test_cycle_is_symmetric_and_positive(shape, periodic):
    system = system_of(shape, periodic)
    x, b, _ = (at_level(a, system.buffers.table, 0) for a in system.buffers.cycle)
    active = np.flatnonzero(system.buffers.finest[3] > 0.0)
    matrix = np.empty((active.size, active.size))
    for n, cell in enumerate(active):
        b[:] = 0.0
        b.reshape(-1)[cell] = 1.0
        v_cycle(system.buffers.hierarchy, *system.buffers.cycle)
        matrix[:, n] = x.reshape(-1)[active]
    assert np.abs(matrix - matrix.T).max() <= 1e-5 * np.abs(matrix).max()
    assert np.linalg.eigvalsh(0.5 * (matrix + matrix.T)).min() > 0.0


@pytest.mark.parametrize("shape", [(6, 7, 10), (1, 12, 9)])
@pytest.mark.parametrize("count", [0, 3])
def test_deflation_is_what_numpy_says(shape, count):
    rng = np.random.default_rng(2)
    padded = tuple(n + 2 if n > 1 else 1 for n in shape)
    z, r, strength = rng.standard_normal(padded), rng.standard_normal(padded), rng.random(count)
    fields, out = rng.standard_normal((count, *padded)), np.zeros(padded)
    product = deflated(out, z, r, 0.5, strength, fields)
    expected = deflated_reference(z, 0.5, strength, fields)
    np.testing.assert_allclose(out, expected, atol=1e-14)
    assert product == pytest.approx(np.vdot(expected, r))


@pytest.mark.parametrize("shape", [(6, 7, 10), (1, 12, 9)])
def test_the_laplacian_is_what_numpy_says(shape):
    rng = np.random.default_rng(3)
    padded = tuple(n + 2 if n > 1 else 1 for n in shape)
    p, *finest = (rng.standard_normal(padded) for _ in range(5))
    out = np.zeros(padded)
    K = operator(finest[:3], finest[3])
    energy = apply_laplacian(out, p, K)
    expected = apply_laplacian_reference(p, K)
    np.testing.assert_allclose(out, expected, atol=1e-13)
    assert energy == pytest.approx(np.vdot(p, expected))
