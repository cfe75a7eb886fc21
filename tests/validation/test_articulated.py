"""Cases A3 and A4, short."""

from __future__ import annotations

import numpy as np
import pytest

from flowborne.validation import articulated


def test_A3_static_chain() -> None:
    for finding in articulated.static_chain(True):
        assert finding.passed, f"{finding.quantity}: {finding.value}"


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
