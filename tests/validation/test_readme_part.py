"""README and documentation show the committed report as it is."""

from __future__ import annotations

import validation_page
from committed import REPORT
from flowborne_validation.report import read_report
from readme import README, with_section


def test_the_readme_names_what_fails_in_the_committed_report() -> None:
    text = README.read_text(encoding="utf-8")
    assert text == with_section(text), "README.md is out of date: run `make readme`"


def test_the_plots_are_those_of_the_committed_report() -> None:
    wanted = [p for some in validation_page.pictures(read_report(REPORT)).values() for p in some]
    assert {path.name for path in REPORT.glob("*.svg")} == {picture.file for picture in wanted}
    stale = [picture.file for picture in wanted if not validation_page.is_drawn(picture)]
    assert not stale, "docs/validation is out of date: run `make validation-page`"
