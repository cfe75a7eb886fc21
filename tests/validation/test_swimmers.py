"""Case S5, short."""

from __future__ import annotations

from flowborne.validation import swimmers


def test_S5_what_the_creature_gains_the_fluid_loses() -> None:
    change, exchange = swimmers.momentum_kept(32, 50)
    assert exchange < 1e-10
    assert change < 1e-8


def test_S5_a_scallop_drifts_by_less_than_a_thousandth_in_its_first_cycle() -> None:
    """To the tolerance of the source; the case itself goes on to a second cycle and finer grids."""
    assert swimmers.scallop(48, 48, 1) < 1e-3
