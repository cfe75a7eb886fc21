"""How much of its tolerance each figure of the validation report uses, and their picture."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from flowborne_validation.page import svg
from flowborne_validation.report import Data, tier_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes

FAMILIES = {
    "flow": ("F", "flow without bodies"),
    "held": ("B", "bodies held in a stream"),
    "ideal": ("I", "bodies in ideal fluid"),
    "viscous": ("VC", "bodies in viscous fluid"),
    "joints": ("A", "joints without fluid"),
    "flesh": ("D", "flesh"),
    "control": ("K", "the controller"),
    "swimmers": ("SR", "swimmers and robots"),
}
"""Page of a family -> first letters of its cases, and its name."""

NUMBER = r"([-+.\de]+)"
LEAST, MOST = 1e-3, 1e2
"""Parts of a tolerance at the ends of the picture's axis; what is beyond is drawn there."""

LOOKS = {
    "pass": ("passes", "o", "#1a7f37"),
    "coarse": ("outside, on a grid too coarse for it", "s", "#b8860b"),
    "fail": ("fails: outside, or its error does not fall from grid to grid", "X", "#c4320a"),
}
"""Verdict -> label, marker and colour."""


def family_of(case: str) -> str:
    """The page of a case. Raises StopIteration for a letter that no family has."""
    return next(page for page, (letters, _) in FAMILIES.items() if case[0] in letters)


def of_family(data: Data, page: str) -> Data:
    """The cases of a family."""
    return {name: tiers for name, tiers in data.items() if family_of(name) == page}


def off(finding: Mapping[str, Any]) -> float | None:
    """Signed distance from the reference over its size; None where the reference is 0 or a bound,
    and for a run that broke down."""
    value, reference = finding["value"], finding["reference"]
    if isinstance(value, str) or isinstance(reference, str) or not reference:
        return None
    return float((value - reference) / abs(reference))


def used(finding: Mapping[str, Any]) -> float | None:
    """Distance from the reference over the distance that is accepted on that side; None if nothing
    says how large that is: the reference is a bound such as "> 0", or only the order is judged."""
    value, reference, words = finding["value"], finding["reference"], finding["tolerance"]
    if isinstance(value, str) or isinstance(reference, str):
        return None
    if words.startswith("at most"):
        return abs(value) / reference
    if found := re.match(rf"{NUMBER} %(?: of {NUMBER})?", words):
        size = abs(reference) if found[2] is None else float(found[2])
        allowed = 0.01 * float(found[1]) * size
    elif found := re.match(rf"\[?{NUMBER}(?:,| to) {NUMBER}", words):
        allowed = abs((float(found[1]) if value < reference else float(found[2])) - reference)
    elif found := re.match(rf">= {NUMBER}$", words):
        allowed = reference - float(found[1])
        return max(reference - value, 0.0) / allowed
    elif found := re.match(rf"{NUMBER}(?:,|$)", words):
        allowed = float(found[1])
    else:
        return None
    return abs(value - reference) / allowed if allowed else None


def dots(data: Data) -> dict[str, list[tuple[float, str]]]:
    """Name of a family -> (used part of the tolerance, verdict) of its figures that have one."""
    found: dict[str, list[tuple[float, str]]] = {}
    for page, (_, title) in FAMILIES.items():
        cases = [tiers[tier_of(tiers)]["findings"] for tiers in of_family(data, page).values()]
        judged = [f for case in cases for f in case if f["verdict"] in LOOKS]
        parts = [(used(f), f["verdict"]) for f in judged]
        found[title] = [(part, verdict) for part, verdict in parts if part is not None]
    return found


def draw(shown: Mapping[str, Sequence[tuple[float, str]]]) -> str:
    """A row of dots for each family, as SVG: left of the line a figure is within its tolerance."""

    def dotted(axes: Axes) -> None:
        rows = list(shown.values())
        for verdict, (label, marker, colour) in LOOKS.items():
            x, y = [], []
            for row, found in enumerate(rows):
                for number, (part, judged) in enumerate(found):
                    if judged == verdict:
                        x.append(min(max(part, LEAST), MOST))
                        y.append(row - 0.32 + 0.64 * (number + 0.5) / len(found))
            axes.plot(x, y, ls="", marker=marker, ms=3.2, mew=0, color=colour, label=label)
        axes.axvline(1.0, color="black", lw=1)
        axes.axvspan(LEAST / 2.0, 1.0, color="#1a7f37", alpha=0.07, lw=0)
        axes.set_xscale("log")
        axes.set_xlim(LEAST / 2.0, 2.0 * MOST)
        axes.set_xticks([LEAST, 0.01, 0.1, 1.0, 10.0, MOST])
        axes.set_xticklabels(["≤ 0.001", "0.01", "0.1", "1", "10", "≥ 100"])
        axes.set_xlabel("error over the accepted error")
        axes.set_yticks(range(len(rows)), list(shown))
        axes.invert_yaxis()

    return svg(dotted, "")
