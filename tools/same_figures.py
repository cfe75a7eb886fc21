"""Compares a fresh report with the committed one: `make same-figures`.

It fails if a case or a figure is in one report only, if a verdict differs, or if a figure of the
minute tier differs by more than 1 %. Long runs of wakes differ by more from processor to processor.
"""

from __future__ import annotations

import sys
from contextlib import suppress
from pathlib import Path
from typing import Any

from committed import REPORT
from flowborne_validation.case import Tier
from flowborne_validation.report import Data, read_report

ACCEPTED = 0.01
"""Difference of a figure over its size."""

Finding = dict[str, Any]


def differences(fresh: Data, kept: Data, wanted: Tier = Tier.MINUTE) -> list[str]:
    """What differs in the tiers of a run of `wanted`, a line for each figure or case."""
    tiers = [tier for tier in Tier if tier.within(wanted)]
    return [line for tier in tiers for line in _of_tier(fresh, kept, tier)]


def _of_tier(fresh: Data, kept: Data, tier: Tier) -> list[str]:
    ours, theirs = figures(fresh, tier), figures(kept, tier)
    found = []
    for key in dict.fromkeys([*theirs, *ours]):
        where = "fresh" if key in ours else "committed"
        if key not in ours or key not in theirs:
            found.append(f"{': '.join(key)}: in the {where} report only")
            continue
        now, before = ours[key], theirs[key]
        differs = tier is Tier.MINUTE and not same(now["value"], before)
        if differs or now["verdict"] != before["verdict"]:
            found.append(
                f"{': '.join(key)}: {now['value']} ({now['verdict']}), "
                f"committed {before['value']} ({before['verdict']})"
            )
    return found


def figures(data: Data, tier: Tier) -> dict[tuple[str, str], Finding]:
    """(case, quantity) -> finding of a tier."""
    rows = ((name, tiers.get(tier.value)) for name, tiers in data.items())
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


def main(folder: Path, tier: str = Tier.MINUTE.value) -> int:
    """Exit code of the comparison of the report in a folder, of a run of a tier."""
    found = differences(read_report(folder), read_report(REPORT), Tier(tier))
    if not found:
        print(f"the report is the committed one: flowborne validate --tier {tier}")
        return 0
    print("\n".join(found))
    print(f"If the change is right: flowborne validate --tier {tier} --report docs/validation")
    return 1


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1]), *sys.argv[2:]))
