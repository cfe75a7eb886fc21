"""Tables of a scene: their base class, the kinds of values in them, and checks of these."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import Annotated, Any, ClassVar, Protocol, Self

from pydantic import (
    AfterValidator,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Discriminator,
    Field,
    PlainSerializer,
    Strict,
    model_validator,
)

from flowborne.base.given import LONGEST_NAME, possible_name
from flowborne.base.registry import Registry

LARGEST, SMALLEST = 1e100, 1e-100
"""Sizes of numbers whose squares neither overflow nor vanish."""


def _sized(value: float) -> float:
    if 0.0 < abs(value) < SMALLEST or abs(value) > LARGEST:
        raise ValueError(
            f"is {value:g}. Give a number of a size between {SMALLEST:g} and {LARGEST:g}"
        )
    return value


MOST_COUNT = 1_000_000
"""Most frames, cells along an axis, or whatever else is counted."""

Number = Annotated[float, Strict(), AfterValidator(_sized)]
"""A finite number of a size that can be squared; text such as "3" is not one."""

Positive = Annotated[float, Strict(), Field(gt=0), AfterValidator(_sized)]
NotNegative = Annotated[float, Strict(), Field(ge=0), AfterValidator(_sized)]
Count = Annotated[int, Strict(), Field(ge=1, le=MOST_COUNT)]
WholeNumber = Annotated[int, Strict(), Field(ge=0, le=MOST_COUNT)]
"""0, 1, 2, ..."""

MOST_STEPS = 10_000
"""Most steps in a frame or in a trial: with more of them neither comes to its end."""

Steps = Annotated[int, Strict(), Field(ge=1, le=MOST_STEPS)]
StepsOrNone = Annotated[int, Strict(), Field(ge=0, le=MOST_STEPS)]


Text = Annotated[str, Field(min_length=1)]


def _switch_or_names(value: Any) -> Any:
    listed = isinstance(value, list | tuple) and all(isinstance(name, str) for name in value)
    if not (listed or isinstance(value, bool)):
        raise ValueError(f"is {value!r}. Give true, false, or a list of names in quotes")
    return value


SwitchOrNames = Annotated[bool | tuple[str, ...], BeforeValidator(_switch_or_names)]
"""All of something, none of it, or what is named."""

Parameters = dict[str, Any]
"""Arguments of a Python function by name: numbers, texts, lists of them."""

FUNCTION = r"^[A-Za-z_][\w.]*:[A-Za-z_]\w*$"
"""Form of a Python function's name, "module:function"."""


def _two_or_three(values: tuple[float, ...]) -> tuple[float, ...]:
    if len(values) not in (2, 3):
        raise ValueError(f"{list(values)} is neither (x, y) nor (x, y, z). Give 2 or 3 numbers")
    return values


def _three(values: tuple[float, ...]) -> tuple[float, ...]:
    return _two_or_three(values) + (0.0,) * (3 - len(values))


FileName = Annotated[Text, AfterValidator(possible_name)]
"""A file, found from the folder of the scene file."""


def _plain_name(value: str) -> str:
    if not value.isprintable() or value[:1] in (".", " ") or set(value) & set("/\\"):
        raise ValueError(
            f"is {value[:60]!r}, and a run calls its own folder or file by it. Take a name without "
            "'/', '\\' and letters of no width, with a letter or a number first"
        )
    if (size := len(value.encode())) > LONGEST_NAME:
        raise ValueError(
            f"has {size} bytes, and a run calls its own folder or file by it. Take a name of at "
            f"most {LONGEST_NAME}"
        )
    return value


PlainName = Annotated[Text, AfterValidator(_plain_name)]
"""What a folder or a file that a run writes is called by: never a path."""

Corner = Annotated[tuple[Number, ...], AfterValidator(_two_or_three)]
"""A place: (x, y) or (x, y, z) in m."""

Vector = Annotated[tuple[Number, ...], AfterValidator(_three)]
"""(x, y, z); z may be left out and is then 0."""


def _as_several(value: Any) -> Any:
    return [value] if isinstance(value, int | float) else value


def _as_one(values: tuple[float, ...]) -> float | tuple[float, ...]:
    return values[0] if len(values) == 1 else values


JointValues = Annotated[
    tuple[Number, ...],
    BeforeValidator(_as_several, json_schema_input_type=float | tuple[float, ...]),
    PlainSerializer(_as_one),
    Field(min_length=1),
]
"""One number for a hinge or a slide, several for a ball or a free joint."""


class Table(BaseModel):
    """A table of a scene file: unknown keys, nan and inf are refused, nothing changes later."""

    model_config = ConfigDict(extra="forbid", allow_inf_nan=False, frozen=True)


class Places(Protocol):
    """Where the tables of a scene under inspection are, for messages."""

    def at(self, *keys: str | int) -> str:
        """Where something is; entries of lists count from 0."""
        ...

    def sound(self, *tables: str) -> bool:
        """Whether these tables could be read whole."""
        ...


def _named_kind(value: Any) -> Any:
    return {"kind": value} if isinstance(value, str) else value


ByKind = (Field(discriminator="kind"), BeforeValidator(_named_kind))
"""For a choice among tables by their key `kind`; the bare name stands for a table of defaults."""


BUILT_IN, OWN = "built-in", "own"
"""Tags of the two sorts of tables that `ByKindOrOwn` chooses from."""


def by_kind_or_own(registry: Registry[Any]) -> tuple[Discriminator, BeforeValidator]:
    """For a choice between tables with the tags BUILT_IN and OWN: kinds that a user has registered
    have the latter."""

    def tag(value: Any) -> str:
        kind = value.get("kind") if isinstance(value, Mapping) else getattr(value, "kind", None)
        return OWN if kind in registry else BUILT_IN

    return Discriminator(tag), BeforeValidator(_named_kind)


class OwnTable(BaseModel):
    """What a table of a kind of the user's own adds: its further keys are the kind's parameters."""

    model_config = ConfigDict(extra="allow")

    registry: ClassVar[Registry[Any]]

    kind: str

    @property
    def parameters(self) -> dict[str, Any]:
        """The further keys."""
        return dict(self.model_extra or {})

    @model_validator(mode="after")
    def _check(self) -> Self:
        self.registry.check(self.kind, self.parameters)
        return self


def check_keyframes(
    times: Sequence[float] | None, values: Sequence[float] | None, name: str, least: int = 2
) -> None:
    """Raise ValueError unless times and values are given, are equally many, and times increase.

    name   of the values in the table
    least  least number of keyframes
    """
    if times is None or values is None:
        missing = "times" if times is None else name
        raise ValueError(f"has no {missing}. Give both times and {name}")
    if len(times) != len(values):
        raise ValueError(f"has {len(times)} times and {len(values)} {name}. Give as many of both")
    if len(times) < least:
        raise ValueError(f"has {len(times)} times. Give at least {least}")
    for number, (before, after) in enumerate(pairwise(times), start=2):
        if after <= before:
            raise ValueError(
                f"has times that do not increase: entry {number} is {after:g} s after {before:g} "
                "s. Put them in order, each once"
            )


def check_interval(start: float, stop: float | None) -> None:
    """Raise ValueError unless `stop` is later than `start`."""
    if stop is not None and stop <= start:
        raise ValueError(f"starts at {start:g} s and stops at {stop:g} s. Make stop later")


def as_interval(start: float, stop: float | None) -> tuple[float, float]:
    """(start, stop) in s, without end when `stop` is None."""
    return (start, float("inf") if stop is None else stop)


def triple(vector: tuple[float, ...]) -> tuple[float, float, float]:
    """A Vector as the three numbers that it is."""
    x, y, z = vector
    return x, y, z
