"""Case S5, short."""

from __future__ import annotations

from flowborne.validation import swimmers


def test_S5_what_the_creature_gains_the_fluid_loses() -> None:
    change, exchange = swimmers.momentum_kept(32, 50)
    assert exchange < 1e-10
    assert change < 1e-8


def test_S5_a_scallop_hardly_moves() -> None:
    """On a coarse grid; the case itself goes to finer ones and asks for 1e-3."""
    assert swimmers.scallop(48, 48, 1) < 0.02
