"""Puts the committed validation report's figures of the paper into docs/paper.md: `make paper`."""

from __future__ import annotations

from typing import Any

from committed import REPORT, ROOT
from committed import number as shown
from flowborne_validation.case import reference
from flowborne_validation.report import Data, grid_of, read_report, tier_of
from markdown_text import plain, table
from marked import with_part
from validation_table import link

PAGE = ROOT / "docs" / "paper.md"

ARRIVALS = tuple(f"block-{goal}: frames" for goal in ("drag-max", "drag-min", "effort-wind"))


def rests(*scenes: str) -> tuple[str, ...]:
    """Where a scene's own rule comes to rest, and how far it and the fixed step wander there."""
    ends = (", own rule: final angle", ", own rule: chatter", ": chatter")
    return tuple(scene + end for scene in scenes for end in ends)


SHOWN: tuple[tuple[str, str, tuple[str, ...]], ...] = (
    ("2", "K6", ARRIVALS),
    ("4 a", "K6", rests("block-effort-wind")),
    ("5", "K10", ("wind on faces: lean", "left_shoulder: blown", "drag of arms")),
    ("6", "K6", rests("block-drag-max", "block-drag-min")),
    ("section 3.2", "K4", ("most drag: slowest", "least drag: slowest")),
    ("7", "K11", ("swimmer: ", "swimmer-stroke: ")),
    ("8", "K5", ("ns-block-drag-max: ", "ns-block-drag-min: ")),
    ("9 a", "K8", ("centre of mass beside", "torque at the back")),
    ("9 b", "K9", ("blocked arm's", "torso's shift")),
    ("10", "K7", ("serial time",)),
    ("11, 12", "K11", ("flyer: ",)),
    ("13", "K11", ("flyer of flesh: ",)),
)
"""Figure of the paper, case, and how the quantities that are shown of the case begin."""

HEAD = ("figure", "case", "quantity", "flowborne", "reference", "grid and details")


def section() -> str:
    """The table, and which run each case is from."""
    data = read_report(REPORT)
    rows = [
        [figure, link(name), *row_of(finding)]
        for figure, name, begins in SHOWN
        for finding in found(data, name, begins)
    ]
    return f"{table(HEAD, rows)}\n{paper_frames()}\n\n{runs(data)}\n"


def paper_frames() -> str:
    """The frames in the paper's Fig. 2, in a sentence."""
    said = "; ".join(f"{row}: {count}" for row, count in reference("K6", "paper frames").items())
    return f"Frames in the paper's Fig. 2: {said}."


def runs(data: Data) -> str:
    """The tier and date of each case, in the tier that counts, in a sentence."""
    cases: dict[str, list[str]] = {}
    for name in data:
        if name in {shown for _, shown, _ in SHOWN}:
            tier = tier_of(data[name])
            cases.setdefault(f"`{tier}` of {data[name][tier]['date']}", []).append(name)
    said = "; ".join(f"tier {run}: {', '.join(names)}" for run, names in cases.items())
    return f"The runs: {said}."


def found(data: Data, name: str, begins: tuple[str, ...]) -> list[dict[str, Any]]:
    """The findings of a case, in the tier that counts, of which the quantities begin so.

    raises  KeyError when the report has no such case; ValueError when a beginning fits no quantity
    """
    case = data[name]
    findings: list[dict[str, Any]] = case[tier_of(case)]["findings"]
    for begin in begins:
        if not any(finding["quantity"].startswith(begin) for finding in findings):
            raise ValueError(f"case {name} of the report has no quantity '{begin}...'")
    return [finding for finding in findings if finding["quantity"].startswith(begins)]


def row_of(finding: dict[str, Any]) -> list[str]:
    """Quantity, value, reference, and the grid or what else the run says."""
    details = grid_of(finding) or "; ".join(finding["lines"])
    quantity = plain(finding["quantity"])
    return [quantity, shown(finding["value"]), plain(shown(finding["reference"])), plain(details)]


def with_section(text: str) -> str:
    """The page with the table of the committed report."""
    return with_part(text, "paper", section())


if __name__ == "__main__":
    PAGE.write_text(with_section(PAGE.read_text(encoding="utf-8")), encoding="utf-8")
