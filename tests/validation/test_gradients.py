"""Case K7 without its timing."""

from __future__ import annotations

from flowborne_validation import gradients


def test_K7_order_of_the_differences() -> None:
    for finding in gradients.difference_error(True):
        assert finding.passed, f"{finding.quantity}: {finding.value}"


def test_K7_trials_and_drives_reach_the_place_asked_for() -> None:
    for finding in gradients.exact_position(True):
        assert finding.passed, f"{finding.quantity}: {finding.value}"
