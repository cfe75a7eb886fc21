"""The paper about flowborne says what the committed report says, and cites what it lists."""

from __future__ import annotations

import re
from pathlib import Path

import yaml

from committed import REPORT, ROOT
from flowborne_validation.report import read_report
from joss import PAPER, counts, errors
from marked import with_part

TEXT = (PAPER / "paper.md").read_text(encoding="utf-8")
SECTIONS = (
    "Summary",
    "Statement of need",
    "State of the field",
    "Software design",
    "Research impact statement",
    "Acknowledgements",
    "References",
)
"""Those of the journal that hold before a submission."""


def test_counts_are_those_of_the_committed_report() -> None:
    assert with_part(TEXT, "joss", counts(read_report(REPORT))) == TEXT, "run `make joss`"


def test_it_has_the_form_of_the_journal() -> None:
    head = yaml.safe_load(TEXT.split("---\n")[1])
    cited = yaml.safe_load((ROOT / "CITATION.cff").read_text(encoding="utf-8"))
    assert [one["name"] for one in head["authors"]] == [one["name"] for one in cited["authors"]]
    assert {one["affiliation"] for one in head["authors"]} <= {
        one["index"] for one in head["affiliations"]
    }
    assert tuple(re.findall(r"^# (.+)$", TEXT, re.M)) == SECTIONS
    assert 750 <= len(TEXT.split()) <= 1750


def test_citations_and_figures_are_there() -> None:
    entries = re.findall(
        r"^@\w+\{(\w+),", (PAPER / head_of("bibliography")).read_text("utf-8"), re.M
    )
    assert len(entries) == len(set(entries))
    assert set(re.findall(r"@([a-z]+\d*)\b", TEXT)) == set(entries)
    figures = re.findall(r"\]\((\w+\.png)\)", TEXT)
    assert len(figures) == 2
    assert all((PAPER / name).stat().st_size < 300_000 for name in figures)


def head_of(key: str) -> Path:
    return Path(yaml.safe_load(TEXT.split("---\n")[1])[key])


def test_errors_are_relative() -> None:
    case = {"tier": "x", "findings": [finding(2.2, 2.0, "pass"), finding(1e-9, 0.0, "pass")]}
    found = errors({"B1": {"minute": case}})
    assert [(name, round(error, 6)) for name, error in found["pass"]] == [("B1", 0.1)]
    assert found["fail"] == found["coarse"] == []


def finding(value: float, reference: float, verdict: str) -> dict[str, object]:
    return {"value": value, "reference": reference, "verdict": verdict}
