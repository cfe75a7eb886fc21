"""Draws the plots of the committed validation report from its data: `make validation-page`."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable
from functools import partial
from typing import Any, NamedTuple

from committed import REPORT
from flowborne_validation.page import curves_of, drag_over_reynolds, plots_of
from flowborne_validation.report import Data, read_report, tier_of
from tolerances import dots
from tolerances import draw as draw_tolerances

DRAG, TOLERANCES = "drag", "tolerances"
"""Plots that several cases share."""


class Picture(NamedTuple):
    """A plot of the page.

    file   name in the report's folder
    title  in words
    of     digest of the data that it is drawn from
    draw   gives its SVG
    """

    file: str
    title: str
    of: str
    draw: Callable[[], str]


def pictures(data: Data) -> dict[str, list[Picture]]:
    """Plots of every case that has some, each in the tier that counts, and the shared ones."""
    shown = dots(data)
    title = "all figures against their tolerance, a row for each family of cases"
    drawn = partial(draw_tolerances, shown)
    found = {TOLERANCES: [Picture(f"{TOLERANCES}.svg", title, digest(shown), drawn)]}
    drag = drag_over_reynolds(data)
    if drag:
        title = "drag of a cylinder over the Reynolds number"
        found[DRAG] = [Picture(f"{DRAG}.svg", title, digest(drag), partial(curves_of, drag))]
    for name, tiers in data.items():
        findings = tiers[tier_of(tiers)]["findings"]
        of = digest([[f["quantity"], f.get("series"), f.get("plot")] for f in findings])
        found[name] = [
            Picture(f"{name}-{number}.svg", title, of, draw)
            for number, (title, draw) in enumerate(plots_of(findings), 1)
        ]
    return found


def digest(data: Any) -> str:
    """A few letters that change when the data do."""
    return hashlib.sha256(json.dumps(data).encode()).hexdigest()[:12]


def mark(picture: Picture) -> str:
    """Last line of the file of a picture, by which it is known to be up to date."""
    return f"<!-- of data {picture.of} -->\n"


def write() -> None:
    """Draw what is not up to date, and remove what the report has no longer."""
    wanted = [p for some in pictures(read_report(REPORT)).values() for p in some]
    for path in REPORT.glob("*.svg"):
        if path.name not in {p.file for p in wanted}:
            path.unlink()
    for picture in wanted:
        path = REPORT / picture.file
        if not is_drawn(picture):
            path.write_text(picture.draw() + mark(picture), encoding="utf-8")


def is_drawn(picture: Picture) -> bool:
    """Whether the picture's file was drawn from these data."""
    path = REPORT / picture.file
    return path.exists() and path.read_text(encoding="utf-8").endswith(mark(picture))


if __name__ == "__main__":
    write()
