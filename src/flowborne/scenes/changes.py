"""[[changes]]: keys of a scene that have other values from a time on."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

from pydantic import Field

from flowborne.base.tables import NotNegative, Table

CHANGEABLE = ("wind", "boundaries", "objectives", "control", "controller")
"""Tables whose values may change in a run: winds, streams, objectives, weights and strengths."""


class ChangeTable(Table):
    """[[changes]]: other values of keys from a time on.

    time    s; they act in the frame that begins then
    over    s in which numbers go there evenly; a stream that jumps gives its bodies an impulse
    values  dotted key -> value, as { "wind.0.velocity" = [0.0, 5.0, 0.0] }; entries count from 0.
            The tables wind, boundaries, objectives, control and controller can change
    """

    time: NotNegative
    over: NotNegative = 0.0
    values: dict[str, Any] = Field(min_length=1)


def values_at(
    changes: Iterable[ChangeTable], start: Mapping[str, Any], time: float, span: float
) -> dict[str, Any]:
    """Dotted key -> value in the frame of `span` s that begins at `time` (s).

    start  the values in the scene of all keys that change
    """
    values: dict[str, Any] = {}
    for change in sorted(changes, key=lambda change: change.time):
        elapsed = time + span - change.time
        if elapsed <= 1e-9 * span:
            continue
        part = 1.0 if elapsed >= change.over else elapsed / change.over
        for key, value in change.values.items():
            values[key] = blended(values.get(key, start[key]), value, part)
    return values


def plain(value: Any) -> Any:
    """The same in Python's own numbers and lists, as in a file, in place of arrays of NumPy."""
    if isinstance(value, Mapping):
        return {key: plain(part) for key, part in value.items()}
    if isinstance(value, list | tuple):
        return [plain(part) for part in value]
    return value.tolist() if hasattr(value, "tolist") else value


def blended(before: Any, after: Any, part: float) -> Any:
    """Between two numbers or lists of them; `after` where they are none."""
    if part == 1.0:
        return after
    if isinstance(before, list | tuple) and isinstance(after, list | tuple):
        if len(before) == len(after):
            return [blended(a, b, part) for a, b in zip(before, after, strict=True)]
    elif _number(before) and _number(after):
        return before + part * (after - before)
    return after


def _number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)
