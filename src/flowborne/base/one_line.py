"""Records in one line, whatever arrays they hold."""

from __future__ import annotations

from collections.abc import Sized
from dataclasses import fields
from enum import Enum
from pathlib import Path
from typing import Any

import numpy as np

LETTERS = 120
"""Most of a line; fields that do not fit are left out."""

PLAIN = str | float | int | Enum | Path
"""Values that come first."""

SHOWN = 3
"""Most numbers of an array that are shown; of a larger one its shape is."""


def one_line(record: Any) -> str:
    """`Name(field=value, ...)` of a dataclass, for its `__repr__`: plain values first, without
    fields that are None or empty."""
    values = {field.name: getattr(record, field.name) for field in fields(record) if field.repr}
    given = {name: value for name, value in values.items() if _has_something(value)}
    plain = sorted(given, key=lambda name: not isinstance(given[name], PLAIN))
    said = f"{type(record).__name__}("
    for name in plain:
        more = f"{name}={_short(given[name])}, "
        if len(said) + len(more) > LETTERS:
            return f"{said}…)"
        said += more
    return f"{said.removesuffix(', ')})"


def _has_something(value: Any) -> bool:
    return value is not None and not (isinstance(value, Sized) and len(value) == 0)


def _short(value: Any) -> str:
    if isinstance(value, Enum):
        return value.name
    if isinstance(value, str | int | Path):
        return repr(str(value)) if isinstance(value, Path) else repr(value)
    if isinstance(value, float):
        return f"{value:.4g}"
    if isinstance(value, np.ndarray) and (value.ndim != 1 or value.size > SHOWN):
        return f"array{value.shape}"
    if isinstance(value, np.ndarray):
        return f"[{', '.join(f'{number:.4g}' for number in value)}]"
    if isinstance(value, tuple | list | dict):
        return f"<{len(value)}>"
    return type(value).__name__
