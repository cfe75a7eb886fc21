"""Which state is seen at a time."""

from __future__ import annotations

import numpy as np
import pytest

from flowborne.view.browser.settings import Timeline

TIMES = np.array([0.0, 0.1, 0.2, 0.5])


@pytest.mark.parametrize(("time", "number"), [(0.0, 0), (0.04, 0), (0.06, 1), (0.3, 2), (9.0, 3)])
def test_nearest_state_is_seen(time: float, number: int) -> None:
    timeline = Timeline(TIMES)
    timeline.seek(time)
    assert timeline.number == number


def test_plays_at_its_pace_and_begins_again() -> None:
    timeline = Timeline(TIMES)
    timeline.pace = 0.5
    timeline.play()
    timeline.advance(0.4)
    assert timeline.time == pytest.approx(0.2)
    timeline.advance(1.0)
    assert timeline.time == 0.0
    assert timeline.playing


def test_time_stands_still_until_it_plays() -> None:
    timeline = Timeline(TIMES)
    timeline.advance(1.0)
    assert timeline.number == 0


def test_steps_go_from_state_to_state_and_stop_it() -> None:
    timeline = Timeline(TIMES)
    timeline.play()
    timeline.step(2)
    assert (timeline.number, timeline.playing) == (2, False)
    timeline.step(-9)
    assert timeline.number == 0


def test_newest_state_stays_in_sight() -> None:
    timeline = Timeline(TIMES)
    timeline.show_newest()
    timeline.extend(np.append(TIMES, 0.6))
    assert timeline.number == 4
    timeline.seek(0.1)
    timeline.extend(np.append(TIMES, [0.6, 0.7]))
    assert timeline.number == 1
