"""Compares a fresh report with the committed one: `make same-figures`.

The minute tier is compared. It fails if a case or a figure is in one report only, if a verdict
differs, or if a figure differs by more than 1 %.
"""

from __future__ import annotations

import sys
from contextlib import suppress
from pathlib import Path
from typing import Any

from failing import REPORT
from flowborne_validation.case import Tier
from flowborne_validation.report import Data, read_report

ACCEPTED = 0.01
"""Difference of a figure over its size."""

Finding = dict[str, Any]


def differences(fresh: Data, kept: Data) -> list[str]:
    """What differs in the minute tier, a line for each figure or case."""
    ours, theirs = figures(fresh), figures(kept)
    found = []
    for key in dict.fromkeys([*theirs, *ours]):
        where = "fresh" if key in ours else "committed"
        if key not in ours or key not in theirs:
            found.append(f"{': '.join(key)}: in the {where} report only")
            continue
        now, before = ours[key], theirs[key]
        if now["verdict"] != before["verdict"] or not same(now["value"], before):
            found.append(
                f"{': '.join(key)}: {now['value']} ({now['verdict']}), "
                f"committed {before['value']} ({before['verdict']})"
            )
    return found


def figures(data: Data) -> dict[tuple[str, str], Finding]:
    """(case, quantity) -> finding of the minute tier."""
    rows = ((name, tiers.get(Tier.MINUTE.value)) for name, tiers in data.items())
    return {(name, f["quantity"]): f for name, row in rows if row for f in row["findings"]}


def same(value: float | str, kept: Finding) -> bool:
    """Whether a figure is the kept one.

    With a reference of 0 it may be a rounding error: its size is at least the accepted error's.
    """
    before = kept["value"]
    if isinstance(value, str) or isinstance(before, str):
        return value == before
    size = abs(before)
    if kept["reference"] == 0.0:
        with suppress(ValueError):  # the tolerance is in words
            size = max(size, float(kept["tolerance"]))
    return abs(value - before) <= ACCEPTED * size


def main(folder: Path) -> int:
    """Exit code of the comparison of the report in a folder."""
    found = differences(read_report(folder), read_report(REPORT))
    if not found:
        print("the figures of the minute tier are those of the committed report")
        return 0
    print("\n".join(found))
    print("If the change is right: flowborne validate --report docs/validation")
    return 1


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1])))
