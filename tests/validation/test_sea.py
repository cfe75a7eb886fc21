"""Cases B8 and I11, on coarse grids."""

from __future__ import annotations

from functools import partial

import pytest

from flowborne_validation import sea as case
from flowborne_validation.case import reference
from flowborne_validation.shedding import shed


def test_B8_falls_short_of_the_published_drag_by_less_than_a_tenth_on_8_cells() -> None:
    """In the first of its places."""
    build = partial(case.in_stream, length=12, width=8)
    (drag, lift, strouhal), _ = shed(build, 0.165, (8,), 2, once=(8,))
    assert drag[0] == pytest.approx([reference("B5", "Cd mean")], rel=0.08)
    assert lift[0] == pytest.approx([0.267], abs=0.005)
    assert strouhal[0] == pytest.approx([reference("B5", "St")], rel=0.02)


def test_I11_a_towed_cylinder_has_a_twentieth_more_drag_than_a_held_one_on_8_cells() -> None:
    (found,) = case.towed_over_held(8).values()
    assert found == pytest.approx(1.053, abs=0.005)
