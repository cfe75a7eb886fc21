"""Cases D1, D4 and D5, short."""

from __future__ import annotations

import numpy as np
import pytest

from flowborne.validation import flesh as case
from flowborne.validation.flesh_bars import quadratic_bar, tetrahedral_bar


def test_D1_quadratic_cells_come_near_and_nearer() -> None:
    findings = case.flags(True)
    for finding in findings[:4]:
        assert finding.series is not None
        assert finding.series.falls
        assert abs(float(finding.value) / float(finding.reference) - 1.0) < 0.04


def test_D1_linear_tetrahedra_are_too_stiff() -> None:
    """They lock: at 70 cells along the bar, four across, a quarter of the sinking is missing."""
    for finding in case.flags(True)[4:]:
        assert finding.series is not None
        assert finding.series.falls
        assert abs(float(finding.value)) < 0.8 * abs(float(finding.reference))


def test_D4_large_deflections() -> None:
    for finding in case.elastica(True):
        assert finding.passed, f"{finding.quantity}: {finding.value}"


def test_D5_vibrations() -> None:
    for finding in case.vibration(True):
        assert finding.passed, f"{finding.quantity}: {finding.value}"


def test_D5_frequency_of_the_centred_step_is_that_of_average_acceleration() -> None:
    """tan(omega' dt / 2) = omega dt / 2, Newmark's beta = 1/4."""
    order, ratio, _ = case.in_time((20, 40), 2)
    assert order.series is not None
    exact = float(order.series.values[-1]) / float(ratio.value)
    for steps, found in zip((20, 40), order.series.values, strict=True):
        turn = 2.0 * np.pi / steps
        expected = exact * 2.0 * np.arctan(0.5 * turn) / turn
        assert found == pytest.approx(expected, rel=3e-4)


def test_D5_tetrahedra_and_quadratic_cells_agree_where_nothing_locks() -> None:
    """A short, thick bar without Poisson's ratio."""
    size, tissue = (1.0, 0.5), case.Tissue(1e5, 0.0, 1000.0)
    cells = quadratic_bar((8, 4), size, tissue, case.NOWHERE)
    found = [
        float(case.modes(bar, 1)[0][0])
        for bar in (
            cells,
            tetrahedral_bar((16, 8), size, tissue, case.NOWHERE, np.zeros_like),
            tetrahedral_bar((32, 16), size, tissue, case.NOWHERE, np.zeros_like),
        )
    ]
    assert found[1] > found[2] > found[0]
    assert found[2] == pytest.approx(found[0], rel=0.02)
