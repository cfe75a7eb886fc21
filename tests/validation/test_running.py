"""Tiers, parallel tasks by `eval`, which every process can import, and no run twice."""

from __future__ import annotations

import io
import multiprocessing
from pathlib import Path

import pytest

from flowborne.machine import cores
from flowborne_validation.case import THE_RUN, Case, Result, Tier
from flowborne_validation.cases import case, case_ids
from flowborne_validation.findings import Figure, Figures, Rule
from flowborne_validation.page import PAGE
from flowborne_validation.report import read_report
from flowborne_validation.running import batches, run_cases, side_by_side

MINUTE, HALF_HOUR, ALL = Tier


def known(quick: Tier = MINUTE, full: Tier = ALL) -> Case:
    """A case whose figure says which run it is of."""
    return Case("B1", {quick: [lambda: {"run": 1.0}], full: [lambda: {"run": 2.0}]}, {"*": Rule()})


def test_a_tier_takes_in_the_smaller_ones() -> None:
    assert [known(MINUTE, ALL).tier_in(tier) for tier in Tier] == [MINUTE, MINUTE, ALL]
    assert [known(HALF_HOUR, ALL).tier_in(tier) for tier in Tier] == [None, HALF_HOUR, ALL]


def test_a_result_says_its_tier() -> None:
    told = [(r.tier, r.value) for q in (True, False) for r in known(HALF_HOUR, ALL).run(q)]
    assert told == [(HALF_HOUR, 1.0), (ALL, 2.0)]


@pytest.mark.parametrize(
    ("grids", "quick", "passed", "series", "verdict"),
    [
        (True, True, False, True, "coarse"),
        (True, True, True, True, "pass"),
        (True, True, False, False, "fail"),
        (True, False, False, True, "fail"),
        (False, True, False, True, "fail"),
    ],
    ids=[
        "outside the tolerance on a grid too coarse",
        "inside it there",
        "a figure that holds on every grid",
        "outside on the finest grids",
        "a shorter run whose grids can pass",
    ],
)
def test_coarse_is_what_fails_on_grids_too_coarse_for_it(
    grids: bool, quick: bool, passed: bool, series: bool, verdict: str
) -> None:
    value = 1.3 if passed else 1.1

    def found() -> Figures:
        figure = Figure((1.0, value), (4, 8), on="cells across D") if series else Figure(value)
        return {"drag": figure}

    rules = {"drag": Rule(reference=1.3, relative=0.01)}
    (result,) = Case("B1", {MINUTE: [found], ALL: [found]}, rules, coarse=grids).run(quick)
    assert (result.verdict, result.finest) == (verdict, not quick)
    assert result.grid == ("8 cells across D" if series else None)
    row = result.as_dict()
    assert (row["verdict"], row["grid"], row["finest"]) == (verdict, result.grid, not quick)
    assert any("by --tier all" in line for line in result.lines) == (verdict == "coarse")


def test_every_case_has_two_tiers_the_shorter_run_first() -> None:
    for found in map(case, case_ids()):
        assert found.quick is not found.full
        assert found.quick.within(found.full), found.id


def test_a_case_that_raises_is_a_failed_result_with_its_message() -> None:
    def broken() -> Figures:
        raise KeyError("arm")

    (result,) = Case("B1", {MINUTE: [broken], ALL: [broken]}, {}).run()
    assert (result.quantity, result.verdict) == (THE_RUN, "fail")
    assert str(result.value).startswith("KeyError: 'arm' (test_running.py, line ")


def test_the_longest_go_first_and_those_that_measure_seconds_alone() -> None:
    runs = [(name, case(name).tier_in(HALF_HOUR)) for name in ("F1", "F6", "K7", "K11")]
    together, alone = batches(runs)
    assert [job.id for job in together] == ["K11", "F1", "F6"]
    assert all(job.threads == max(1, cores() // 3) for job in together)
    assert [(job.id, job.threads) for job in alone] == [("K7", cores())]


def test_what_the_report_has_is_not_run_again(tmp_path: Path) -> None:
    first = run_cases(["A3"], MINUTE, report=tmp_path, stream=io.StringIO())
    told, shown = io.StringIO(), []
    again = run_cases(["A3", "F6"], MINUTE, shown.append, tmp_path, told)
    assert told.getvalue().splitlines()[0] == "cases: 2, 1 of them in the report already"
    assert "A3 took" not in told.getvalue()
    assert "2/2  F6 took" in told.getvalue()
    assert [r.as_dict() for r in again if r.id == "A3"] == [
        {**r.as_dict(), "seconds": round(r.seconds, 1)} for r in first
    ]
    assert [r.id for r in again] == sorted((r.id for r in again), key=list(case_ids()).index)
    assert len(shown) == len(again)


def test_an_interruption_leaves_what_is_done(tmp_path: Path) -> None:
    def interrupt(result: Result) -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run_cases(["F6", "K10"], MINUTE, interrupt, tmp_path, io.StringIO())
    assert list(read_report(tmp_path)) == ["F6"]
    assert 'id="F6"' in (tmp_path / PAGE).read_text()


def test_a_case_of_another_tier_is_refused() -> None:
    with pytest.raises(ValueError, match="K11 is not in the tier minute: it has half-hour and all"):
        run_cases(["K11"], MINUTE)


DIES = "__import__('os').kill(__import__('os').getpid(), 9)"

CLEANS_UP = """
import pathlib, time
try:
    pathlib.Path(begun).touch()
    time.sleep(600)
finally:
    pathlib.Path(gone).touch()
"""

WAITS = """all(True for _ in iter(
    lambda: __import__('time').sleep(0.01) or __import__('os').path.exists({!r}), True))"""


def test_a_process_that_dies_costs_its_task_alone_and_what_a_task_raises_is_raised_here() -> None:
    begun: list[str] = []
    found: dict[str, object] = {}
    tasks = (DIES, "6 * 7", "2 + 2", "1 / 0")
    with pytest.raises(ZeroDivisionError):
        found.update(side_by_side(eval, tasks, 1, begun.append))
    assert found == {DIES: None, "6 * 7": 42, "2 + 2": 4}
    assert begun == list(tasks)


def test_an_interruption_ends_all_processes_and_their_tasks_clean_up(tmp_path: Path) -> None:
    """As what they have in temporary folders."""
    others, gone = set(multiprocessing.active_children()), tmp_path / "gone"
    lasting = (
        f"exec({CLEANS_UP!r}, {{'begun': {str(tmp_path / 'begun')!r}, 'gone': {str(gone)!r}}})"
    )
    waits = WAITS.format(str(tmp_path / "begun"))
    answers = side_by_side(eval, (lasting, waits), 2, print)
    assert next(answers) == (waits, True)
    answers.close()  # type: ignore[attr-defined]
    assert set(multiprocessing.active_children()) <= others
    assert gone.exists()
