"""Tasks in worker processes, by `eval`, which every process can import."""

from __future__ import annotations

import multiprocessing
from pathlib import Path

import pytest

from flowborne.validation.side_by_side import side_by_side

DIES = "__import__('os').kill(__import__('os').getpid(), 9)"
LASTS = "__import__('time').sleep(600)"

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


def test_a_process_that_dies_costs_its_task_alone() -> None:
    begun: list[str] = []
    tasks = (DIES, "6 * 7", "2 + 2")
    found = dict(side_by_side(eval, tasks, 1, begun.append))
    assert found == {DIES: None, "6 * 7": 42, "2 + 2": 4}
    assert begun == list(tasks)


def test_what_a_task_raises_is_raised_here() -> None:
    with pytest.raises(ZeroDivisionError):
        list(side_by_side(eval, ("1 / 0",), 1, lambda task: None))


def test_no_process_outlives_an_interruption() -> None:
    answers = side_by_side(eval, (LASTS, "6 * 7"), 2, lambda task: None)
    assert next(answers) == ("6 * 7", 42)
    answers.close()  # type: ignore[attr-defined]
    assert not multiprocessing.active_children()


def test_a_task_cleans_up_when_it_is_ended(tmp_path: Path) -> None:
    """As what it has in temporary folders."""
    gone = tmp_path / "gone"
    lasting = (
        f"exec({CLEANS_UP!r}, {{'begun': {str(tmp_path / 'begun')!r}, 'gone': {str(gone)!r}}})"
    )
    answers = side_by_side(eval, (lasting, WAITS.format(str(tmp_path / "begun"))), 2, print)
    next(answers)
    answers.close()  # type: ignore[attr-defined]
    assert gone.exists()
