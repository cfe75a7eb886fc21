"""Places of held bodies in the cell, and the figures of several places."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from flowborne_validation import worlds
from flowborne_validation.findings import Figure, Rule
from flowborne_validation.worlds import PLACES, over_places


@pytest.mark.parametrize("axis", [0, 1])
def test_places_and_their_mirror_images_are_evenly_apart(axis: int) -> None:
    places = np.array(PLACES)[:, axis]
    every = np.sort(np.concatenate([places, 1.0 - places]))
    np.testing.assert_allclose(every, 0.05 + 0.1 * np.arange(10))


def test_the_mean_over_places_is_judged_and_the_spread_is_said() -> None:
    rule = Rule(relative=0.05)
    value, series = rule.value_of(Figure([(1.0, 1.2, 1.4), (1.3,)], (8, 16)), 1.25)
    assert (value, rule.accepts(value, 1.25, series)) == (1.3, True)
    assert series is not None
    assert series.values == pytest.approx([1.2, 1.3])
    first, last, *_ = series.lines()
    assert first.endswith("mean of 3 places with a spread of 0.4, from 1 to 1.4")
    assert ", in one place, from 1.3 to 1.3" in last


def test_each_world_has_its_place_and_starts_from_the_one_before(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    begun: list[Any] = []
    monkeypatch.setattr(worlds, "set_velocity", lambda world, field: begun.append(field))
    monkeypatch.setattr(worlds, "start_from", lambda before, world: begun.append(before.at))

    def build(cells: int, place: tuple[float, float]) -> Any:
        return SimpleNamespace(
            at=(cells, place), solid=SimpleNamespace(q=np.zeros(1), v=np.ones(1))
        )

    def measure(world: Any, first: bool) -> tuple[tuple[float, float], str]:
        cells, (x, _) = world.at
        return (cells + x, float(first)), "steady"

    (sums, firsts), lines = over_places((8, 16), build, "field", measure, once=(16,))  # type: ignore[arg-type]
    assert begun == ["field", *((8, place) for place in PLACES)]
    assert sums == (tuple(8 + x for x, _ in PLACES), (16 + PLACES[0][0],))
    assert firsts == ((1.0, 0.0, 0.0, 0.0, 0.0), (0.0,))
    assert lines[-1] == "    16 cells, 0.65 and 0.25 of a cell: steady"
