"""Puts what fails in the committed report, and what scenes cost, into the README: `make readme`."""

from __future__ import annotations

import textwrap

from accuracy import failed_by_case, failed_of, farthest_off, speed
from committed import REPORT, ROOT
from flowborne_validation.case import THE_RUN, entry
from flowborne_validation.report import read_report, verdicts
from markdown_text import plain, table
from marked import with_part
from validation_table import number

README = ROOT / "README.md"
HEAD = ("case", "figure that is farthest off", "reference", "flowborne", "accepted", "fail")


def section() -> str:
    """How many figures pass, a line for each case of which some fail, and the cost of scenes."""
    data = read_report(REPORT)
    counts, failed = verdicts(data), failed_by_case(data)
    judged = counts["pass"] + counts["fail"] + counts["coarse"]
    text = (
        f"{counts['pass']} of {judged} figures of {len(data)} published and analytic cases pass, "
        f"{counts['coarse']} are outside their tolerance on a grid too coarse for it, and "
        f"{counts['fail']} fail, in {len(failed)} cases:"
    )
    rows = []
    for name, found in failed.items():
        worst = farthest_off(found)
        value = "stops" if worst["quantity"] == THE_RUN else number(worst["value"])
        figure = [plain(worst["quantity"]), number(worst["reference"]), value]
        count = failed_of(data, name, found)
        rows.append(
            [f"{name} {plain(entry(name).name)}", *figure, plain(worst["tolerance"]), count]
        )
    return f"{textwrap.fill(text, 100)}\n\n{table(HEAD, rows)}\n{speed()}\n"


def with_section(text: str) -> str:
    """The README with the section of today."""
    return with_part(text, "readme", section())


if __name__ == "__main__":
    README.write_text(with_section(README.read_text(encoding="utf-8")), encoding="utf-8")
