"""Case I10, on coarse grids."""

from __future__ import annotations

from flowborne.validation import far_sides as case


def test_I10_is_met_but_in_boxes_twice_as_long_as_wide() -> None:
    findings = case.between_far_sides(True)
    failed = {finding.quantity: float(finding.value) for finding in findings if not finding.passed}
    assert len(findings) == 11
    assert all("4 x 2 radii" in quantity for quantity in failed)
    assert len(failed) == 2
    assert all(abs(value - 1.0) < 0.08 for value in failed.values())
