"""F1, F3, F6, F7: flows without obstacles, on coarse grids; of F3 the first second."""

from __future__ import annotations

import numpy as np
import pytest

from flowborne_validation.cases import case
from flowborne_validation.fluid_cases import DISSIPATION, ENERGY, carried_body, decay


@pytest.fixture(scope="module")
def found():
    return {name: case(name).run(quick=True) for name in ("F1", "F7")}


@pytest.mark.parametrize("name", ["F1", "F7"])
def test_order_is_two(found, name):
    for result in found[name]:
        assert result.verdict == "pass", (result.quantity, result.lines)
        assert result.series.falls, (result.quantity, result.lines)


def test_F1_decays_and_never_gains(found):
    """Without viscosity every change of the energy is a numerical loss."""
    for result in found["F1"]:
        assert max(result.series.values) <= 1.0, result.lines
        assert result.series.errors[-1] < 2e-3, result.lines


def test_F7_error_on_the_finest_grid(found):
    assert found["F7"][0].series.errors[-1] < 2e-3


def test_F6_a_body_that_goes_with_the_stream_leaves_no_trace():
    for result in case("F6").run(quick=True):
        assert result.verdict == "pass", (result.quantity, result.value)


def test_F6_a_slower_body_leaves_one():
    """The fluid sees the body, so the case can fail."""
    wrong, slip = carried_body(True, 2, pace=0.9)
    assert 1e-2 < wrong < 1.0
    assert slip == pytest.approx(0.1)


def test_F3_begins_with_its_energy_and_its_dissipation():
    """On 24 cells a side the scheme dissipates, too: half as much on 32."""
    energies, times, rates = decay(24, 1.0)
    _, _, finer = decay(32, 0.25)
    assert energies[0] == pytest.approx(ENERGY, rel=1e-12)
    assert np.all(np.diff(energies) < 0.0)
    assert pytest.approx(4.6875e-4) == DISSIPATION
    assert DISSIPATION < rates[0] < 1.5 * DISSIPATION
    assert finer[0] - DISSIPATION < 0.5 * (rates[0] - DISSIPATION)
    assert energies[1] - energies[-1] == pytest.approx(rates.sum() * (times[1] - times[0]))
