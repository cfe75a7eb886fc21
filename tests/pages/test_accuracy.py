"""The short page on accuracy and speed, and the pages of families, say what the report has."""

from __future__ import annotations

import json

import pytest

import accuracy
import tolerances
from committed import REPORT, ROOT
from flowborne.scenes.load import scene_names
from flowborne_validation.report import failures, read_report, tier_of

DATA = read_report(REPORT)
FINDINGS = [f for tiers in DATA.values() for f in tiers[tier_of(tiers)]["findings"]]


def test_every_case_is_on_the_page_of_one_family() -> None:
    for page in tolerances.FAMILIES:
        text = (ROOT / "docs" / f"validation-{page}.md").read_text(encoding="utf-8")
        assert f"<!-- made by validation_table.family {page} -->" in text
    found = [name for page in tolerances.FAMILIES for name in tolerances.of_family(DATA, page)]
    assert sorted(found) == sorted(DATA)


@pytest.mark.parametrize(
    ("value", "reference", "words", "part"),
    [
        (1.01, 1.0, "2 %", 0.5),
        (1.01, 1.0, "2 %, falling from grid to grid", 0.5),
        (1.0, 1.119, "5 % of 1.119", 0.119 / (0.05 * 1.119)),
        (5.58, 5.575, "[5.57, 5.59], falling from grid to grid", 1.0 / 3.0),
        (5.57, 5.575, "[5.57, 5.59]", 1.0),
        (2e-5, 2.2e-5, "2.1e-05 to 2.3e-05", 2.0),
        (1.85, 2.0, ">= 1.9", 1.5),
        (3.0, 2.0, ">= 1.9", 0.0),
        (-3e-11, 0.0, "1e-10", 0.3),
        (3.0, 2.0, "at most", 1.5),
        (3.0, "> 0", "sign", None),
        ("it broke down", "ends", "", None),
    ],
)
def test_the_used_part_of_a_tolerance(
    value: float | str, reference: float | str, words: str, part: float | None
) -> None:
    found = tolerances.used({"value": value, "reference": reference, "tolerance": words})
    assert found == (None if part is None else pytest.approx(part))


def test_dots_lie_on_the_side_of_the_line_that_their_verdict_says() -> None:
    for finding in FINDINGS:
        part = tolerances.used(finding)
        if part is not None and finding["verdict"] == "pass":
            assert part <= 1.0 + 1e-9, finding["quantity"]
        elif part is not None and finding["verdict"] == "fail":
            assert part > 1.0 or "falling" in finding["tolerance"], finding["quantity"]


def test_most_figures_have_a_dot() -> None:
    judged = [finding for finding in FINDINGS if finding["verdict"] in tolerances.LOOKS]
    assert sum(map(len, tolerances.dots(DATA).values())) > 0.9 * len(judged)


def test_figures_that_hold_pass_and_too_few_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    assert accuracy.held().count("\n| [") == accuracy.FEW
    monkeypatch.setattr(accuracy, "FEW", len(accuracy.HELD) + 1)
    with pytest.raises(ValueError, match="figures of HELD pass"):
        accuracy.held()


def test_a_figure_that_the_report_has_no_longer_is_refused() -> None:
    with pytest.raises(ValueError, match="case B1 of the report has no quantity 'cQ'"):
        accuracy.finding_of(DATA, "B1", "cQ")


def test_every_case_that_fails_is_named_once() -> None:
    items = accuracy.failing().splitlines()
    assert len(items) == len({name for name, _, _ in failures(DATA)})
    assert all(item.count("**") == 2 for item in items)


def test_scenes_that_were_measured_are_those_of_the_page() -> None:
    found = json.loads(accuracy.SPEED.read_text(encoding="utf-8"))["scenes"]
    assert list(found) == list(accuracy.SCENES)
    assert set(found) <= set(scene_names())
