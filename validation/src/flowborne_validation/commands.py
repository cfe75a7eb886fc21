"""The commands `flowborne validate`, `bench` and `figures`.

Wrong input raises ValueError, what cannot be written OSError; the program prints either in a line.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Callable, Sequence
from difflib import get_close_matches
from pathlib import Path
from typing import Annotated, Any

import typer

FAILED = 1
"""Exit code when a figure is outside its tolerance, or a run blew up."""

JsonOption = Annotated[bool, typer.Option("--json", help="Print only a JSON list of results.")]


def validate(
    case: Annotated[
        list[str] | None, typer.Option(metavar="ID", help="Only this case; may be repeated.")
    ] = None,
    tier: Annotated[
        str, typer.Option(metavar="TIER", help="minute, half-hour or all: how long it may take.")
    ] = "minute",
    report: Annotated[
        Path | None,
        typer.Option(
            metavar="DIR", help="Folder of a report; cases that it contains are not run again."
        ),
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Compare with analytic and published cases."""
    from flowborne_validation.case import Tier
    from flowborne_validation.cases import case_ids
    from flowborne_validation.report import of_other_code, read_report
    from flowborne_validation.running import run_cases

    ids = known(case or [], case_ids(), "case", "--case")
    (wanted,) = known([tier], tuple(Tier), "tier", "--tier")
    show = None if as_json else printer("id", "reference", "tolerance")
    if report is not None:
        report.mkdir(parents=True, exist_ok=True)
    try:
        results = run_cases(ids or None, Tier(wanted), on_result=show, report=report)
    except KeyboardInterrupt as stop:
        kept = "" if report is None else f"; {report} has the finished cases; run again to continue"
        raise KeyboardInterrupt(f"interrupted{kept}") from stop
    if report is not None and (stale := of_other_code(read_report(report))):
        print(f"{report}: measured with other code: {', '.join(stale)}", file=sys.stderr)
    end(results, as_json)


def bench(
    names: Annotated[
        list[str] | None, typer.Argument(metavar="[NAME]...", help="Only these benches.")
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Measure the speed of flowborne."""
    from flowborne_validation.bench import bench_names, run_benches

    chosen = known(names or [], bench_names(), "bench", "NAME")
    show = None if as_json else printer("name", "target")
    end(run_benches(chosen or None, on_result=show), as_json)


def figures(
    names: Annotated[
        list[str] | None,
        typer.Argument(metavar="[NAME]...", help="Only these figures; all by default."),
    ] = None,
    out: Annotated[Path, typer.Option(help="Folder to write.")] = Path("figures"),
) -> None:
    """Reproduce Figures 2, 7, 9b, 10 and 11 of the paper, as tables and pictures."""
    from flowborne import BlowUpError
    from flowborne.machine import check_drawing

    check_drawing()
    from flowborne_validation.figures import figure_names, make_figures

    chosen = known(names or [], figure_names(), "figure", "NAME")
    out.mkdir(parents=True, exist_ok=True)
    try:
        make_figures(out, chosen or None)
    except (ArithmeticError, BlowUpError) as error:
        print(f"flowborne: {error}", file=sys.stderr)
        raise typer.Exit(FAILED) from error
    print(f"written: {', '.join(str(path) for path in sorted(out.glob('figure-*')))}")


def known(asked: list[str], names: Sequence[str], kind: str, option: str) -> list[str]:
    """The names asked for. Raises ValueError if one of them does not exist."""
    for name in asked:
        if name not in names:
            near = get_close_matches(name, names, n=1, cutoff=0.4)
            guess = f"did you mean {near[0]}?" if near else f"there are {', '.join(names)}"
            raise ValueError(f"{option} {name}: there is no such {kind}; {guess}")
    return asked


def printer(name: str, *columns: str) -> Callable[[Any], None]:
    """Function that prints a result of a case or a bench as it comes."""

    def show(result: Any) -> None:
        shown = "  ".join(f"{c} {number(getattr(result, c))}" for c in ("value", *columns))
        print(f"{result.verdict.upper():<4}  {getattr(result, name)}  {result.title}  {shown}")
        for line in result.lines:
            print(f"        {line}")
        sys.stdout.flush()

    return show


def number(value: object) -> str:
    """Six digits of a number; other values as they are."""
    return f"{value:.6g}" if isinstance(value, float) else str(value)


def end(results: Sequence[Any], as_json: bool) -> None:
    """Print all results as JSON if asked to; exit with FAILED if one has failed."""
    if as_json:
        print(json.dumps([result.as_dict() for result in results], indent=2))
    if any(result.verdict == "fail" for result in results):
        raise typer.Exit(FAILED)
