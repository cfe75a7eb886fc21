"""Case S5, short; S1: the eel's outline and midline, and its first beat on a coarse grid."""

from __future__ import annotations

import numpy as np
import pytest

from flowborne_validation import swimmers
from flowborne_validation.swimmers import LINKS, direction, half_width, swim, tank


def test_S5_what_the_creature_gains_the_fluid_loses() -> None:
    change, exchange = swimmers.momentum_kept(32, 50)
    assert exchange < 1e-10
    assert change < 1e-8


def test_S5_a_scallop_repeats_its_own_drift_in_its_first_cycle() -> None:
    """Mean of five grids; the source asks for 0.001."""
    drifts = [swimmers.scallop(n, n, 1) for n in (44, 48, 52, 56, 60)]
    assert np.mean(drifts) == pytest.approx(0.00283, rel=0.02)


def test_S1_outline_and_weight():
    edges = (0.0, 0.04, 0.95, 1.0)
    assert [half_width(s) for s in edges] == pytest.approx([0.0, 0.04, 0.01, 0.0])
    s = np.linspace(0.0, 1.0, 10_001)
    area = 2.0 * np.trapezoid([half_width(x) for x in s], s)
    assert tank(16).setup.solid.body_mass.sum() == pytest.approx(area, rel=0.02)


@pytest.mark.parametrize("time", [0.3, 0.7, 2.4])
def test_S1_hinges_turn_at_the_rate_of_their_angles(time):
    step = 1e-5
    for bend in tank(16).setup.motions:
        slope = (bend.position(time + step) - bend.position(time - step)) / (2.0 * step)
        np.testing.assert_allclose(bend.velocity(time), slope, atol=1e-7)
    assert len(tank(16).setup.motions) == LINKS - 1


def test_S1_the_midline_is_the_integral_of_its_direction():
    """After the first second y = 0.125 (s + 0.03125) / 1.03125 sin 2 pi (s - t)."""
    s = np.linspace(0.0, 1.0, 2001)
    slopes = np.tan([direction(x, 1.3)[0] for x in s])
    y = 0.125 * (s + 0.03125) / 1.03125 * np.sin(2.0 * np.pi * (s - 1.3))
    assert np.trapezoid(slopes, s) == pytest.approx(y[-1] - y[0], abs=1e-6)


def test_S1_repeats_its_own_way_in_the_first_beat_on_20_cells():
    path = swim(20, 1)
    assert path[-1, 1] - path[0, 1] == pytest.approx(0.0779, rel=0.02)
