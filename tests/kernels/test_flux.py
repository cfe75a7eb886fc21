"""What flows out of control volumes, against NumPy."""

from __future__ import annotations

import numpy as np
import pytest

from flowborne.kernels.flux import (
    CLEAR,
    CUT,
    GHOSTS,
    UPSTREAM,
    advance,
    advance_reference,
    net_flux,
    net_flux_reference,
)

SHAPES = [(5, 7, 6), (1, 9, 8), (3, 4, 5)]


def padded(shape: tuple[int, int, int]) -> tuple[int, ...]:
    return tuple(n + 2 * GHOSTS * (n > 1) for n in shape)


def fluxes(shape: tuple[int, int, int], random: np.random.Generator) -> list[np.ndarray]:
    """Random through all sides; none across the first of a slab."""
    sizes = [tuple(n + (axis == d) for d, n in enumerate(shape)) for axis in range(3)]
    return [random.standard_normal(size) * (shape[d] > 1) for d, size in enumerate(sizes)]


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("marked", [(CLEAR,), (CUT,), (CUT, CLEAR, CLEAR, CLEAR, UPSTREAM)])
def test_net_flux(shape: tuple[int, int, int], marked: tuple[int, ...]) -> None:
    random = np.random.default_rng(1)
    field = random.standard_normal(padded(shape))
    marks = random.choice(np.array(marked, np.uint8), padded(shape))
    through, out = fluxes(shape, random), np.full(shape, np.nan)
    net_flux(out, field, marks, *through)
    np.testing.assert_allclose(out, net_flux_reference(field, marks, *through), atol=1e-13)


@pytest.mark.parametrize("shape", SHAPES)
def test_a_uniform_field_leaves_with_the_volume(shape: tuple[int, int, int]) -> None:
    random = np.random.default_rng(2)
    marks = random.integers(0, 3, padded(shape)).astype(np.uint8)
    through, out = fluxes(shape, random), np.empty(shape)
    net_flux(out, np.full(padded(shape), 0.7), marks, *through)
    volume = sum(np.diff(g, axis=axis) for axis, g in enumerate(through))
    np.testing.assert_allclose(out, 0.7 * volume, atol=1e-13)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_means_of_a_parabola_are_carried_exactly(sign: float) -> None:
    """Third order: where nothing limits it, the value at a side is that of the parabola."""
    shape, edges = (1, 4, 12), np.arange(-2.0, 15.0)
    whole = 1.3 + 4.0 * edges + 0.2 * edges**3 / 3.0
    field = np.broadcast_to(np.diff(whole), padded(shape)).copy()
    out, through = np.empty(shape), [np.zeros((2, 4, 12)), np.zeros((1, 5, 12))]
    through.append(np.full((1, 4, 13), sign))
    net_flux(out, field, np.full(padded(shape), CLEAR, np.uint8), *through)
    value = 4.0 + 0.2 * edges[2:-2] ** 2
    np.testing.assert_allclose(out[0, 1], sign * np.diff(value), atol=1e-12)


def test_a_value_between_two_never_leaves_them_at_a_jump() -> None:
    """A step of the field carried along stays within its two values."""
    shape, through = (1, 1, 20), [np.zeros((2, 1, 20)), np.zeros((1, 2, 20)), np.ones((1, 1, 21))]
    marks = np.full((1, 5, 24), CLEAR, np.uint8)
    field = np.tile((np.arange(24) > 11).astype(float), (1, 5, 1))
    out = np.empty(shape)
    net_flux(out, np.ascontiguousarray(field), marks[:, :, :], *through)
    assert out.sum() == pytest.approx(1.0)
    assert out.min() > -1e-14


@pytest.mark.parametrize("shape", SHAPES)
def test_advance(shape: tuple[int, int, int]) -> None:
    """Some volumes hold nothing afterwards, and what is left of their amount is given."""
    field, before, after, net, out = np.random.default_rng(3).standard_normal((5, *shape))
    after[after < 0.3] = 0.0
    advance(out, field, before, net, 0.3, after, 1e-9)
    expected = advance_reference(field, before, net, 0.3, after, 1e-9)
    np.testing.assert_allclose(out, expected, rtol=1e-14)
    left = (before * field - 0.3 * net)[after == 0.0]
    np.testing.assert_allclose(out[after == 0.0], left, atol=1e-15)
