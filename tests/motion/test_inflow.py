"""What enters through an inflow side."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from flowborne.fluid.grid import Grid
from flowborne.motion.inflow import (
    Bands,
    DyeBandsValue,
    FactorKeyframes,
    FactorRamp,
    FactorSteady,
    InflowProfile,
    even_bands,
)
from flowborne.motion.tracks import Curve

NODES, WEIGHTS = np.polynomial.legendre.leggauss(3)


@given(st.floats(-3.0, 3.0), st.floats(0.1, 5.0), st.floats(-4.0, 4.0))
def test_parabola_has_the_mean_velocity_that_was_given(
    low: float, width: float, mean: float
) -> None:
    profile = InflowProfile((mean, 0.0, 0.0), FactorSteady(), ((1, low, low + width),))
    y = low + 0.5 * width * (1.0 + NODES)
    u, v, w = profile(np.zeros(3), y, np.zeros(3), 0.0)
    assert 0.5 * (WEIGHTS @ u) == pytest.approx(mean, abs=1e-12)
    assert not v.any()
    assert not w.any()


def test_parabola_in_three_dimensions_keeps_the_mean_and_vanishes_at_the_edges() -> None:
    profile = InflowProfile((0.0, 2.0, 0.0), FactorSteady(), ((0, 0.0, 1.0), (2, -1.0, 3.0)))
    x = 0.5 + 0.5 * NODES[:, None]
    z = 1.0 + 2.0 * NODES[None, :]
    _, v, _ = profile(x, np.zeros((1, 1)), z, 0.0)
    assert 0.25 * (WEIGHTS @ v @ WEIGHTS) == pytest.approx(2.0, abs=1e-12)
    _, edge, _ = profile(np.array([0.0, 1.0]), np.zeros(2), np.array([0.0, 1.0]), 0.0)
    assert_allclose(edge, 0.0, atol=1e-14)


def test_parabola_on_a_grid_has_its_mean_to_second_order() -> None:
    errors = []
    for n in (8, 16, 32):
        grid = Grid.slab(n, n, 1.0 / n, (0.0, 0.0))
        profile = InflowProfile((1.0, 0.0, 0.0), FactorSteady(), ((1, 0.0, 1.0),))
        _, y, _ = grid.face_coordinates(0)
        errors.append(profile(np.zeros(n), y, np.zeros(n), 0.0)[0].mean() - 1.0)
    assert_allclose(errors, [0.5 / n**2 for n in (8, 16, 32)], rtol=1e-9)


def test_ramp_rises_smoothly_from_rest() -> None:
    ramp = FactorRamp(2.0)
    assert [ramp.at(t) for t in (-1.0, 0.0, 1.0, 2.0, 5.0)] == pytest.approx([0, 0, 0.5, 1, 1])
    assert ramp.at(1e-4) < 1e-7
    profile = InflowProfile((2.0, 1.0, 0.0), ramp)
    u, v, _ = profile(np.zeros((1, 4)), np.zeros((1, 4)), np.zeros((1, 4)), 1.0)
    assert u.shape == (1, 4)
    assert_allclose(u, 1.0)
    assert_allclose(v, 0.5)


def test_keyframed_inflow_follows_its_factors() -> None:
    factor = FactorKeyframes(Curve((0.0, 1.0, 2.0), (0.0, 1.0, -0.5)))
    assert [factor.at(t) for t in (0.0, 1.0, 2.0, 3.0)] == pytest.approx([0.0, 1.0, -0.5, -0.5])


def test_dye_enters_in_its_bands_and_in_its_time() -> None:
    first = Bands(1, ((0.0, 0.2), (0.6, 0.8)), 1.0, (0.0, np.inf))
    second = Bands(1, ((0.1, 0.3),), 2.0, (1.0, 2.0))
    dye = DyeBandsValue((first, second))
    y = np.array([0.05, 0.15, 0.25, 0.5, 0.7])
    zero = np.zeros(5)
    assert_allclose(dye(zero, y, zero, 0.0), [1, 1, 0, 0, 1])
    assert_allclose(dye(zero, y, zero, 1.0), [1, 2, 2, 0, 1])
    assert_allclose(dye(zero, y, zero, 2.0), [1, 1, 0, 0, 1])


def test_even_bands_are_even() -> None:
    bands = even_bands(-1.0, 1.0, 4, 0.1)
    centres = [0.5 * (low + high) for low, high in bands]
    assert_allclose(centres, [-0.75, -0.25, 0.25, 0.75], atol=1e-15)
    assert_allclose([high - low for low, high in bands], 0.1)
