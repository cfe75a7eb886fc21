"""Figures and counts of paper/paper.md, from the committed report and gallery: `make joss`."""

from __future__ import annotations

import textwrap
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt

from committed import REPORT, ROOT
from flowborne_validation.report import Data, read_report, tier_of, verdicts
from marked import with_part

PAPER = ROOT / "paper"
SCENES = ("eel-free", "swimmer", "flyer-twist", "human-wind-back")
COLOURS = {"pass": "#2a7a4f", "coarse": "#c9a227", "fail": "#b3372f"}
LEAST = 1e-6
"""Smaller relative errors are drawn there."""


def counts(data: Data) -> str:
    """A sentence with the number of figures of each verdict."""
    found = verdicts(data)
    judged = found["pass"] + found["coarse"] + found["fail"]
    text = (
        f"It has {len(data)} published and analytic cases. Of their {judged} figures "
        f"{found['pass']} are within their tolerance, {found['coarse']} are outside on a grid too "
        f"coarse for it, and {found['fail']} fail."
    )
    return textwrap.fill(text, 110) + "\n"


def errors(data: Data) -> dict[str, list[tuple[str, float]]]:
    """Verdict -> case and relative error of each figure whose reference is a number other than 0,
    each case in the tier that counts."""
    found: dict[str, list[tuple[str, float]]] = {verdict: [] for verdict in COLOURS}
    for name, case in data.items():
        for figure in case[tier_of(case)]["findings"]:
            value, reference = figure["value"], figure["reference"]
            if figure["verdict"] in found and isinstance(value, float) and _is_size(reference):
                error = abs(value / reference - 1.0)
                found[figure["verdict"]].append((name, max(error, LEAST)))
    return found


def _is_size(reference: float | str) -> bool:
    return isinstance(reference, float | int) and reference != 0.0


def draw_errors(data: Data, path: Path) -> None:
    """The errors by case."""
    found = errors(data)
    shown = {name for points in found.values() for name, _ in points}
    place = {name: number for number, name in enumerate(name for name in data if name in shown)}
    figure, axes = plt.subplots(figsize=(9.0, 3.2), layout="constrained")
    for verdict, points in found.items():
        across, up = [place[name] for name, _ in points], [error for _, error in points]
        axes.scatter(across, up, s=14, color=COLOURS[verdict], label=verdict)
    axes.set(yscale="log", ylabel="relative error", xlim=(-1, len(place)))
    axes.set_xticks(range(len(place)), list(place), rotation=90, fontsize=8)
    axes.grid(axis="y", alpha=0.3)
    figure.legend(ncols=3, loc="outside upper right")
    figure.savefig(path, dpi=150, metadata={"Software": None})
    plt.close(figure)


def draw_scenes(path: Path) -> None:
    """Pictures of SCENES in a row."""
    figure, all_axes = plt.subplots(1, len(SCENES), figsize=(12.0, 2.4), layout="constrained")
    for axes, name in zip(all_axes, SCENES, strict=True):
        axes.imshow(plt.imread(ROOT / "docs" / "gallery" / f"{name}.webp"))
        axes.set_title(name, fontsize=9)
        axes.axis("off")
    figure.savefig(path, dpi=120, metadata={"Software": None})
    plt.close(figure)


def main() -> None:
    """Write both figures and the counts."""
    data, paper = read_report(REPORT), PAPER / "paper.md"
    draw_errors(data, PAPER / "validation.png")
    draw_scenes(PAPER / "scenes.png")
    text = with_part(paper.read_text(encoding="utf-8"), "joss", counts(data))
    paper.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
