"""The committed validation report as tables: the middle of docs/validation.md."""

from __future__ import annotations

from typing import Any

from failing import REPORT
from failing import number as shown
from flowborne.validation.reference import entry
from flowborne.validation.report import failures, read_report, tier_of, verdicts
from markdown_text import plain, table

HEAD = ("figure", "flowborne", "reference", "accepted", "")
VERDICTS = {"pass": "passes", "fail": "**fails**", "unconfirmed": "unconfirmed"}


def number(value: float | str) -> str:
    """A value in a cell of a table."""
    return plain(shown(value))


def counts() -> str:
    """How many figures pass, in a sentence."""
    data = read_report(REPORT)
    found = verdicts(data)
    return (
        f"{found['pass']} figures of {len(data)} cases pass and {found['fail']} fail; "
        f"{found['unconfirmed']} more stand beside references that are not confirmed. Each case is "
        "told in the longest run that the report has of it."
    )


def failing() -> str:
    """What fails, each case in the tier that counts."""
    rows = [
        [
            name,
            tier,
            plain(f["quantity"]),
            number(f["value"]),
            number(f["reference"]),
            plain(str(f["tolerance"])),
        ]
        for name, tier, f in failures(read_report(REPORT))
    ]
    return table(["case", "tier", *HEAD[:-1]], rows)


def cases() -> str:
    """A section for each case: where its reference is from, and its figures beside ours."""
    text = []
    for name, tiers in read_report(REPORT).items():
        tier, known = tier_of(tiers), entry(name)
        case: dict[str, Any] = tiers[tier]
        rows = [
            [
                plain(found["quantity"]),
                number(found["value"]),
                number(found["reference"]),
                plain(str(found["tolerance"])),
                VERDICTS[found["verdict"]],
            ]
            for found in case["findings"]
        ]
        run = f"Tier {tier}: {case['seconds']:g} s on {case['cores']} cores, "
        run += f"{case['date']}, version {case['version']}."
        text += [f"## {name}: {plain(known.name)}", f"{plain(known.source)}. {run}"]
        text += [table(HEAD, rows)]
    return "\n\n".join(text)
