"""Names in the README what fails in the committed validation report: `make failing`."""

from __future__ import annotations

import textwrap
from pathlib import Path

from flowborne_validation.case import entry
from flowborne_validation.report import failures, read_report, verdicts
from marked import with_part

ROOT = Path(__file__).parents[1]
README, REPORT = ROOT / "README.md", ROOT / "docs" / "validation"


def section() -> str:
    """How many figures pass, and the cases of which some fail."""
    data = read_report(REPORT)
    counts = verdicts(data)
    judged = counts["pass"] + counts["fail"] + counts["coarse"]
    named = dict.fromkeys(name for name, _, _ in failures(data))
    listed = ", ".join(f"{name} ({entry(name).name})" for name in named)
    text = (
        f"{counts['pass']} of {judged} figures of {len(data)} published and analytic cases pass; "
        f"{counts['coarse']} are outside their tolerance on a grid too coarse for it. Figures of "
        f"these fail: {listed}. [The report](docs/validation.md) has them all."
    )
    return textwrap.fill(text, 100, break_long_words=False) + "\n"


def number(value: float | str) -> str:
    """A value for people."""
    return f"{value:.4g}" if isinstance(value, float) else str(value)


def with_section(text: str) -> str:
    """The README with the table of today."""
    return with_part(text, "failing", section())


if __name__ == "__main__":
    README.write_text(with_section(README.read_text(encoding="utf-8")), encoding="utf-8")
