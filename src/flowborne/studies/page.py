"""The HTML page of a study: its runs in numbers, plots and a table."""

from __future__ import annotations

import io
from collections.abc import Iterator
from html import escape
from importlib.util import find_spec
from itertools import islice, product

import numpy as np

from flowborne.base.atomic import write_text
from flowborne.studies.result import BAR, StudyResult
from flowborne.studies.schema import Study
from flowborne.view import style

PAGE = "index.html"

MOST_PLOTS = 12
"""Most plots on the page; `StudyResult.plot` draws any."""

MOST_ROWS = 500
"""Most rows of the table on the page; result.parquet has all."""

NO_PLOTS = "Plots are missing: Matplotlib is not installed. pip install 'flowborne[film]'"

STYLE = f"""
body {{ font: 15px/1.45 system-ui, sans-serif; margin: 2rem auto; max-width: 70rem;
  padding: 0 1rem; color: {style.TEXT}; background: {style.PAPER} }}
h2 {{ margin-top: 2rem; font-size: 1.15rem }}
pre, p.note {{ color: {style.MUTED} }}
div.plots {{ display: grid; grid-template-columns: repeat(auto-fill, minmax(20rem, 1fr));
  gap: 1rem }}
div.table {{ overflow-x: auto }}
table {{ border-collapse: collapse }}
th, td {{ text-align: right; padding: 0.2rem 0.6rem; border-bottom: 1px solid {style.LINE};
  white-space: nowrap; font-variant-numeric: tabular-nums }}
tr.best td {{ color: {style.ACCENT} }}
svg {{ max-width: 100%; height: auto }}
"""


def write_page(result: StudyResult, study: Study, said: str) -> None:
    """Write the page into the folder of the study; `said` is its number of runs in words."""
    counts = [
        f"{(result.columns['outcome'] == outcome).sum()} {outcome}"
        for outcome in dict.fromkeys(result.columns["outcome"].tolist())
    ]
    failed = [f"{name}: {message}" for name, message in result.failed.items()]
    body = [
        f"<h1>{escape(study.name)}</h1>",
        f"<p>{escape(said)}: {', '.join(counts)}.</p>",
        *([f"<h2>Failed runs</h2><pre>{escape(chr(10).join(failed))}</pre>"] if failed else []),
        "<h2>Plots</h2>",
        '<div class="plots">',
        *_plots(result, study),
        "</div>",
        "<h2>Runs</h2>",
        *_table(result),
    ]
    text = (
        '<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        f"<title>{escape(study.name)}</title><style>{STYLE}</style></head>\n<body>\n"
        + "\n".join(body)
        + "\n</body></html>\n"
    )
    write_text(result.folder / PAGE, text)


def _plots(result: StudyResult, study: Study) -> Iterator[str]:
    """The goals against each other, then measures against keys, as SVG."""
    if find_spec("matplotlib") is None:
        yield f'<p class="note">{NO_PLOTS}</p>'
        return
    names = list(result.units)
    measures = [
        name
        for name in names[names.index("cells") + 1 :]
        if not name.endswith(BAR) and np.isfinite(result.columns[name]).any()
    ]
    keys = [t.key for t in study.vary if result.columns[t.key].dtype.kind in "fiub"]
    goals = list(result.goals)
    pairs = [*zip(goals[1:], goals, strict=False), *product(keys, [*goals, *measures])]
    for x, y in islice(dict.fromkeys(pairs), MOST_PLOTS):
        file = io.BytesIO()
        result.plot(x, y, file)
        text = file.getvalue().decode()
        yield f"<div>{text[text.index('<svg') :]}</div>"


def _table(result: StudyResult) -> Iterator[str]:
    """The runs with the finest resolutions; those of the Pareto front are marked."""
    rows = np.flatnonzero(result.columns["finest"])
    best = set(result.front().tolist()) if result.goals else set()
    names = [name for name in result.columns if name != "finest"]
    if len(rows) > MOST_ROWS:
        yield f'<p class="note">The first {MOST_ROWS} of {len(rows)}.</p>'
    yield '<div class="table"><table><tr>'
    yield "".join(f"<th>{escape(result.label(name))}</th>" for name in names) + "</tr>"
    for row in rows[:MOST_ROWS].tolist():
        cells = "".join(f"<td>{_shown(result.columns[name][row])}</td>" for name in names)
        yield f'<tr class="{"best" if row in best else ""}">{cells}</tr>'
    yield "</table></div>"


def _shown(value: object) -> str:
    return f"{value:.5g}" if isinstance(value, float) else escape(str(value))
