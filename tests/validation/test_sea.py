"""Cases B8 and I11, on coarse grids."""

from __future__ import annotations

import pytest

from flowborne.validation import sea as case
from flowborne.validation.case import reference


def test_B8_falls_short_of_the_published_drag_by_less_than_a_tenth_on_8_cells() -> None:
    drag, lift, strouhal = case.cylinder_in_sea(True)
    assert float(drag.value) == pytest.approx(reference("B5", "Cd mean"), rel=0.08)
    assert float(lift.value) == pytest.approx(0.269, abs=0.005)
    assert strouhal.passed


def test_I11_a_towed_cylinder_has_a_tenth_more_drag_than_a_held_one_on_8_cells() -> None:
    assert float(case.towed_over_held(True).value) == pytest.approx(1.103, abs=0.005)
