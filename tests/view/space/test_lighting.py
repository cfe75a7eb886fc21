"""Light that reaches smoke, and leaves it."""

from __future__ import annotations

import numpy as np
import pytest

from flowborne.view.space.lighting import AMBIENT, optical_depth, phase, scattered


@pytest.mark.parametrize("axis", [0, 1, 2])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_light_along_an_axis_meets_what_is_before_a_cell(axis: int, sign: float) -> None:
    cells = np.random.default_rng(2).random((5, 6, 7)).astype(np.float32)
    travel = np.zeros(3)
    travel[axis] = sign
    ordered = np.moveaxis(cells, axis, 0)[:: int(sign)]
    expected = np.cumsum(ordered, axis=0) - 0.5 * ordered
    found = np.moveaxis(optical_depth(cells, travel), axis, 0)[:: int(sign)]
    np.testing.assert_allclose(found, expected, rtol=1e-5)


def test_slanting_light_meets_even_smoke_over_the_length_of_its_way() -> None:
    """Under a flat roof of smoke the depth is that below it over the cosine of the slant."""
    cells = np.full((40, 40, 10), 0.1, np.float32)
    travel = np.array([0.3, -0.4, -1.0])
    travel /= np.linalg.norm(travel)
    depth = optical_depth(cells, travel)[20, 20]
    below = 0.1 * (np.arange(10)[::-1] + 0.5)
    np.testing.assert_allclose(depth, below / abs(travel[2]), rtol=1e-4)


def test_a_shadow_falls_along_the_light() -> None:
    cells = np.zeros((20, 20, 20), np.float32)
    cells[10, 10, 15] = 1.0
    travel = np.array([0.5, 0.0, -1.0]) / np.linalg.norm([0.5, 0.0, -1.0])
    depth = optical_depth(cells, travel)
    for below in (2, 5, 8):
        layer = depth[:, :, 15 - below]
        x, y = np.indices(layer.shape)
        middle = [(c * layer).sum() / layer.sum() for c in (x, y)]
        assert middle == pytest.approx([10.0 + 0.5 * below, 10.0], abs=1e-4)


def test_phase_is_one_in_the_mean_over_all_directions() -> None:
    cosine = np.linspace(-1.0, 1.0, 20001)
    values = [phase(c, 0.35) for c in cosine]
    assert np.trapezoid(values, cosine) / 2.0 == pytest.approx(1.0, rel=1e-6)
    assert phase(1.0, 0.35) > 2.0 > 1.0 > phase(-1.0, 0.35)


def test_bodies_and_smoke_keep_light_away() -> None:
    smoke = np.full((12, 12, 12), 0.3, np.float32)
    toward = np.array([0.5, -0.8, 0.3]) / np.linalg.norm([0.5, -0.8, 0.3])
    light = scattered(smoke, np.zeros_like(smoke), toward)
    assert light.min() > AMBIENT
    assert light[6, 6, 11].sum() > 1.3 * light[6, 6, 6].sum(), "the middle is darker than the top"
    roof = np.zeros_like(smoke)
    roof[:, :, 10] = 1.0
    shaded = scattered(smoke, roof, toward)
    assert shaded[6, 6, 6].sum() < 0.8 * light[6, 6, 6].sum()
