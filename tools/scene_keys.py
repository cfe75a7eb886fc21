"""Every key of a scene and of a study, told by their schemas: parts of docs/scene-keys.md and
docs/studies.md."""

from __future__ import annotations

import re
import types
from collections.abc import Iterator
from typing import Annotated, Any, Literal, Union, get_args, get_origin

from annotated_types import Ge, Gt, Le, Lt
from pydantic import BaseModel
from pydantic.fields import FieldInfo

from docstrings import meanings, prose
from flowborne.base.tables import Corner, JointValues, OwnTable, Table, Vector
from flowborne.scenes.schema import Scene
from flowborne.scenes.schema_film import Pixels
from flowborne.studies.schema import Study
from markdown_text import plain, table

NAMED = {
    Vector: "`[x, y]` or `[x, y, z]`",
    Corner: "`[x, y]` or `[x, y, z]`",
    JointValues: "number, or list of numbers",
    Pixels: "whole number ≥ 64",
}
"""Types that the schema names, in words."""

FROM_FILE = {"name": "that of the file"}
"""Keys of the top that whatever reads a scene's file fills in."""

WORDS = {float: "number", int: "whole number", str: "text", bool: "`true` or `false`", Any: "any"}
SIGNS = {Gt: (">", "gt"), Ge: ("≥", "ge"), Lt: ("<", "lt"), Le: ("≤", "le")}


HEAD = ("key", "type", "unless given", "meaning")


def hints_of(model: type[BaseModel]) -> dict[str, Any]:
    """The type of every key, with what is annotated to it."""
    return {
        name: Annotated[field.annotation, *field.metadata] if field.metadata else field.annotation
        for name, field in model.model_fields.items()
    }


def unwrapped(hint: Any) -> Any:
    """A type without what is annotated to it."""
    return unwrapped(get_args(hint)[0]) if get_origin(hint) is Annotated else hint


def options(hint: Any) -> list[Any]:
    """The types of a union besides None; a type alone is its only option."""
    inner = unwrapped(hint)
    if get_origin(inner) in (Union, types.UnionType):
        return [one for part in get_args(inner) if part is not type(None) for one in options(part)]
    return [hint]


def tables_in(hint: Any) -> Iterator[type[Table]]:
    """The tables that a value of this type may hold, at any depth of lists."""
    for option in options(hint):
        inner = unwrapped(option)
        if isinstance(inner, type) and issubclass(inner, BaseModel):
            yield inner  # type: ignore[misc]
        else:
            for part in get_args(inner):
                if part is not Ellipsis and get_origin(inner) is not Literal:
                    yield from tables_in(part)


def kind_of(model: type[Table]) -> tuple[str, ...]:
    """What `kind` a table has; () where it has none, or one of the user's own."""
    hint = hints_of(model).get("kind")
    return get_args(hint) if get_origin(hint) is Literal else ()


def bounded(word: str, notes: tuple[Any, ...]) -> str:
    """A type in words with the limits that are annotated to it."""
    limits = []
    for note in notes:
        for one in note.metadata if isinstance(note, FieldInfo) else (note,):
            limits += [f"{s} {getattr(one, a):g}" for t, (s, a) in SIGNS.items() if type(one) is t]
    return f"{word} {', '.join(limits)}" if limits else word


def said(hint: Any) -> str:
    """A type in words."""
    for named, words in NAMED.items():
        if hint == named:
            return words
    if get_origin(hint) is Annotated:
        inner, *notes = get_args(hint)
        return bounded(said(inner), tuple(notes))
    several = options(hint)
    if len(several) > 1 or several[0] is not hint:
        models = list(tables_in(hint))
        if models and not any(map(kind_of, models)):
            return "table"
        if models:
            own = [", or one's own"] if any(issubclass(m, OwnTable) for m in models) else []
            return ", ".join(f'`"{k}"`' for m in models for k in kind_of(m)) + "".join(own)
        return " or ".join(said(option) for option in several)
    origin, inner = get_origin(hint), get_args(hint)
    if origin is Literal:
        return " or ".join(
            f'`"{value}"`' if isinstance(value, str) else f"`{value}`" for value in inner
        )
    if origin is tuple and inner[-1] is Ellipsis:
        return f"list of {said(inner[0])}"
    if origin is tuple:
        return f"`[{', '.join(said(part) for part in inner)}]`"
    if origin is dict:
        return f"table: name = {said(inner[1])}"
    if isinstance(hint, type) and issubclass(hint, BaseModel):
        return "table"
    return WORDS[hint]


def default_of(name: str, field: FieldInfo) -> str:
    """What a key is when it is not given."""
    tops = (Scene.model_fields.get(name), Study.model_fields.get(name))
    if name in FROM_FILE and any(field is top for top in tops):
        return FROM_FILE[name]
    if field.is_required():
        return "must be given"
    value = field.get_default(call_default_factory=True)
    if value is None:
        return ""
    if isinstance(value, BaseModel):
        kind = getattr(value, "kind", None)
        return "" if kind is None else f'`"{kind}"`'
    if isinstance(value, bool):
        return f"`{str(value).lower()}`"
    if isinstance(value, int | float):
        return f"`{value:g}`"
    if isinstance(value, str):
        return f'`"{value}"`'
    return f"`[{', '.join(f'{part:g}' for part in value)}]`" if value else ""


def meaning_of(model: type[Table], name: str) -> str:
    """What the docstrings of a table and of those that it is made from say of a key."""
    for ancestor in model.__mro__:
        told = meanings(ancestor.__dict__.get("__doc__"))
        if name in told:
            return told[name]
    return ""


def rows(model: type[Table], but: frozenset[str] = frozenset({"kind"})) -> list[list[str]]:
    """The keys of a table, but some: name, type with its limits, default, meaning."""
    hints = hints_of(model)
    return [
        [f"`{name}`", said(hints[name]), default_of(name, field), plain(meaning_of(model, name))]
        for name, field in model.model_fields.items()
        if name not in but
    ]


def told(model: type[Table], but: frozenset[str] = frozenset({"kind"})) -> list[str]:
    """Paragraphs of a table's docstring without its own name, and its keys."""
    keys = rows(model, but)
    first, *others = (plain(paragraph) for paragraph in prose(model.__doc__))
    first = re.sub(r"^\\\[.*?\]: ", "", first)
    text = [first[:1].upper() + first[1:], *others]
    return [*text, table(HEAD, keys)] if keys else text


def common(models: list[type[Table]]) -> type[Table] | None:
    """The table with keys that all of several tables are made from."""
    shared = [c for c in models[0].__mro__ if all(issubclass(model, c) for model in models)]
    found = next((c for c in shared if issubclass(c, Table)), Table)
    return found if found.model_fields and found not in models else None


def section(hint: Any) -> list[str]:
    """What there is to say of the values of a key that are tables."""
    return of_kinds(list(dict.fromkeys(tables_in(hint))))


def of_kinds(models: list[type[Table]]) -> list[str]:
    """What there is to say of tables that a key may hold."""
    if len(models) == 1:
        return told(models[0])
    base = common(models)
    text = [] if base is None else told(base)
    but = frozenset({"kind"} | set(base.model_fields if base else ()))
    for model in models:
        kinds = " or ".join(f'"{kind}"' for kind in kind_of(model))
        text += [f"**`kind = {kinds}`**" if kinds else "**One's own**", *told(model, but)]
    return text


def holders(model: type[Table]) -> Iterator[tuple[str, Any]]:
    """The keys of a table that hold tables, at any depth, and their types."""
    hints = hints_of(model)
    for name in model.model_fields:
        inner = list(dict.fromkeys(tables_in(hints[name])))
        if inner:
            yield name, hints[name]
        for one in inner:
            yield from holders(one)


def study() -> str:
    """The keys of a study."""
    return page(Study)


def page(root: type[Table] = Scene) -> str:
    """The keys of the top, then a section for each table of a scene, and for what is in them."""
    hints = hints_of(root)
    tables = {name: hint for name, hint in hints.items() if any(True for _ in tables_in(hint))}
    text = [table(HEAD, rows(root, frozenset(tables)))]
    inner: dict[tuple[type[Table], ...], list[str]] = {}
    for name, hint in tables.items():
        many = get_origin(unwrapped(hint)) is tuple
        text += [f"## `[[{name}]]`" if many else f"## `[{name}]`", *section(hint)]
        for model in dict.fromkeys(tables_in(hint)):
            for key, held in holders(model):
                names = inner.setdefault(tuple(dict.fromkeys(tables_in(held))), [])
                names += [key] if key not in names else []
    for models, names in inner.items():
        text += [f"## {', '.join(f'`{name}`' for name in names)}", *of_kinds(list(models))]
    return "\n\n".join(text)
