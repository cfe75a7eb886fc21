"""The validation's report: data and page, case by case."""

from __future__ import annotations

import json
from pathlib import Path
from xml.etree import ElementTree

import pytest
from typer.testing import CliRunner

from flowborne.cli import app
from flowborne.validation import case_ids, run_cases
from flowborne.validation.case import GridSeries, Result
from flowborne.validation.report import DATA, PAGE, add_to_report, failures, read_report

SERIES = GridSeries("cells across D", (8, 16, 32), (1.2, 1.05, 1.01), (0.2, 0.05, 0.01))


def result(name: str, verdict: str, series: GridSeries | None = None) -> Result:
    """A result that was not measured."""
    lines = [] if series else ["<all the way>"]
    return Result(name, "", "drag & lift", 1.01, 1.0, "2 %", verdict, lines, 3.0, series)


def test_cases_come_one_by_one_in_the_order_of_the_list(tmp_path: Path) -> None:
    add_to_report(tmp_path, [result("B2", "fail")], True, case_ids())
    add_to_report(tmp_path, [result("B1", "pass", SERIES)], False, case_ids())
    data = read_report(tmp_path)
    assert list(data) == ["B1", "B2"]
    assert data["B1"]["full"]["findings"][0]["series"]["cells"] == [8.0, 16.0, 32.0]
    assert [(name, tier) for name, tier, _ in failures(data)] == [("B2", "quick")]


def test_a_full_run_counts_before_a_quick_one_and_a_newer_one_before_an_older(
    tmp_path: Path,
) -> None:
    for verdict, quick in (("fail", False), ("pass", False), ("fail", True)):
        add_to_report(tmp_path, [result("B2", verdict)], quick, case_ids())
    assert not failures(read_report(tmp_path))


def test_the_page_is_sound_and_says_everything(tmp_path: Path) -> None:
    add_to_report(tmp_path, [result("B2", "fail")], True, case_ids())
    add_to_report(tmp_path, [result("B1", "pass", SERIES)], False, case_ids())
    text = (tmp_path / PAGE).read_text()
    assert "2 cases with 2 figures: 1 pass, 1 fail" in text
    assert "drag &amp; lift" in text
    assert "&lt;all the way&gt;" in text
    drawn = ElementTree.fromstring(text[text.index("<svg") : text.index("</svg>") + 6])
    assert drawn.tag.endswith("svg")
    again = tmp_path / "again"
    add_to_report(again, [result("B1", "pass", SERIES)], False, case_ids())
    add_to_report(again, [result("B2", "fail")], True, case_ids())
    assert (again / PAGE).read_text() == text


def test_a_case_that_is_run_is_in_the_report(tmp_path: Path) -> None:
    found = run_cases(["K1"], True, report=tmp_path)
    case = read_report(tmp_path)["K1"]["quick"]
    assert [f["quantity"] for f in case["findings"]] == [r.quantity for r in found]


def test_a_folder_with_another_report_is_left_alone(tmp_path: Path) -> None:
    (tmp_path / DATA).write_text(json.dumps([1, 2]))
    asked = CliRunner().invoke(
        app, ["validate", "--case", "K1", "--quick", "--report", str(tmp_path)]
    )
    assert asked.exit_code != 0
    assert json.loads((tmp_path / DATA).read_text()) == [1, 2]
    with pytest.raises(ValueError, match="is no report"):
        read_report(tmp_path)
