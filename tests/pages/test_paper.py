"""The page of the paper's figures agrees with the committed validation report."""

from __future__ import annotations

import copy
from typing import Any

import pytest

import paper
from flowborne_validation.report import read_report, tier_of

DATA = read_report(paper.REPORT)


def test_the_page_has_the_figures_of_the_committed_report() -> None:
    text = paper.PAGE.read_text(encoding="utf-8")
    assert text == paper.with_section(text), "docs/paper.md is out of date: run `make paper`"


def test_a_figure_of_another_report_is_noticed(monkeypatch: pytest.MonkeyPatch) -> None:
    data: dict[str, Any] = copy.deepcopy(DATA)
    data["K5"][tier_of(data["K5"])]["findings"][0]["value"] = 12.5
    monkeypatch.setattr(paper, "read_report", lambda folder: data)
    text = paper.PAGE.read_text(encoding="utf-8")
    assert text != paper.with_section(text)


def test_a_quantity_that_the_report_has_no_longer_is_refused() -> None:
    with pytest.raises(ValueError, match="case K5 of the report has no quantity 'lift"):
        paper.found(DATA, "K5", ("lift",))


def test_a_figure_names_its_finest_grid() -> None:
    shown = paper.found(DATA, "K5", ("ns-block-drag-max: final angle to the stream",))
    series = shown[0]["series"]
    row = paper.row_of(shown[0])
    assert row[-1] == f"{max(series['cells']):g} {series['label']}"
    assert row[1] == f"{series['values'][-1]:.4g}"
