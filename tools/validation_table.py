"""The committed validation report as Markdown: the parts of docs/validation.md."""

from __future__ import annotations

import math
import subprocess
from collections import Counter
from typing import Any

from committed import REPORT, ROOT
from committed import number as shown
from flowborne.base.version import __version__
from flowborne_validation.case import entry
from flowborne_validation.report import (
    code,
    failures,
    grid_of,
    is_finest,
    of_other_code,
    read_report,
    tier_of,
    verdict_of,
    verdicts,
)
from markdown_text import plain, table
from tolerances import FAMILIES, family_of, of_family, off
from validation_page import Picture, pictures

HEAD = ("", "figure", "flowborne", "reference", "off", "accepted", "grid")
VERDICTS = {
    "pass": "passes",
    "coarse": "*coarse*",
    "fail": "**fails**",
    "unconfirmed": "unconfirmed",
}


def number(value: float | str) -> str:
    """A value in a cell of a table."""
    return plain(shown(value))


def counts() -> str:
    """How many figures pass, in a sentence."""
    data = read_report(REPORT)
    found = verdicts(data)
    return (
        f"{found['pass']} figures of {len(data)} cases pass and {found['fail']} fail; "
        f"{found['coarse']} are outside their tolerance on a grid too coarse for it, and "
        f"{found['unconfirmed']} have references that are not confirmed. Each case is shown in the "
        "longest run that the report has of it."
    )


def made_from() -> str:
    """Commit that the page is made from, whether it is clean, and versions that were measured."""
    cases = [tiers[tier_of(tiers)] for tiers in read_report(REPORT).values()]
    measured = Counter((case["version"], case.get("code", "")) for case in cases)
    now = sum(count for (_, digest), count in measured.items() if digest == code())
    stale = ", ".join(of_other_code(read_report(REPORT)))
    runs = "\n".join(
        f"* {count} cases: version `{version}`" + (f", code `{digest}`" if digest else "")
        for (version, digest), count in measured.most_common()
    )
    return (
        f"This page was made from {commit()}. Of its {len(cases)} cases {now} were measured with "
        "exactly this code and the others with earlier code, which each case names. A version that "
        "ends in `.d` and a date had changes that were not committed; the code is a digest of all "
        f"files of the package.\n\n{runs}"
        + (f"\n\nMeasured with other code: {stale}." if stale else "")
    )


def commit() -> str:
    """The commit of the checkout, and whether there are changes that it does not have."""
    try:
        name, date = git("log", "-1", "--format=%h %cs").split()
        changed = git("status", "--porcelain")
    except (OSError, subprocess.CalledProcessError):
        return f"version `{__version__}` without its git history"
    clean = "**with changes that are not committed**" if changed else "without other changes"
    return f"commit `{name}` of {date}, {clean}"


def git(*arguments: str) -> str:
    """What git says about this checkout."""
    asked = ["git", "-C", str(ROOT), *arguments]
    return subprocess.run(asked, capture_output=True, check=True, text=True).stdout.strip()


def failing() -> str:
    """What fails, each case in the tier that counts, that which is farthest off first."""
    found = sorted(failures(read_report(REPORT)), key=lambda failed: -distance(failed[2]))
    rows = [[link(name), tier, *row_of(f)[1:-1]] for name, tier, f in found]
    return table(["case", "tier", *HEAD[1:-1]], rows)


def distance(finding: dict[str, Any]) -> float:
    """Distance from the reference over its size; infinite where that is 0, and of a broken run."""
    part = off(finding)
    return math.inf if part is None else abs(part)


def link(name: str) -> str:
    """The id of a case, which leads to its section."""
    return f"[{name}](validation-{family_of(name)}.md#case-{name.lower()})"


def per_cent(finding: dict[str, Any]) -> str:
    """How far a figure is off its reference; empty where that is 0 or a bound."""
    part = off(finding)
    return "" if part is None else signed(100.0 * part)


def signed(percent: float) -> str:
    """A deviation with its sign, to two digits or whole per cents."""
    digits = 2 if abs(percent) < 1.0 else 1 if abs(percent) < 10.0 else 0
    return f"{percent:+.{digits}f}\u00a0%" if abs(percent) >= 0.005 else "< 0.01\u00a0%"


def row_of(found: dict[str, Any]) -> list[str]:
    """A figure beside its reference, as HEAD has it."""
    return [
        VERDICTS[found["verdict"]],
        plain(found["quantity"]),
        number(found["value"]),
        number(found["reference"]),
        plain(per_cent(found)),
        plain(str(found["tolerance"])),
        plain(grid_of(found)),
    ]


def overview() -> str:
    """The families, and a line for each case of each with its verdict."""
    data = read_report(REPORT)
    text = []
    for page in FAMILIES:
        rows = []
        for name, tiers in of_family(data, page).items():
            tier = tier_of(tiers)
            found = [finding["verdict"] for finding in tiers[tier]["findings"]]
            passed = f"{found.count('pass')} of {len(found)}"
            title = f"{link(name)} {plain(entry(name).name)}"
            rows.append([VERDICTS[verdict_of(tiers)], title, passed, tier])
        text.append(f"**[](validation-{page}.md)**\n")
        text.append(table(["", "case", "figures that pass", "tier"], rows))
    return "\n".join(text)


def shared(name: str) -> str:
    """A plot that several cases share."""
    return gallery(pictures(read_report(REPORT)).get(name, []))


def family(page: str) -> str:
    """A section for each case: where its reference is from, its figures beside ours, its plots."""
    text = []
    data = read_report(REPORT)
    plots = pictures(data)
    for name, tiers in of_family(data, page).items():
        tier, known = tier_of(tiers), entry(name)
        case: dict[str, Any] = tiers[tier]
        rows = [row_of(found) for found in case["findings"]]
        finest = "its finest grids" if is_finest(name, tier) else "not its finest grids"
        run = f"Tier {tier}, {finest}: {case['seconds']:g} s on {case['cores']} cores, "
        run += f"{case['date']}, version {case['version']}."
        text += [f"(case-{name.lower()})=\n## {name}: {plain(known.name)}"]
        text += [f"{plain(known.source)}. {run}", table(HEAD, rows), gallery(plots[name])]
    return "\n\n".join(text)


def gallery(some: list[Picture]) -> str:
    """Plots one after the other."""
    return "\n".join(f"![{plain(p.title)}](validation/{p.file})" for p in some)
