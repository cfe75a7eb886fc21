"""How the seconds of a step are booked."""

from __future__ import annotations

from time import sleep

from flowborne.coupling.report import timed


@timed("solids")
def slow() -> None:
    sleep(0.02)


def test_seconds_of_a_part_within_another_count_for_it_alone() -> None:
    with timed("advection") as seconds:
        slow()
        slow()
    assert seconds["solids"] > 0.04
    assert 0.0 < seconds["advection"] < 0.02


def test_a_timed_function_runs_outside_a_step() -> None:
    slow()
    with timed("advection") as seconds:
        pass
    assert set(seconds) == {"advection"}
