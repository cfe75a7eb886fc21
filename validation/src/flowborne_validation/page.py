"""The report's page and its plots: every case with its table, drawn from the report's data."""

from __future__ import annotations

import io
from collections.abc import Callable, Iterable, Sequence
from functools import partial
from html import escape
from importlib.util import find_spec
from pathlib import Path
from textwrap import fill
from typing import TYPE_CHECKING, Any

from flowborne.parts import write_atomically
from flowborne_validation.case import entry
from flowborne_validation.findings import Curve, Plot
from flowborne_validation.report import (
    Case,
    Data,
    grid_of,
    is_finest,
    read_report,
    tier_of,
    verdict_of,
    verdicts,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes

PAGE = "index.html"

DRAG = (
    ("B4", "Cd", 40.0),
    ("B5", "Cd mean", 100.0),
    ("V9", "Cd, held", 185.0),
    ("B6", "Cd mean", 200.0),
)
"""Cases of a cylinder in open water, their drag and Reynolds number."""

NO_PLOT = "A plot is missing here: Matplotlib is not installed. pip install 'flowborne[film]'"
"""Text in place of a plot that cannot be drawn."""

PUBLISHED = {"ls": "", "marker": "o", "mfc": "none"}
"""Style of published points."""

COLOURS, LOOKS = 10, ("o-", "s--", "^:")
"""Colours of matplotlib's cycle, and styles of lines in the first, second and third cycle."""

WIDTH, HEIGHT, LINE = 4.4, 2.7, 0.17
"""Inches: width of a plot, its height without the legend, and the height of a legend's line."""

FEW = 20
"""Number of points below which a line has markers."""

STYLE = """
body { font: 15px/1.45 system-ui, sans-serif; margin: 2rem auto; max-width: 62rem; color: #222;
  padding: 0 1rem }
h2 { margin-top: 2.5rem; font-size: 1.15rem }
p.source { color: #666; margin-top: -0.6rem }
div.table { overflow-x: auto }
table { border-collapse: collapse; width: 100% }
th, td { text-align: left; padding: 0.25rem 0.6rem; border-bottom: 1px solid #ddd }
td.number { text-align: right; font-variant-numeric: tabular-nums; white-space: nowrap }
.pass { color: #1a7f37 } .fail { color: #c4320a; font-weight: 600 }
.coarse { color: #8a5a00 } .unconfirmed { color: #666 }
svg { max-width: 100%; height: auto }
"""


def write_page(folder: Path) -> None:
    """Draw the page of the report in `folder` from its data. Raises ValueError when the folder's
    report.json is no report; OSError when the page cannot be written."""
    page = page_of(read_report(folder))
    write_atomically(folder / PAGE, lambda file: file.write(page.encode()))


def page_of(data: Data) -> str:
    """The page: number of passes, drag over the Reynolds number, cases with tables and plots."""
    counts = verdicts(data)
    drag = drag_over_reynolds(data)
    body = [
        "<h1>Published and analytic numbers beside flowborne's</h1>",
        f"<p>{len(data)} cases with {sum(counts.values())} figures: {counts['pass']} pass, "
        f"{counts['fail']} fail, {counts['coarse']} are outside their tolerance on a grid too "
        f"coarse for it, and {counts['unconfirmed']} have a reference that is not confirmed at its "
        "source and do not count. Each case says in which tier it was run, and with which version: "
        "the smaller tiers have coarser grids and shorter runs. In the plots circles are "
        "published, lines are flowborne's.</p>",
        *(["<h2>Drag over the Reynolds number</h2>", curves_of(drag)] if drag else []),
    ]
    for name, case in data.items():
        body += _case(name, tier_of(case), case)
    return (
        '<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        f"<title>flowborne's validation</title><style>{STYLE}</style></head>\n<body>\n"
        + "\n".join(body)
        + "\n</body></html>\n"
    )


def drag_over_reynolds(data: Data) -> dict[str, Any]:
    """Plot of a cylinder's drag in open water, from all cases with it; empty for fewer than two."""
    found = [
        (reynolds, finding)
        for name, quantity, reynolds in DRAG
        if name in data
        for finding in data[name][tier_of(data[name])]["findings"]
        if finding["quantity"] == quantity
    ]
    if len(found) < 2:
        return {}
    curves = [Curve("flowborne", [re for re, _ in found], [f["value"] for _, f in found])]
    for label, sure in (("published", True), ("published, unconfirmed", False)):
        known = [(re, f) for re, f in found if (f["verdict"] != "unconfirmed") is sure]
        if known:
            x, y = [re for re, _ in known], [f["reference"] for _, f in known]
            curves.append(Curve(label, x, y, True))
    return Plot("Reynolds number", "drag coefficient of a cylinder", curves).as_dict()


def _case(name: str, tier: str, tiers: dict[str, Case]) -> list[str]:
    known, case = entry(name), tiers[tier]
    rows = [
        f"<tr><td class={f['verdict']}>{f['verdict']}</td><td>{escape(f['quantity'])}</td>"
        f"<td class=number>{_number(f['value'])}</td>"
        f"<td class=number>{_number(f['reference'])}</td>"
        f"<td>{escape(_number(f['tolerance']))}</td><td>{escape(grid_of(f))}</td></tr>"
        for f in case["findings"]
    ]
    title = [escape(line) for f in case["findings"] for line in f["lines"] if "series" not in f]
    finest = "its finest grids" if is_finest(name, tier) else "not its finest grids"
    verdict = verdict_of(tiers)
    return [
        f'<h2 id="{name}">{name} {escape(known.name)}: <span class={verdict}>{verdict}</span></h2>',
        f"<p class=source>{escape(known.source)}. Tier {tier}, {finest}: {case['seconds']:g} s on "
        f"{case['cores']} cores, {case['date']}, version {escape(case['version'])}.</p>",
        "<div class=table><table><tr><th></th><th>quantity</th><th>flowborne</th><th>reference</th>"
        "<th>accepted</th><th>grid</th></tr>",
        *rows,
        "</table></div>",
        *(["<p>" + "<br>".join(title) + "</p>"] if title else []),
        *(draw() for _, draw in plots_of(case["findings"])),
    ]


def plots_of(findings: Iterable[dict[str, Any]]) -> list[tuple[str, Callable[[], str]]]:
    """Titles of the plots of a case, and functions that draw them as SVG."""
    found: list[tuple[str, Callable[[], str]]] = [
        (f["quantity"], partial(curves_of, f["plot"], f["quantity"]))
        for f in findings
        if "plot" in f
    ]
    drawn = [
        (f["quantity"], f["series"])
        for f in findings
        if "series" in f and len(f["series"]["cells"]) > 1 and min(f["series"]["errors"]) > 0.0
    ]
    return [*found, ("error over the grid", partial(errors_of, drawn))] if drawn else found


def svg(draw: Callable[[Axes], None], title: str) -> str:
    """A drawing on axes, with the legend below them, as SVG; equal data give equal text. Its width
    fits the screen of a telephone. Without Matplotlib it is the sentence NO_PLOT."""
    if find_spec("matplotlib") is None:
        return f"<p class=source>{NO_PLOT}</p>"
    from matplotlib import rc_context
    from matplotlib.figure import Figure

    with rc_context({"svg.hashsalt": "flowborne", "svg.fonttype": "none", "font.size": 9.0}):
        figure = Figure(layout="constrained")
        axes = figure.subplots()
        draw(axes)
        axes.grid(alpha=0.3)
        axes.set_title(fill(title, 54), fontsize=9.0)
        handles, labels = axes.get_legend_handles_labels()
        labels = [fill(label, 64) for label in labels]
        lines = "\n".join(labels).count("\n") + 1
        figure.set_size_inches(WIDTH, HEIGHT + LINE * lines)
        figure.legend(handles, labels, loc="outside lower center", frameon=False, fontsize=8.0)
        file = io.StringIO()
        figure.savefig(file, format="svg", metadata={"Date": None}, transparent=True)
    text = file.getvalue()
    return text[text.index("<svg") :]


def errors_of(drawn: Sequence[tuple[str, dict[str, Any]]]) -> str:
    """Error over resolution of grid series, each with its quantity, as SVG."""

    def draw(axes: Axes) -> None:
        for number, (quantity, series) in enumerate(drawn):
            look = LOOKS[number // COLOURS % len(LOOKS)]
            axes.loglog(series["cells"], series["errors"], look, ms=3, lw=1, label=quantity)
        from matplotlib.ticker import NullLocator

        grids = sorted({cells for _, series in drawn for cells in series["cells"]})
        axes.set_xticks(grids, [f"{cells:g}" for cells in grids])
        axes.xaxis.set_minor_locator(NullLocator())
        axes.set_xlabel(drawn[0][1]["label"])
        axes.set_ylabel("error")

    return svg(draw, "")


def curves_of(plot: dict[str, Any], title: str = "") -> str:
    """A plot as SVG: published points as circles, measured ones as lines."""

    def draw(axes: Axes) -> None:
        for curve in plot["curves"]:
            few = len(curve["x"]) < FEW
            look = PUBLISHED if curve["published"] else {"lw": 1, "marker": "." if few else ""}
            axes.plot(curve["x"], curve["y"], ms=4, label=curve["label"], **look)
        axes.set_xlabel(plot["x"])
        axes.set_ylabel(plot["y"])

    return svg(draw, title)


def _number(value: object) -> str:
    return f"{value:.5g}" if isinstance(value, float) else str(value)
