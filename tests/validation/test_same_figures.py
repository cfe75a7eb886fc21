"""What a fresh report may not do without the committed one: two made-up reports."""

from __future__ import annotations

from typing import Any

from flowborne_validation.case import Tier
from flowborne_validation.report import Case, Data
from same_figures import differences


def finding(quantity: str, value: float | str, verdict: str = "pass", **other: Any) -> Case:
    return {"quantity": quantity, "value": value, "reference": 1.0, "verdict": verdict, **other}


def report(*findings: Case, tier: str = "minute") -> Data:
    return {"B1": {tier: {"findings": list(findings)}}}


def test_figures_within_a_hundredth_are_the_same() -> None:
    kept = report(finding("drag", 5.6), finding("place", "far"))
    assert not differences(report(finding("drag", 5.65), finding("place", "far")), kept)
    assert differences(report(finding("drag", 5.66), finding("place", "near")), kept) == [
        "B1: drag: 5.66 (pass), committed 5.6 (pass)",
        "B1: place: near (pass), committed far (pass)",
    ]


def test_a_rounding_error_is_compared_with_the_error_that_is_accepted() -> None:
    zero = {"reference": 0.0, "tolerance": "1e-10"}
    kept = report(finding("slip", 1e-15, **zero))
    assert not differences(report(finding("slip", 9e-13, **zero)), kept)
    assert differences(report(finding("slip", 2e-12, **zero)), kept)
    falling = {"reference": 0.0, "tolerance": "falling from grid to grid"}
    assert differences(
        report(finding("error", 0.1, **falling)), report(finding("error", 0.11, **falling))
    )


def test_a_verdict_and_what_is_in_one_report_only_differ() -> None:
    kept = report(finding("drag", 5.6), finding("lift", 0.1))
    assert differences(report(finding("drag", 5.6, "fail"), finding("drop", 0.1)), kept) == [
        "B1: drag: 5.6 (fail), committed 5.6 (pass)",
        "B1: lift: in the committed report only",
        "B1: drop: in the fresh report only",
    ]
    assert len(differences({}, kept)) == 2
    assert not differences({}, report(finding("drag", 5.6), tier="all"))


def test_of_longer_tiers_a_verdict_alone_differs() -> None:
    kept = report(finding("drag", 5.6), finding("lift", 1.0), tier="half-hour")
    fresh = report(finding("drag", 6.6), finding("lift", 1.0, "fail"), tier="half-hour")
    assert not differences(fresh, kept)
    for tier in (Tier.HALF_HOUR, Tier.ALL):
        assert differences(fresh, kept, tier) == ["B1: lift: 1.0 (fail), committed 1.0 (pass)"]
