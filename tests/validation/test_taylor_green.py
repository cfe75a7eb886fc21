"""F3, its first second."""

from __future__ import annotations

import numpy as np
import pytest

from flowborne.validation.taylor_green import DISSIPATION, ENERGY, decay


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
