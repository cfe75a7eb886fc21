"""S3, the first quarter of its stroke."""

from __future__ import annotations

import numpy as np
import pytest

from flowborne_validation.case import reference
from flowborne_validation.flapping_ellipse import (
    FASTEST,
    LIFT,
    apart,
    flap,
    hover,
    largest_quasi_steady,
)


def test_S3_starts_upright_at_the_end_of_its_way():
    assert hover(10, 6).solid.q == pytest.approx([1.4, 0.5 * np.pi])


def test_S3_the_largest_quasi_steady_forces_are_those_in_the_middle_of_a_stroke():
    pressure = 0.5 * FASTEST**2
    assert largest_quasi_steady() == pytest.approx((1.2 * pressure, 1.4 * pressure), rel=1e-6)


def test_S3_repeats_its_own_lift_in_the_first_quarter_on_ten_cells():
    run = flap(10, 6, 0.25)
    published = np.array(reference("S3", LIFT))
    assert apart(run[:, 0], run[:, 1], published[published[:, 0] < 0.25]) == pytest.approx(
        0.1417, rel=0.01
    )
    assert (run[:, 2] > 0.0).all()
