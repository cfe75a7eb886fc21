"""Case I12 without the sphere in a stream, which takes minutes."""

from __future__ import annotations

from flowborne_validation import small_domains as case


def test_I12_is_met() -> None:
    findings = case.in_a_sea(True)
    assert len(findings) == 4
    assert all(finding.passed for finding in findings)
