"""Case K7 without its timing."""

from __future__ import annotations

from flowborne_validation import gradients
from flowborne_validation.cases import case
from flowborne_validation.findings import Figures, over


def all_pass(found: Figures) -> None:
    for result in case("K7").judge(found):
        assert result.verdict == "pass", f"{result.quantity}: {result.value}"


def test_K7_order_of_the_differences() -> None:
    all_pass(over((0.25, 0.5, 1.0, 2.0), gradients.difference_error))
    all_pass(gradients.bias_at_optimum())


def test_K7_trials_and_drives_reach_the_place_asked_for() -> None:
    all_pass(gradients.exact_position(2))
