"""The validation's report: data and page, case by case."""

from __future__ import annotations

import json
from pathlib import Path
from xml.etree import ElementTree

import pytest
from typer.testing import CliRunner

from flowborne.cli.main import app
from flowborne_validation import report
from flowborne_validation.case import THE_RUN, Result, Tier
from flowborne_validation.cases import case, case_ids
from flowborne_validation.findings import Curve, GridSeries, Plot, Verdict
from flowborne_validation.page import PAGE, write_page
from flowborne_validation.report import (
    DATA,
    add_to_report,
    already_there,
    failures,
    of_other_code,
    read_report,
    verdict_of,
    verdicts,
)

MINUTE, HALF_HOUR, ALL = Tier

SERIES = GridSeries(
    "cells across D", (8, 16, 32), (1.2, 1.05, 1.01), (0.2, 0.05, 0.01), ((1.1, 1.3),) * 3
)

PLOT = Plot(
    "t (s)",
    "force (N)",
    (Curve("<book>", (0.0, 1.0), (2.0, 3.0), True), Curve("ours", (0, 1), (2, 4))),
)


def result(
    name: str,
    verdict: Verdict,
    series: GridSeries | None = None,
    tier: Tier = MINUTE,
    quantity: str = "drag & lift",
) -> Result:
    """A result that was not measured."""
    lines = [] if series else ["<all the way>"]
    finest = tier is case(name).full
    judged = (1.01, 1.0, "2 %", verdict)
    return Result(name, tier, quantity, *judged, lines, 3.0, finest, series, PLOT)


def test_cases_come_one_by_one_in_the_order_of_the_list(tmp_path: Path) -> None:
    add_to_report(tmp_path, [result("B2", "fail")], case_ids())
    add_to_report(tmp_path, [result("B1", "pass", SERIES, ALL)], case_ids())
    data = read_report(tmp_path)
    assert list(data) == ["B1", "B2"]
    assert data["B1"]["all"]["findings"][0]["series"]["cells"] == [8.0, 16.0, 32.0]
    assert [(name, tier) for name, tier, _ in failures(data)] == [("B2", "minute")]


def test_a_larger_tier_counts_before_a_smaller_one_and_a_newer_run_before_an_older(
    tmp_path: Path,
) -> None:
    runs: tuple[tuple[Verdict, Tier], ...] = (("fail", ALL), ("pass", ALL), ("fail", HALF_HOUR))
    for verdict, tier in runs:
        add_to_report(tmp_path, [result("B2", verdict, tier=tier)], case_ids())
    assert not failures(read_report(tmp_path))


def test_a_figure_that_is_not_confirmed_neither_passes_nor_fails(tmp_path: Path) -> None:
    add_to_report(tmp_path, [result("B2", "unconfirmed"), result("B2", "pass")], case_ids())
    data = read_report(tmp_path)
    assert not failures(data)
    assert verdicts(data) == {"pass": 1, "coarse": 0, "fail": 0, "unconfirmed": 1}


def test_a_case_has_the_verdict_of_its_finest_grids(tmp_path: Path) -> None:
    add_to_report(tmp_path, [result("B2", "coarse", SERIES, HALF_HOUR)], case_ids())
    data = read_report(tmp_path)
    assert (verdict_of(data["B2"]), failures(data)) == ("coarse", [])
    figures = [result("B2", verdict, SERIES, ALL) for verdict in ("pass", "unconfirmed")]
    add_to_report(tmp_path, figures, case_ids())
    assert verdict_of(read_report(tmp_path)["B2"]) == "pass"
    add_to_report(tmp_path, [*figures, result("B2", "fail", SERIES, ALL)], case_ids())
    assert verdict_of(read_report(tmp_path)["B2"]) == "fail"


def test_the_page_is_sound_and_says_everything(tmp_path: Path) -> None:
    add_to_report(tmp_path, [result("B2", "fail")], case_ids())
    add_to_report(tmp_path, [result("B1", "pass", SERIES, ALL)], case_ids())
    write_page(tmp_path)
    text = (tmp_path / PAGE).read_text()
    assert "2 cases with 2 figures: 1 pass, 1 fail, 0 are outside" in text
    assert "<td>32 cells across D, mean of 2 places with a spread of 0.2</td>" in text
    assert "Tier all, its finest grids" in text
    assert "Tier minute, not its finest grids" in text
    assert "drag &amp; lift" in text
    assert "&lt;all the way&gt;" in text
    pictures = [part.split("</svg>")[0] for part in text.split("<svg")[1:]]
    drawn = [ElementTree.fromstring(f"<svg{picture}</svg>") for picture in pictures]
    said = [[element.text for element in picture.iter() if element.text] for picture in drawn]
    assert ["<book>" in words for words in said] == [True, False, True]
    assert "cells across D" in said[1]
    again = tmp_path / "again"
    add_to_report(again, [result("B1", "pass", SERIES, ALL)], case_ids())
    add_to_report(again, [result("B2", "fail")], case_ids())
    write_page(again)
    assert (again / PAGE).read_text() == text


def test_a_series_without_an_order_says_so() -> None:
    gained = GridSeries("cells", (8, 16), (0.1, -0.1), (0.1, -0.1))
    assert gained.lines()[-1] == "no observed order: an error is not positive"
    assert gained.as_dict()["order"] is None


def test_a_result_comes_back_as_it_was() -> None:
    first = result("B1", "pass", SERIES, ALL)
    assert Result.from_dict(first.as_dict()).as_dict() == first.as_dict()


def test_only_a_run_of_the_same_code_in_the_same_tier_is_there_already(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    add_to_report(tmp_path, [result("B1", "fail")], case_ids())
    add_to_report(tmp_path, [result("B2", "fail", quantity=THE_RUN)], case_ids())
    (kept,) = already_there(tmp_path, {"B1": MINUTE, "B2": MINUTE, "B5": MINUTE})["B1"]
    assert (kept.id, kept.verdict, kept.value) == ("B1", "fail", 1.01)
    assert "B2" not in already_there(tmp_path, {"B2": MINUTE})
    assert not already_there(tmp_path, {"B1": ALL})
    monkeypatch.setattr(report, "code", lambda: "another")
    assert not already_there(tmp_path, {"B1": MINUTE})


def test_cases_of_other_code_are_named_with_the_tiers_of_which_that_is_true(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    add_to_report(tmp_path, [result("B1", "pass")], case_ids())
    add_to_report(tmp_path, [result("B2", "pass", tier=ALL)], case_ids())
    assert not of_other_code(read_report(tmp_path))
    monkeypatch.setattr(report, "code", lambda: "another")
    add_to_report(tmp_path, [result("B1", "pass", tier=ALL)], case_ids())
    assert of_other_code(read_report(tmp_path)) == ["B1 (minute)", "B2"]


def test_a_folder_with_another_report_is_left_alone(tmp_path: Path) -> None:
    (tmp_path / DATA).write_text(json.dumps([1, 2]))
    asked = CliRunner().invoke(app, ["validate", "--case", "K1", "--report", str(tmp_path)])
    assert asked.exit_code != 0
    assert json.loads((tmp_path / DATA).read_text()) == [1, 2]
    assert not (tmp_path / PAGE).exists()
    with pytest.raises(ValueError, match="is no report"):
        read_report(tmp_path)


def test_the_drag_over_the_reynolds_number_is_drawn_from_all_cases_that_have_it(
    tmp_path: Path,
) -> None:
    add_to_report(tmp_path, [result("B4", "pass", quantity="Cd")], case_ids())
    write_page(tmp_path)
    assert "Drag over" not in (tmp_path / PAGE).read_text()
    add_to_report(tmp_path, [result("B6", "unconfirmed", quantity="Cd mean")], case_ids())
    write_page(tmp_path)
    text = (tmp_path / PAGE).read_text()
    drawn = text[text.index("<h2>Drag over") :]
    assert drawn.index("published, unconfirmed") < drawn.index("</svg>")
