"""F4: scalars carried by a given velocity, on coarse grids."""

import numpy as np
import pytest

from flowborne import Grid
from flowborne_validation.cases import case
from flowborne_validation.scalar_cases import Blob, Swirl, Turn, carried_back


@pytest.fixture(scope="module")
def found():
    return {result.quantity: result for result in case("F4").run(quick=True)}


def test_F4_orders_and_falling_errors(found):
    assert len(found) == 6
    for result in found.values():
        assert result.verdict == "pass", (result.quantity, result.lines)
        assert result.series.falls, (result.quantity, result.lines)


def test_F4_final_errors(found):
    largest = {
        "order of the flux form, blob after a turn": 0.03,
        "order of the flux form, blob in the swirl": 0.003,
        "order of semi-Lagrangian, blob after a turn": 0.075,
        "order of semi-Lagrangian, blob in the swirl": 0.065,
        "peak of the blob after a turn": 0.007,
        "error of Zalesak's disc / its area": 0.62,
    }
    for quantity, bound in largest.items():
        assert found[quantity].series.errors[-1] < bound, found[quantity].lines


@pytest.mark.parametrize(("flow", "blob"), [(Turn(0.5, 1.0), Blob(0.7, 0.1))])
def test_F4_flux_form_keeps_more_than_semi_lagrangian(flow, blob):
    peaks = []
    for flux_form in (True, False):
        grid = Grid.slab(48, 48, 1.0 / 48.0, (0.0, 0.0))
        before, after = carried_back(flow, blob, 1.0, grid, 2.0, flux_form)
        peaks.append(after.max() / before.max())
        assert after.sum() == pytest.approx(before.sum(), rel=0.02)
    assert peaks[0] > 0.85 > 0.5 > peaks[1]


def test_F4_velocities_are_free_of_divergence_and_turn_back():
    x, y = np.meshgrid(np.linspace(0.1, 0.9, 9), np.linspace(0.1, 0.9, 9))
    swirl, d = Swirl(8.0), 1e-5
    for time in (0.0, 1.3):
        du = swirl(x + d, y, time)[0] - swirl(x - d, y, time)[0]
        dv = swirl(x, y + d, time)[1] - swirl(x, y - d, time)[1]
        assert np.abs(du + dv).max() / (2.0 * d) < 1e-8
        there, back = swirl(x, y, time), swirl(x, y, 8.0 - time)
        np.testing.assert_allclose(there[0], -back[0], atol=1e-14)
        np.testing.assert_allclose(there[1], -back[1], atol=1e-14)
