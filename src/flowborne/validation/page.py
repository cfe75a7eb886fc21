"""The report's page: every case with its table and its plots, drawn from the report's data."""

from __future__ import annotations

import io
from collections.abc import Callable, Iterable
from html import escape
from pathlib import Path
from typing import Any

from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from flowborne.exporters import write_atomically
from flowborne.validation.case import Curve, Plot
from flowborne.validation.reference import entry
from flowborne.validation.report import Case, Data, read_report, tier_of, verdicts

PAGE = "index.html"

DRAG = (
    ("B4", "Cd", 40.0),
    ("B5", "Cd mean", 100.0),
    ("V9", "Cd, held", 185.0),
    ("B6", "Cd mean", 200.0),
)
"""Case, figure and Reynolds number of a cylinder's drag in open water."""

PUBLISHED = {"ls": "", "marker": "o", "mfc": "none"}
"""How published points look."""

FEW = 20
"""Points below which each of a line's is marked."""

STYLE = """
body { font: 15px/1.45 system-ui, sans-serif; margin: 2rem auto; max-width: 62rem; color: #222 }
h2 { margin-top: 2.5rem; font-size: 1.15rem }
p.source { color: #666; margin-top: -0.6rem }
table { border-collapse: collapse; width: 100% }
th, td { text-align: left; padding: 0.25rem 0.6rem; border-bottom: 1px solid #ddd }
td.number { text-align: right; font-variant-numeric: tabular-nums; white-space: nowrap }
.pass { color: #1a7f37 } .fail { color: #c4320a; font-weight: 600 } .unconfirmed { color: #666 }
svg { max-width: 34rem; height: auto }
"""


def write_page(folder: Path) -> None:
    """Draw the page of the report in `folder` from its data.

    raises  ValueError when the folder's report.json is no report; OSError when the page cannot be
            written
    """
    page = page_of(read_report(folder))
    write_atomically(folder / PAGE, lambda file: file.write(page.encode()))


def page_of(data: Data) -> str:
    """The page: how many pass, the drag over the Reynolds number, then every case with its table
    and its plots."""
    counts = verdicts(data)
    body = [
        "<h1>Published and analytic numbers beside flowborne's</h1>",
        f"<p>{len(data)} cases with {sum(counts.values())} figures: {counts['pass']} pass, "
        f"{counts['fail']} fail, and {counts['unconfirmed']} stand beside a reference that is not "
        "confirmed at its source and do not count. Each case says in which tier it was run: the "
        "smaller tiers have coarser grids and shorter runs. In the plots circles are published, "
        "lines are flowborne's.</p>",
        *_drag_over_reynolds(data),
    ]
    for name, case in data.items():
        body += _case(name, tier_of(case), case[tier_of(case)])
    return (
        '<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8">'
        f"<title>flowborne's validation</title><style>{STYLE}</style></head>\n<body>\n"
        + "\n".join(body)
        + "\n</body></html>\n"
    )


def _drag_over_reynolds(data: Data) -> list[str]:
    """A cylinder's drag in open water, from all cases that measured it."""
    found = [
        (reynolds, finding)
        for name, quantity, reynolds in DRAG
        if name in data
        for finding in data[name][tier_of(data[name])]["findings"]
        if finding["quantity"] == quantity
    ]
    if len(found) < 2:
        return []
    curves = [Curve("flowborne", [re for re, _ in found], [f["value"] for _, f in found])]
    for label, sure in (("published", True), ("published, unconfirmed", False)):
        beside = [(re, f) for re, f in found if (f["verdict"] != "unconfirmed") is sure]
        places, values = [re for re, _ in beside], [f["reference"] for _, f in beside]
        if beside:
            curves.append(Curve(label, places, values, True))
    shown = Plot("Reynolds number", "drag coefficient of a cylinder", curves)
    return ["<h2>Drag over the Reynolds number</h2>", curves_of(shown.as_dict())]


def _case(name: str, tier: str, case: Case) -> list[str]:
    known = entry(name)
    rows = [
        f"<tr><td>{escape(f['quantity'])}</td><td class=number>{_number(f['value'])}</td>"
        f"<td class=number>{_number(f['reference'])}</td><td>{escape(_number(f['tolerance']))}</td>"
        f"<td class={f['verdict']}>{f['verdict']}</td></tr>"
        for f in case["findings"]
    ]
    said = [escape(line) for f in case["findings"] for line in f["lines"] if "series" not in f]
    return [
        f'<h2 id="{name}">{name} {escape(known.name)}</h2>',
        f"<p class=source>{escape(known.source)}. Tier {tier}: {case['seconds']:g} s on "
        f"{case['cores']} cores, {case['date']}, version {escape(case['version'])}.</p>",
        "<table><tr><th>quantity</th><th>flowborne</th><th>reference</th><th>accepted</th>"
        "<th></th></tr>",
        *rows,
        "</table>",
        *(["<p>" + "<br>".join(said) + "</p>"] if said else []),
        *(curves_of(f["plot"], f["quantity"]) for f in case["findings"] if "plot" in f),
        errors_of(case["findings"]),
    ]


def svg(draw: Callable[[Axes], None]) -> str:
    """What is drawn on axes, with the legend beside them, as SVG; equal data give equal text."""
    with rc_context({"svg.hashsalt": "flowborne", "svg.fonttype": "none", "font.size": 8.0}):
        figure = Figure(figsize=(6.4, 3.0), layout="constrained")
        axes = figure.subplots()
        draw(axes)
        axes.grid(alpha=0.3)
        figure.legend(loc="outside right upper", frameon=False, fontsize=6)
        file = io.StringIO()
        figure.savefig(file, format="svg", metadata={"Date": None})
    text = file.getvalue()
    return text[text.index("<svg") :]


def errors_of(findings: Iterable[dict[str, Any]]) -> str:
    """Error over resolution of every grid series as SVG; empty where there is none."""
    drawn = [
        (f["quantity"], f["series"])
        for f in findings
        if "series" in f and len(f["series"]["cells"]) > 1 and min(f["series"]["errors"]) > 0.0
    ]
    if not drawn:
        return ""

    def draw(axes: Axes) -> None:
        for quantity, series in drawn:
            axes.loglog(series["cells"], series["errors"], "o-", ms=3, lw=1, label=quantity)
        axes.set_xlabel(drawn[0][1]["label"])
        axes.set_ylabel("error")

    return svg(draw)


def curves_of(plot: dict[str, Any], title: str = "") -> str:
    """A plot as SVG: what is published as circles, what was measured as lines."""

    def draw(axes: Axes) -> None:
        for curve in plot["curves"]:
            few = len(curve["x"]) < FEW
            look = PUBLISHED if curve["published"] else {"lw": 1, "marker": "." if few else ""}
            axes.plot(curve["x"], curve["y"], ms=4, label=curve["label"], **look)
        axes.set_title(title)
        axes.set_xlabel(plot["x"])
        axes.set_ylabel(plot["y"])

    return svg(draw)


def _number(value: object) -> str:
    return f"{value:.5g}" if isinstance(value, float) else str(value)
