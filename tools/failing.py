"""Names in the README what fails in the committed validation report: `make failing`."""

from __future__ import annotations

from pathlib import Path

from flowborne.validation.case import Tier
from flowborne.validation.report import failures, read_report, tier_of, verdicts
from marked import with_part

ROOT = Path(__file__).parents[1]
README, REPORT = ROOT / "README.md", ROOT / "docs" / "validation"


def section() -> str:
    """How many figures pass, and a table of those that do not."""
    data = read_report(REPORT)
    tiers = [tier_of(case) for case in data.values()]
    run = ", ".join(f"{tiers.count(tier)} in the tier {tier}" for tier in reversed(Tier))
    counts = verdicts(data)
    said = (
        f"[The report](docs/validation.md) has {len(data)} cases, {run}: "
        f"{counts['pass']} of {counts['pass'] + counts['fail'] + counts['coarse']} figures pass, "
        f"{counts['coarse']} are outside their tolerance on a grid too coarse for it, and "
        f"{counts['unconfirmed']} more have values that are not confirmed at their source. "
        "These fail:"
    )
    rows = [
        f"| {name} | {tier} | {finding['quantity']} | {number(finding['value'])} | "
        f"{number(finding['reference'])} | {finding['tolerance']} |"
        for name, tier, finding in failures(data)
    ]
    head = ["| case | tier | figure | flowborne | reference | accepted |", "|" + " --- |" * 6]
    return "\n".join([said, "", *head, *rows]) + "\n"


def number(value: float | str) -> str:
    """A value for people."""
    return f"{value:.4g}" if isinstance(value, float) else str(value)


def with_section(text: str) -> str:
    """The README with the table of today."""
    return with_part(text, "failing", section())


if __name__ == "__main__":
    README.write_text(with_section(README.read_text(encoding="utf-8")), encoding="utf-8")
