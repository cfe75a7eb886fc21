"""The report: every case with its figures beside the references, as data and as one page.

A report is a folder with report.json and index.html. Cases are put into it one by one, so that it
grows over several runs; a case that is run again takes the place of what it said before, in its
tier.
"""

from __future__ import annotations

import io
import json
import os
from collections.abc import Iterable, Sequence
from datetime import UTC, datetime
from html import escape
from pathlib import Path
from typing import Any

from matplotlib import rc_context
from matplotlib.figure import Figure

from flowborne import __version__
from flowborne.exporters import write_atomically
from flowborne.validation.case import Result
from flowborne.validation.reference import entry

DATA, PAGE = "report.json", "index.html"
TIERS = ("full", "quick")
"""Tiers of a case, the one that counts first."""

Case = dict[str, Any]
"""One case in one tier: seconds, date, version, and findings as `Result.as_dict` has them."""
Data = dict[str, dict[str, Case]]
"""id -> tier -> case, in the order of the reference list."""

STYLE = """
body { font: 15px/1.45 system-ui, sans-serif; margin: 2rem auto; max-width: 62rem; color: #222 }
h2 { margin-top: 2.5rem; font-size: 1.15rem }
p.source { color: #666; margin-top: -0.6rem }
table { border-collapse: collapse; width: 100% }
th, td { text-align: left; padding: 0.25rem 0.6rem; border-bottom: 1px solid #ddd }
td.number { text-align: right; font-variant-numeric: tabular-nums; white-space: nowrap }
.pass { color: #1a7f37 } .fail { color: #c4320a; font-weight: 600 }
svg { max-width: 34rem; height: auto }
"""


def read_report(folder: Path) -> Data:
    """What a report holds; nothing when there is none yet.

    raises  ValueError when the file is no report
    """
    path = folder / DATA
    if not path.exists():
        return {}
    try:
        data: Data = json.loads(path.read_text(encoding="utf-8"))["cases"]
    except (ValueError, KeyError, TypeError) as error:
        raise ValueError(f"{path} is no report ({error}); name another folder") from error
    return data


def add_to_report(
    folder: Path, results: Sequence[Result], quick: bool, order: Iterable[str]
) -> None:
    """Put the results of one case into the report in `folder`, which is made when it is missing.

    order   ids in the order of the reference list
    raises  ValueError when the folder holds another report.json; OSError when it cannot be written
    """
    folder.mkdir(parents=True, exist_ok=True)
    data = read_report(folder)
    case: Case = {
        "seconds": round(results[0].seconds, 1),
        "date": datetime.now(UTC).date().isoformat(),
        "version": __version__,
        "cores": os.cpu_count(),
        "findings": [
            {k: v for k, v in r.as_dict().items() if k not in ("id", "title", "seconds")}
            for r in results
        ],
    }
    data.setdefault(results[0].id, {})["quick" if quick else "full"] = case
    data = {name: data[name] for name in order if name in data}
    text = json.dumps({"cases": data}, indent=1) + "\n"
    write_atomically(folder / DATA, lambda file: file.write(text.encode()))
    page = page_of(data)
    write_atomically(folder / PAGE, lambda file: file.write(page.encode()))


def tier_of(case: dict[str, Case]) -> str:
    """The tier of a case that counts: the full one, where it was run."""
    return next(tier for tier in TIERS if tier in case)


def failures(data: Data) -> list[tuple[str, str, dict[str, Any]]]:
    """(id, tier, finding) of all that fails, each case in the tier that counts."""
    return [
        (name, tier_of(case), finding)
        for name, case in data.items()
        for finding in case[tier_of(case)]["findings"]
        if finding["verdict"] == "fail"
    ]


def page_of(data: Data) -> str:
    """The page: how many pass, then every case with its table and its plot."""
    counted = [f for case in data.values() for f in case[tier_of(case)]["findings"]]
    passed = sum(finding["verdict"] == "pass" for finding in counted)
    body = [
        "<h1>Published and analytic numbers beside flowborne's</h1>",
        f"<p>{len(data)} cases with {len(counted)} figures: {passed} pass, "
        f"{len(counted) - passed} fail. Each case says whether it was run in full or on the "
        "coarser grids of its quick tier.</p>",
    ]
    for name, case in data.items():
        body += _case(name, tier_of(case), case[tier_of(case)])
    return (
        '<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8">'
        f"<title>flowborne's validation</title><style>{STYLE}</style></head>\n<body>\n"
        + "\n".join(body)
        + "\n</body></html>\n"
    )


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
        f"<p class=source>{escape(known.source)}. {tier.capitalize()} run of {case['seconds']:g} s "
        f"on {case['cores']} cores, {case['date']}, version {escape(case['version'])}.</p>",
        "<table><tr><th>quantity</th><th>flowborne</th><th>reference</th><th>accepted</th>"
        "<th></th></tr>",
        *rows,
        "</table>",
        *(["<p>" + "<br>".join(said) + "</p>"] if said else []),
        plot_of(case["findings"]),
    ]


def plot_of(findings: Iterable[dict[str, Any]]) -> str:
    """Error over resolution of every grid series as SVG; empty where there is none."""
    drawn = [
        (f["quantity"], f["series"])
        for f in findings
        if "series" in f and len(f["series"]["cells"]) > 1 and min(f["series"]["errors"]) > 0.0
    ]
    if not drawn:
        return ""
    with rc_context({"svg.hashsalt": "flowborne", "svg.fonttype": "none", "font.size": 8.0}):
        figure = Figure(figsize=(6.4, 3.0), layout="constrained")
        axes = figure.subplots()
        for quantity, series in drawn:
            axes.loglog(series["cells"], series["errors"], "o-", ms=3, lw=1, label=quantity)
        axes.set_xlabel(drawn[0][1]["label"])
        axes.set_ylabel("error")
        axes.grid(alpha=0.3)
        figure.legend(loc="outside right upper", frameon=False, fontsize=6)
        file = io.StringIO()
        figure.savefig(file, format="svg", metadata={"Date": None})
    text = file.getvalue()
    return text[text.index("<svg") :]


def _number(value: object) -> str:
    return f"{value:.5g}" if isinstance(value, float) else str(value)
