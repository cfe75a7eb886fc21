"""The kinds of values that the tables of a scene are made of."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any

from pydantic import (
    AfterValidator,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    PlainSerializer,
    Strict,
)

Number = Annotated[float, Strict()]
"""A finite number; text such as "3" is not one."""

Positive = Annotated[float, Strict(), Field(gt=0)]
NotNegative = Annotated[float, Strict(), Field(ge=0)]
Count = Annotated[int, Strict(), Field(ge=1)]
WholeNumber = Annotated[int, Strict(), Field(ge=0)]
"""0, 1, 2, ..."""

Text = Annotated[str, Field(min_length=1)]

FUNCTION = r"^[A-Za-z_][\w.]*:[A-Za-z_]\w*$"
"""Form of a Python function's name, "module:function"."""


def _two_or_three(values: tuple[float, ...]) -> tuple[float, ...]:
    if len(values) not in (2, 3):
        raise ValueError(f"{list(values)} is neither (x, y) nor (x, y, z). Give 2 or 3 numbers")
    return values


def _three(values: tuple[float, ...]) -> tuple[float, ...]:
    return _two_or_three(values) + (0.0,) * (3 - len(values))


Corner = Annotated[tuple[Number, ...], AfterValidator(_two_or_three)]
"""A place: (x, y) or (x, y, z) in m."""

Vector = Annotated[tuple[Number, ...], AfterValidator(_three)]
"""(x, y, z); z may be left out and is then 0."""


def _as_several(value: Any) -> Any:
    return [value] if isinstance(value, int | float) else value


def _as_one(values: tuple[float, ...]) -> float | tuple[float, ...]:
    return values[0] if len(values) == 1 else values


JointValues = Annotated[
    tuple[Number, ...], BeforeValidator(_as_several), PlainSerializer(_as_one), Field(min_length=1)
]
"""One number for a hinge or a slide, several for a ball or a free joint."""


class Table(BaseModel):
    """A table of a scene file: unknown keys, nan and inf are refused, nothing changes later."""

    model_config = ConfigDict(extra="forbid", allow_inf_nan=False, frozen=True)


def _named_kind(value: Any) -> Any:
    return {"kind": value} if isinstance(value, str) else value


ByKind = (Field(discriminator="kind"), BeforeValidator(_named_kind))
"""For a choice among tables by their key `kind`; the bare name stands for a table of defaults."""


def as_interval(start: float, stop: float | None) -> tuple[float, float]:
    """(start, stop) in s, without end when `stop` is None."""
    return (start, float("inf") if stop is None else stop)


def filled(data: Any, defaults: Mapping[str, Any]) -> Any:
    """`data` with the keys of `defaults` that it lacks; anything but a table as it is."""
    return {**defaults, **data} if isinstance(data, Mapping) else data


def triple(vector: tuple[float, ...]) -> tuple[float, float, float]:
    """A Vector as the three numbers that it is."""
    x, y, z = vector
    return x, y, z
