"""Cases A1 to A4, short."""

from __future__ import annotations

import numpy as np
import pytest

from flowborne_validation import articulated
from flowborne_validation.case import table
from flowborne_validation.cases import case


@pytest.mark.parametrize("degrees", [10.0, 90.0, 170.0])
def test_A1_period_at_amplitude(degrees: float) -> None:
    ratio = table("A1", "T/T0")[degrees]
    t0 = articulated.small_period(1.2, 0.3)
    model = articulated.bar(1.2, 0.3)
    errors = [
        abs(articulated.period(model, np.radians(degrees), t0 / n, 1.3 * ratio * t0) / t0 - ratio)
        for n in (40, 80)
    ]
    assert errors[1] < 1e-3 * ratio
    assert np.log2(errors[0] / errors[1]) == pytest.approx(2.0, abs=0.2)


@pytest.mark.parametrize(("number", "expected"), [(0, 0.765367), (1, 1.847759)])
def test_A2_modes(number: int, expected: float) -> None:
    assert articulated.mode(number, 100) == pytest.approx(expected, rel=1e-3)


def test_A2_energy_and_joints() -> None:
    drift, apart = articulated.swings(100, 10.0)
    assert abs(drift) < 1e-4
    assert apart < 1e-12


def test_A2_gravity_turns_the_angular_momentum() -> None:
    assert articulated.turning(0.005, 0.5) < 1e-5


def test_A3_static_chain() -> None:
    for result in case("A3").run(quick=True):
        assert result.verdict == "pass", f"{result.quantity}: {result.value}"


def test_A4_cat_turns_by_the_geometry_of_its_loop() -> None:
    exact = articulated.cat_turn_by_geometry()
    turns = [articulated.cat_turn(n, 1.0) for n in (50, 100, 200)]
    errors = np.abs(np.array(turns) - exact)
    order = -np.polyfit(np.log([50, 100, 200]), np.log(errors), 1)[0]
    assert order == pytest.approx(2.0, abs=0.2), f"turns {turns}, exact {exact}"
    assert articulated.cat_turn(200, 7.0) == pytest.approx(turns[-1], abs=1e-12)


@pytest.mark.parametrize("flat", [True, False])
def test_A4_free_chain_keeps_its_momentum(flat: bool) -> None:
    linear, angular = articulated.kept(flat, 0.01, 0.3)
    assert linear < 1e-10
    assert angular < 1e-10
