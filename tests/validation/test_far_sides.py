"""Case I10, on coarse grids."""

from __future__ import annotations

from flowborne_validation import far_sides as case


def test_I10_is_met() -> None:
    findings = case.between_far_sides(True)
    assert len(findings) == 11
    assert all(finding.passed for finding in findings)
