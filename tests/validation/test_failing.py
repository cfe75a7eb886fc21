"""The README names every case that fails."""

from __future__ import annotations

from failing import README, with_section


def test_the_readme_names_what_fails_in_the_committed_report() -> None:
    text = README.read_text(encoding="utf-8")
    assert text == with_section(text), "README.md is out of date: run `make failing`"
