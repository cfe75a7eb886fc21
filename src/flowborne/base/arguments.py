"""Arguments of public functions: each is of its kind, or one SceneError names it and says what to
give."""

from __future__ import annotations

import json
import operator
import os
from collections.abc import Callable, Mapping
from functools import wraps
from inspect import signature
from numbers import Real
from pathlib import Path
from typing import Any, NamedTuple, ParamSpec, TypeVar

import numpy as np

from flowborne.base.errors import SceneError
from flowborne.base.tables import LARGEST, MOST_COUNT

P = ParamSpec("P")
Answer = TypeVar("Answer")

LONGEST_PART = 255
"""Most bytes of a name in a path, on all systems in use."""

SHOWN = 60
"""Most letters of a wrong argument in a message."""


class Kind(NamedTuple):
    """A kind of argument.

    read    gives the argument as the function uses it; raises TypeError or ValueError for another
    wanted  what to give, in words
    """

    read: Callable[[Any], Any]
    wanted: str


def takes(**kinds: Kind) -> Callable[[Callable[P, Answer]], Callable[P, Answer]]:
    """Decorator of a function with arguments of these kinds, by their names.

    The function raises SceneError for an argument of another kind, before it does anything.
    """

    def decorate(function: Callable[P, Answer]) -> Callable[P, Answer]:
        places = signature(function)

        @wraps(function)
        def called(*args: P.args, **kwargs: P.kwargs) -> Answer:
            bound = places.bind(*args, **kwargs)
            for name in kinds.keys() & bound.arguments.keys():
                bound.arguments[name] = read(kinds[name], bound.arguments[name], name)
            return function(*bound.args, **bound.kwargs)

        return called

    return decorate


def read(kind: Kind, value: Any, name: str) -> Any:
    """An argument as it is used. Raises SceneError, which calls it `name`, for a wrong one."""
    try:
        return kind.read(value)
    except (LookupError, OverflowError, RecursionError, TypeError, ValueError):
        raise SceneError(f"{name} is {_shown(value)}; give {kind.wanted}") from None


def check(owner: object, **kinds: Kind) -> None:
    """Keep attributes of `owner` as they are used. Raises SceneError for one of another kind."""
    for name, kind in kinds.items():
        object.__setattr__(owner, name, read(kind, getattr(owner, name), name))


def or_none(kind: Kind) -> Kind:
    """The kind, or None."""
    return Kind(lambda value: None if value is None else kind.read(value), kind.wanted)


def such(fits: Callable[[Any], bool], wanted: str = "") -> Kind:
    """An object that fits, as it is."""

    def same(value: Any) -> Any:
        if not fits(value):
            raise ValueError
        return value

    return Kind(same, wanted)


def one_of(*types: type, wanted: str = "") -> Kind:
    """An object of one of some types."""
    return such(lambda value: isinstance(value, types), wanted)


def several(kind: Kind, wanted: str, count: int | None = None) -> Kind:
    """A tuple of arguments of a kind, as many as `count`, of any sequence but a text."""

    def each(values: Any) -> Any:
        found = tuple(map(kind.read, values))
        if isinstance(values, str) or count not in (None, len(found)):
            raise ValueError
        return found

    return Kind(each, wanted)


def numbers(*shape: int | None, wanted: str) -> Kind:
    """Finite numbers as an array of a shape, with None for any length; one row may stand for
    several."""

    def array(value: Any) -> Any:
        found = np.asarray(value, dtype=np.float64)
        found = found[None] if found.ndim == 1 < len(shape) else found
        fits = len(found.shape) == len(shape) and all(
            want in (None, have) for want, have in zip(shape, found.shape, strict=True)
        )
        if not (fits and np.isfinite(found).all()):
            raise ValueError
        return found

    return Kind(array, wanted)


def _shown(value: Any) -> str:
    """What an argument is, in one short line."""
    text = " ".join(repr(value).split())
    return text if len(text) <= SHOWN else f"{text[:SHOWN]} ..."


def _count(value: Any) -> int:
    count = operator.index(value)
    if isinstance(value, bool) or not 1 <= count <= MOST_COUNT:
        raise ValueError
    return count


def _number(fits: Callable[[float], bool], wanted: str) -> Kind:
    """A number that fits, of a size that can be squared."""

    def read(value: Any) -> float:
        if not isinstance(value, Real) or isinstance(value, bool):
            raise TypeError
        number = float(value)
        if not (abs(number) <= LARGEST and fits(number)):
            raise ValueError
        return number

    return Kind(read, wanted)


def _path(value: Any) -> Any:
    text = os.fspath(value)
    longest = max((len(part.encode()) for part in Path(text).parts), default=0)
    if not text or "\0" in text or longest > LONGEST_PART:
        raise ValueError
    return value if isinstance(value, str) else Path(text)


def _texts(value: Any) -> dict[str, str]:
    """Dotted keys and TOML texts of their values."""
    given = {key: _plain(one) for key, one in PARAMETERS.read(value).items()}
    return {TEXT.read(k): v if isinstance(v, str) else json.dumps(v) for k, v in given.items()}


def _values(value: Any) -> dict[str, Any]:
    """Dotted keys and values of a scene; NumPy's arrays and numbers become lists and numbers."""
    if not value:
        raise ValueError
    return {TEXT.read(key): _plain(one) for key, one in PARAMETERS.read(value).items()}


def _plain(value: Any) -> Any:
    if isinstance(value, np.ndarray | np.generic):
        value = value.tolist()
    if isinstance(value, Mapping):
        return {str(key): _plain(one) for key, one in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(one) for one in value]
    if isinstance(value, str | int | float):
        return value
    raise TypeError


AXIS = Kind(lambda value: range(3)[value], "an axis: 0, 1 or 2")
COUNT = Kind(_count, f"a whole number from 1 to {MOST_COUNT:,}")
COUNTS = several(COUNT, f"whole numbers from 1 to {MOST_COUNT:,}")
INDEX = Kind(operator.index, "a whole number")
NUMBER = _number(lambda x: True, "a finite number")
POSITIVE = _number(lambda x: x > 0.0, "a finite number above 0")
NOT_NEGATIVE = _number(lambda x: x >= 0.0, "a finite number of 0 or more")
PART = _number(lambda x: 0.0 < x < 1.0, "a number above 0 and below 1")
PATH = Kind(_path, "a path")
TEXT = one_of(str, wanted="a text")
TEXTS = Kind(_texts, "a dict of dotted keys and values, as {'time.frames': 9}")
PARAMETERS = one_of(Mapping, wanted="a dict")
VALUES = Kind(_values, "a dict of dotted keys and values, as {'wind.0.velocity': [0.0, 5.0, 0.0]}")
PROGRESS = such(lambda value: isinstance(value, bool) or callable(value), "a function, or True")
VECTOR = several(NUMBER, "3 finite numbers", 3)
