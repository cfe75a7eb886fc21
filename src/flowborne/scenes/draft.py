"""A scene under inspection: where its problems are, and messages about them."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import reduce
from typing import Any, Literal, get_args, get_origin

from pydantic_core import ErrorDetails

from flowborne.base.errors import SceneError
from flowborne.base.phrases import suggestion
from flowborne.base.tables import BUILT_IN, OWN, OwnTable, Table
from flowborne.scenes.schema import Scene, TimeTable

Key = str | int

WHAT = {
    "float_type": "is not a number. Give a number, without quotes",
    "int_type": "is not a whole number. Give a whole number",
    "int_from_float": "is not a whole number. Give a whole number",
    "finite_number": "is not a finite number. Give a finite number",
    "string_type": "is not text. Put it in quotes",
    "string_too_short": "is empty. Give at least one letter",
    "string_pattern_mismatch": 'is not of the form "module:function". Write it so',
    "tuple_type": "is not a list. Put it in square brackets",
    "too_short": "has too few entries. Give at least one",
    "too_long": "has too many entries. Give fewer",
    "model_type": "is not a table. Write it as a table with keys",
    "dict_type": "is not a table. Write it as a table with keys",
    "model_attributes_type": "is not a table. Write it as a table with keys",
}
"""pydantic's type of error -> what is wrong with the value, and the remedy."""

BOUNDS = {
    "greater_than": ("gt", "is not greater than", "larger"),
    "greater_than_equal": ("ge", "is less than", "larger"),
    "less_than": ("lt", "is not less than", "smaller"),
    "less_than_equal": ("le", "is greater than", "smaller"),
}
"""pydantic's type of error -> its key of the bound, what the value is, and the remedy."""


def place(
    file: str,
    keys: tuple[Key, ...],
    numbers: dict[str, list[int]] | None = None,
    root: type[Table] = Scene,
) -> str:
    """Where something is: "scene swim.toml, [[control]] 2, joints".

    keys     from the top of the file, list entries counted from 0
    numbers  table -> number that each of its entries has in the file, from 1
    root     table of the whole file; its name says what the file is
    """
    where = f"{root.__name__.lower()} {file}"
    if not keys:
        return where
    top, rest = keys[0], list(keys[1:])
    listed = bool(rest) and isinstance(rest[0], int) and _is_list_of_tables(str(top), root)
    if listed:
        index = int(rest.pop(0))
        number = numbers[str(top)][index] if numbers and str(top) in numbers else index + 1
        where += f", [[{top}]] {number}"
    elif isinstance(top, str) and tables_of(root, top):
        where += f", [{top}]"
    else:
        where += f", {top}"
    inner = ""
    for key in rest:
        inner += f", entry {key + 1}" if isinstance(key, int) else f".{key}" if inner else f" {key}"
    return where + ("," if listed and inner else "") + inner


def tables_of(table: type[Table], key: str) -> list[type[Table]]:
    """The tables that may stand at `key` of a table."""
    known = table.model_fields
    return _tables_in(known[key].annotation) if key in known else []


def _tables_in(annotation: Any) -> list[type[Table]]:
    if isinstance(annotation, type) and issubclass(annotation, Table):
        return [annotation]
    return [table for part in get_args(annotation) for table in _tables_in(part)]


def _tables_at(keys: Sequence[Key], root: type[Table]) -> list[type[Table]]:
    """The tables that may stand at `keys`, from the top of a file."""
    tables: list[type[Table]] = [root]
    for key in keys:
        if isinstance(key, str):
            tables = [inner for table in tables for inner in tables_of(table, key)]
    return tables


def _is_list_of_tables(key: str, root: type[Table]) -> bool:
    field = root.model_fields.get(key)
    listed = field is not None and get_origin(field.annotation) is tuple
    return listed and bool(tables_of(root, key))


def _kind_of(value: Any) -> Any:
    return value.get("kind") if isinstance(value, dict) else value


def _allowed(keys: tuple[Key, ...], raw: Any, root: type[Table]) -> list[str]:
    """Keys that the table at `keys` may have."""
    tables, kind = _tables_at(keys, root), _kind_of(reduce(_inside, keys, raw))
    fitting = [table for table in tables if kind in _kinds(table)] or tables
    return sorted({name for table in fitting for name in table.model_fields})


def _kinds(table: type[Table]) -> tuple[Any, ...]:
    field = table.model_fields.get("kind")
    return get_args(field.annotation) if field and get_origin(field.annotation) is Literal else ()


def _inside(value: Any, key: Key) -> Any:
    try:
        return value[key]
    except (KeyError, IndexError, TypeError):
        return None


def keys_of(location: tuple[Key, ...], raw: Any, root: type[Table] = Scene) -> tuple[Key, ...]:
    """pydantic's location without the kinds that it puts in where a table was chosen by kind."""
    keys: list[Key] = []
    value, choosing = raw, False
    for key in location:
        if choosing and key in (BUILT_IN, OWN):
            continue
        if choosing and key == _kind_of(value):
            choosing = False
            continue
        keys.append(key)
        value = _inside(value, key)
        choosing = any(_kinds(table) for table in _tables_at(keys, root))
    return tuple(keys)


def explain(error: ErrorDetails, raw: Any, file: str, root: type[Table] = Scene) -> str:
    """One of pydantic's errors for people; `root` is the table of the whole file."""
    keys = keys_of(error["loc"], raw, root)
    kind, value, context = error["type"], error["input"], error.get("ctx", {})
    where, around = place(file, keys, root=root), place(file, keys[:-1], root=root)
    if kind == "extra_forbidden":
        name = str(keys[-1])
        if keys == ("time", "duration"):
            return f"{around}: unknown key 'duration'; {_frames_for(raw['time'])}"
        end = suggestion(name, _allowed(keys[:-1], raw, root), "The keys here are")
        return f"{around}: unknown key '{name}'{end}"
    if kind == "missing":
        return f"{around}: key '{keys[-1]}' is missing. Add it."
    if kind == "union_tag_not_found":
        kinds = [k for table in _tables_at(keys, root) for k in _kinds(table)]
        return f"{where}: key 'kind' is missing. Give one of: {', '.join(kinds)}."
    if kind in ("union_tag_invalid", "literal_error"):
        known = str(context.get("expected_tags", context.get("expected", "")))
        names = [part.strip(" '") for part in known.replace(" or ", ",").split(",")]
        own = [table for table in _tables_at(keys, root) if issubclass(table, OwnTable)]
        names += [kind for table in own for kind in table.registry.kinds]
        given = context.get("tag", value)
        return f"{where}: '{given}' is not known{suggestion(str(given), names, 'Give one of')}"
    if kind == "value_error":
        return f"{where} {context['error']}."
    if kind in BOUNDS:
        key, compared, remedy = BOUNDS[kind]
        return f"{where}: {_shown(value)} {compared} {context[key]:g}. Give a {remedy} number."
    if kind == "tuple_type" and isinstance(value, dict) and _is_list_of_tables(str(keys[0]), root):
        return f"{around}: [{keys[0]}] may be there several times. Write [[{keys[0]}]]."
    what = WHAT.get(kind, f"is not right ({error['msg'].lower()}). Correct it")
    return f"{where}: {_shown(value)} {what}."


def _frames_for(time: dict[str, Any]) -> str:
    """How to give a duration, in s, of the table [time]."""
    rate = time.get("frames_per_second", TimeTable().frames_per_second)
    if not all(isinstance(n, int | float) and 0 < n < 1e9 for n in (rate, time["duration"])):
        return "give frames = duration times frames_per_second."
    frames = max(1, round(time["duration"] * rate))
    return f"give frames = {frames}, which is {frames / rate:g} s at frames_per_second = {rate:g}."


def _shown(value: Any) -> str:
    text = repr(value)
    return text if len(text) <= 60 else text[:57] + "..."


@dataclass(frozen=True)
class Draft:
    """A scene under inspection.

    scene    its valid parts
    file     name of its file
    broken   names of the top tables from which wrong parts were left out
    numbers  table -> number that each of its entries has in the file
    """

    scene: Scene
    file: str
    broken: frozenset[str]
    numbers: dict[str, list[int]]

    def at(self, *keys: Key) -> str:
        """Where something is, for a message."""
        return place(self.file, keys, self.numbers)

    def sound(self, *tables: str) -> bool:
        """Whether nothing was left out of these tables."""
        return not self.broken & set(tables)

    def gives(self, table: str) -> bool:
        """Whether the file says anything in this table, right or wrong."""
        default = Scene.model_fields[table].get_default(call_default_factory=True)
        return table in self.broken or getattr(self.scene, table) != default

    def said(self, problems: Iterable[str], *keys: Key) -> list[str]:
        """Problems with their place."""
        return [f"{self.at(*keys)}: {problem}" for problem in problems]

    def failing(self, make: Callable[[], object], *keys: Key) -> list[str]:
        """The problems with which `make` fails."""
        try:
            make()
        except SceneError as error:
            return self.said(error.problems, *keys)
        return []
