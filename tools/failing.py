"""Names in the README what fails in the committed validation report: `make failing`."""

from __future__ import annotations

from pathlib import Path

from flowborne.validation.report import failures, read_report, tier_of

ROOT = Path(__file__).parents[1]
README, REPORT = ROOT / "README.md", ROOT / "docs" / "validation"
BEGIN, END = "<!-- failing: made by `make failing` -->\n", "<!-- end of failing -->\n"


def section() -> str:
    """How many figures pass, and a table of those that do not."""
    data = read_report(REPORT)
    cases = [case[tier_of(case)] for case in data.values()]
    full = sum(tier_of(case) == "full" for case in data.values())
    figures = sum(len(case["findings"]) for case in cases)
    failing = failures(data)
    said = (
        f"[The report](docs/validation/index.html) has {len(data)} cases, {full} of them in full "
        "and the others on the coarser grids of their quick tier: "
        f"{figures - len(failing)} of {figures} figures pass. These do not:"
    )
    rows = [
        f"| {name} | {tier} | {finding['quantity']} | {number(finding['value'])} | "
        f"{number(finding['reference'])} | {finding['tolerance']} |"
        for name, tier, finding in failing
    ]
    head = ["| case | tier | figure | flowborne | reference | accepted |", "|" + " --- |" * 6]
    return "\n".join([said, "", *head, *rows]) + "\n"


def number(value: float | str) -> str:
    """A value for people."""
    return f"{value:.4g}" if isinstance(value, float) else str(value)


def with_section(text: str) -> str:
    """The README with the table of today."""
    before, rest = text.split(BEGIN)
    return before + BEGIN + section() + END + rest.split(END)[1]


if __name__ == "__main__":
    README.write_text(with_section(README.read_text(encoding="utf-8")), encoding="utf-8")
