"""The V-cycle's parts against their NumPy statements, and its symmetry."""

import numpy as np
import pytest

from flowborne.kernels.deflation import deflated
from flowborne.kernels.laplacian import apply_laplacian
from flowborne.kernels.levels import at_level, guests_at, leaning_at, weights_at
from flowborne.kernels.smoothing import defect, smooth
from flowborne.kernels.transfer import interpolate, restrict
from flowborne.kernels.v_cycle import v_cycle
from flowborne.solvers.pressure import PressureSystem

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


@pytest.mark.parametrize(("shape", "periodic"), SHAPES)
def test_smoothing_and_defect_are_what_numpy_says(shape, periodic):
    system = system_of(shape, periodic)
    table = system.buffers.table
    w = weights_at(system.buffers.weights, table, 0)
    inverse = at_level(system.buffers.inverse, table, 0)
    rng = np.random.default_rng(1)
    x, b = (rng.standard_normal(inverse.shape).astype(np.float32) for _ in range(2))
    i, j, k = np.indices(x.shape)
    d = int(x.shape[0] > 1)
    inside = np.zeros(x.shape, bool)
    inside[slice(1, -1) if d else slice(None), 1:-1, 1:-1] = True
    pull = np.zeros_like(x)
    for axis in range(1 - d, 3):
        upper = np.roll(w[axis], -1, axis)
        pull += w[axis] * np.roll(x, 1, axis) + upper * np.roll(x, -1, axis)
    expected = np.where(inside & ((i - d + j + k) % 2 == 1), (b + pull) * inverse, x)
    smoothed = x.copy()
    smooth(smoothed, b, w, inverse, 1)
    np.testing.assert_allclose(smoothed, expected, rtol=1e-5, atol=1e-5)
    r = np.zeros_like(x)
    defect(r, x, b, w, inverse)
    active = inside & (inverse > 0.0)
    safe = np.where(active, inverse, 1.0)
    np.testing.assert_allclose(r, np.where(active, b + pull - x / safe, 0.0), atol=1e-4)


@pytest.mark.parametrize(("shape", "periodic"), [*SHAPES[:1], ((7, 6, 9), (False, False, False))])
def test_restriction_is_the_transpose_of_interpolation(shape, periodic):
    """Guests included; without periodic axes, where ghosts would have to be folded back."""
    system = system_of(shape, periodic)
    b = system.buffers
    parts = (
        at_level(b.marks, b.table, 0),
        leaning_at(b.lean, b.table, 0),
        guests_at(b.guests, b.table, 0),
        at_level(b.hosts, b.table, 0),
    )
    assert parts[2].size > 0
    fine, coarse = (np.zeros_like(at_level(b.inverse, b.table, level)) for level in (0, 1))
    rng = np.random.default_rng(2)
    inside = tuple(slice(1, -1) if n > 1 else slice(None) for n in fine.shape)
    r, c = fine.copy(), coarse.copy()
    r[inside] = rng.standard_normal(r[inside].shape)
    c[inside] = rng.standard_normal(c[inside].shape)
    interpolate(fine, c, *parts)
    restrict(coarse, r, *parts)
    up, down = np.vdot(fine[inside], r[inside]), np.vdot(c[inside], coarse[inside])
    assert up == pytest.approx(down, rel=1e-5)


@pytest.mark.parametrize(("shape", "periodic"), SHAPES)
def test_cycle_is_symmetric_and_positive(shape, periodic):
    system = system_of(shape, periodic)
    x, b, _ = (at_level(a, system.buffers.table, 0) for a in system.buffers.cycle)
    active = np.flatnonzero(system.buffers.finest[3] > 0.0)
    matrix = np.empty((active.size, active.size))
    for n, cell in enumerate(active):
        b[:] = 0.0
        b.reshape(-1)[cell] = 1.0
        v_cycle(system.hierarchy, *system.buffers.cycle)
        matrix[:, n] = x.reshape(-1)[active]
    assert np.abs(matrix - matrix.T).max() <= 1e-5 * np.abs(matrix).max()
    assert np.linalg.eigvalsh(0.5 * (matrix + matrix.T)).min() > 0.0


@pytest.mark.parametrize("shape", [(6, 7, 10), (1, 12, 9)])
@pytest.mark.parametrize("count", [0, 3])
def test_the_preconditioner_takes_off_what_bodies_answer(shape, count):
    rng = np.random.default_rng(2)
    padded = tuple(n + 2 if n > 1 else 1 for n in shape)
    cells = tuple(slice(1, -1) if n > 1 else slice(None) for n in shape)
    z, r, amount = rng.standard_normal(padded), rng.standard_normal(padded), rng.random(count)
    fields = rng.standard_normal((count, *padded))
    out, expected = np.zeros(padded), np.zeros(padded)
    expected[cells] = (0.5 * z - np.tensordot(amount, fields, 1))[cells]
    product = deflated(out, z, r, 0.5, amount, fields)
    np.testing.assert_allclose(out, expected, atol=1e-14)
    assert product == pytest.approx(np.vdot(expected, r))


@pytest.mark.parametrize("shape", [(6, 7, 10), (1, 12, 9)])
def test_the_laplacian_is_what_numpy_says(shape):
    rng = np.random.default_rng(3)
    padded = tuple(n + 2 if n > 1 else 1 for n in shape)
    cells = tuple(slice(1, -1) if n > 1 else slice(None) for n in shape)
    p, *w = (rng.standard_normal(padded) for _ in range(4))
    out, expected = np.zeros(padded), np.zeros(padded)
    diagonal = np.zeros(padded)
    for axis in [axis for axis in range(3) if shape[axis] > 1]:
        for step, weight in ((1, w[axis]), (-1, np.roll(w[axis], -1, axis))):
            expected += weight * (p - np.roll(p, step, axis))
            diagonal += weight
    energy = apply_laplacian(out, p, (w[0], w[1], w[2], diagonal))
    np.testing.assert_allclose(out[cells], expected[cells], atol=1e-13)
    assert energy == pytest.approx(np.vdot(p[cells], expected[cells]))
