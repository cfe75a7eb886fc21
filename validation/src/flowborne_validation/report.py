"""The report: every case with its figures and references, as data.

A report is a folder with report.json and index.html, its page. Cases are added one by one, in one
or several runs; a case that is run again replaces its older results in the same tier.
"""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Iterable, Mapping, Sequence
from datetime import UTC, datetime
from functools import cache
from pathlib import Path
from typing import Any

import flowborne
from flowborne import __version__
from flowborne.parts import write_atomically
from flowborne_validation.case import THE_RUN, Result, Tier
from flowborne_validation.cases import case as case_of
from flowborne_validation.findings import Verdict, spread_of

DATA = "report.json"
TIERS = tuple(reversed(Tier))
"""Tiers of a case, in the order in which they count."""

Case = dict[str, Any]
"""One case in one tier: seconds, date, version, code, cores, and findings as in `Result.as_dict`,
without the values in SHARED."""
Data = dict[str, dict[str, Case]]
"""id -> tier -> case, in the order of the reference list."""

SHARED = ("id", "tier", "title", "seconds", "grid", "finest")
"""Values of a result that its case has once, or its series."""

VERDICTS: tuple[Verdict, ...] = ("fail", "coarse", "pass", "unconfirmed")
"""From the worst to the best; unconfirmed figures do not count."""


def read_report(folder: Path) -> Data:
    """The cases of a report; none when there is no report yet. Raises ValueError when the file is
    no report."""
    path = folder / DATA
    if not path.exists():
        return {}
    try:
        data: Data = json.loads(path.read_text(encoding="utf-8"))["cases"]
        return {name: dict(tiers) for name, tiers in data.items()}
    except (ValueError, KeyError, TypeError, AttributeError) as error:
        raise ValueError(f"{path} is no report ({error}); name another folder") from error


def add_to_report(folder: Path, results: Sequence[Result], order: Iterable[str]) -> None:
    """Add the results of one case to the report in `folder`, which is created if missing.

    order   ids in the order of the reference list
    raises  ValueError when the folder holds another report.json; OSError when it cannot be written
    """
    folder.mkdir(parents=True, exist_ok=True)
    data = read_report(folder)
    case: Case = {
        "seconds": round(results[0].seconds, 1),
        "date": datetime.now(UTC).date().isoformat(),
        "version": __version__,
        "code": code(),
        "cores": os.cpu_count(),
        "findings": [
            {name: value for name, value in result.as_dict().items() if name not in SHARED}
            for result in results
        ],
    }
    data.setdefault(results[0].id, {})[results[0].tier.value] = case
    data = {name: data[name] for name in order if name in data}
    text = json.dumps({"cases": data}, indent=1) + "\n"
    write_atomically(folder / DATA, lambda file: file.write(text.encode()))


@cache
def code() -> str:
    """Digest of every file of both packages: solver, scenes, cases, references. Two runs with the
    same digest were made by the same code."""
    digest = hashlib.sha256()
    for root in (Path(flowborne.__file__).parent, Path(__file__).parent):
        for path in sorted(root.rglob("*")):
            if path.is_file() and "__pycache__" not in path.parts:
                digest.update(str(path.relative_to(root).as_posix()).encode())
                digest.update(path.read_bytes())
    return digest.hexdigest()[:12]


def of_other_code(data: Data) -> list[str]:
    """Cases that were measured with other code than the present; with the tiers of which that is
    true, if it is not true of all."""
    stale = {
        name: [tier for tier, case in tiers.items() if case.get("code") != code()]
        for name, tiers in data.items()
    }
    return [
        name if len(old) == len(data[name]) else f"{name} ({', '.join(old)})"
        for name, old in stale.items()
        if old
    ]


def already_there(folder: Path, tiers: Mapping[str, Tier]) -> dict[str, list[Result]]:
    """Results of the report by the same code in the same tier, without runs that broke down.

    tiers   id -> tier of the case
    raises  ValueError when the folder holds another report.json
    """
    data = read_report(folder)
    found = {}
    for name, tier in tiers.items():
        case = data.get(name, {}).get(tier.value)
        if case is not None and case.get("code") == code():
            results = [_result(name, tier, case["seconds"], row) for row in case["findings"]]
            if all(result.quantity != THE_RUN for result in results):
                found[name] = results
    return found


def _result(name: str, tier: Tier, seconds: float, row: dict[str, Any]) -> Result:
    case = case_of(name)
    shared = {"id": name, "tier": tier, "title": f"{case.title}: {row['quantity']}"}
    finest = tier is case.full
    return Result.from_dict({**row, **shared, "seconds": seconds, "finest": finest})


def tier_of(case: dict[str, Case]) -> str:
    """The tier that counts of a case: the largest in which it was run."""
    return next(tier.value for tier in TIERS if tier.value in case)


def is_finest(name: str, tier: str) -> bool:
    """Whether a case has its finest grids in this tier."""
    return case_of(name).full.value == tier


def grid_of(finding: dict[str, Any]) -> str:
    """The grid on which a figure was measured, such as "10 cells across D", and its spread over
    places in the cell; empty without a grid series."""
    series = finding.get("series")
    if series is None:
        return ""
    grid = f"{series['cells'][-1]:g} {series['label']}"
    return f"{grid}, {spread_of(series['places'][-1])}" if "places" in series else grid


def verdict_of(case: dict[str, Case]) -> Verdict:
    """The worst verdict of a case in the tier that counts: of the run on its finest grids, if the
    report has that."""
    found = {finding["verdict"] for finding in case[tier_of(case)]["findings"]}
    return next(verdict for verdict in VERDICTS if verdict in found)


def failures(data: Data) -> list[tuple[str, str, dict[str, Any]]]:
    """(id, tier, finding) of all figures that fail, each case in the tier that counts."""
    return [
        (name, tier_of(case), finding)
        for name, case in data.items()
        for finding in case[tier_of(case)]["findings"]
        if finding["verdict"] == "fail"
    ]


def verdicts(data: Data) -> dict[str, int]:
    """Number of figures with each verdict, each case in the tier that counts."""
    counts: dict[str, int] = dict.fromkeys(VERDICTS, 0)
    for case in data.values():
        for finding in case[tier_of(case)]["findings"]:
            counts[finding["verdict"]] += 1
    return counts
