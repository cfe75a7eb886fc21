"""Kinds of parts that a user adds, by name, to the built-in ones.

A kind is a dataclass. Its fields are the part's parameters, in a scene the keys of its table; its
methods are those of the contract. Once registered it is used in Python by its class and in a scene
by its name, like any other.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import MISSING, fields, is_dataclass
from typing import TYPE_CHECKING, Any, Generic, TypeVar, get_type_hints

if TYPE_CHECKING:
    from pydantic import BaseModel

Part = TypeVar("Part")
Class = TypeVar("Class", bound=type)


class Registry(Generic[Part]):
    """The kinds of one sort of part that users have added.

    what     the sort, for messages: "objective"
    methods  those that the contract asks for
    taken    names of the kinds that flowborne brings
    keys     keys of a scene's table that every kind has, and that no parameter may be called
    given    fields that flowborne gives a part itself, which a scene cannot set
    """

    def __init__(
        self,
        what: str,
        methods: Iterable[str],
        taken: Iterable[str] = (),
        keys: Iterable[str] = (),
        given: Iterable[str] = (),
    ) -> None:
        self.what = what
        self.methods, self.taken = tuple(methods), frozenset(taken)
        self.keys, self.given = frozenset({"kind", *keys}), frozenset(given)
        self._kinds: dict[str, tuple[Callable[..., Part], type[BaseModel]]] = {}

    def __contains__(self, kind: object) -> bool:
        return isinstance(kind, str) and kind in self._kinds

    @property
    def kinds(self) -> tuple[str, ...]:
        """Names of the kinds, in the order in which they came."""
        return tuple(self._kinds)

    def register(self, kind: str) -> Callable[[Class], Class]:
        """Class decorator: a dataclass that the name `kind` stands for.

        The class has the name as its attribute `kind`. A name that is registered again stands for
        the newer class.

        raises  ValueError for a name that flowborne has itself, a class that is no dataclass or
                lacks a method of the contract, a parameter that is called as a key of the table
        """

        def add(part: Class) -> Class:
            if kind in self.taken:
                raise ValueError(f"{self.what} '{kind}' is flowborne's own: take another name")
            if not is_dataclass(part):
                raise ValueError(f"{self.what} '{kind}' is no dataclass: put @dataclass above it")
            for method in self.methods:
                if not callable(getattr(part, method, None)):
                    raise ValueError(f"{self.what} '{kind}' has no method {method}(): add it")
            for name in sorted(self.keys & {field.name for field in fields(part)}):
                raise ValueError(
                    f"{self.what} '{kind}' has a field '{name}', which is a key of every "
                    f"{self.what}: call it otherwise"
                )
            named: Any = part
            named.kind = kind
            self._kinds[kind] = named, self._table(kind, part)
            return part

        return add

    def make(self, kind: str, parameters: Mapping[str, Any], **given: Any) -> Part:
        """A part with these parameters, as a scene has them.

        given   fields that flowborne gives itself
        raises  KeyError for a kind that is not registered; ValueError with all that is wrong with
                the parameters, or with what the class itself says of them
        """
        part, table = self._kinds[kind]
        chosen = self._checked(kind, table, parameters)
        try:
            return part(**given, **chosen)
        except KeyboardInterrupt:
            raise
        except BaseException as error:
            said = str(error) if isinstance(error, Exception) else type(error).__name__
            raise ValueError(f"of kind '{kind}': {said}") from error

    def check(self, kind: str, parameters: Mapping[str, Any]) -> None:
        """Raise what `make` raises, as far as that is known without what flowborne gives."""
        if self.given:
            self._checked(kind, self._kinds[kind][1], parameters)
        else:
            self.make(kind, parameters)

    def _checked(
        self, kind: str, table: type[BaseModel], parameters: Mapping[str, Any]
    ) -> dict[str, Any]:
        from pydantic import ValidationError

        try:
            model = table.model_validate(dict(parameters))
        except ValidationError as error:
            said = "; ".join(_said(problem, table) for problem in error.errors())
            raise ValueError(f"of kind '{kind}': {said}") from None
        return {name: getattr(model, name) for name in model.model_fields_set}

    def _table(self, kind: str, part: type) -> type[BaseModel]:
        """The parameters of a class as a pydantic model that knows their types."""
        from pydantic import ConfigDict, create_model

        hints = get_type_hints(part)
        columns: dict[str, Any] = {}
        for field in fields(part):
            if not field.init or field.name in self.given:
                continue
            optional = field.default is not MISSING or field.default_factory is not MISSING
            columns[field.name] = (hints[field.name], None if optional else ...)
        config = ConfigDict(extra="forbid", allow_inf_nan=False, arbitrary_types_allowed=True)
        return create_model(kind, __config__=config, **columns)


def _said(problem: Mapping[str, Any], table: type[BaseModel]) -> str:
    """One of pydantic's errors, short."""
    name = ".".join(str(key) for key in problem["loc"])
    if problem["type"] == "missing":
        return f"key '{name}' is missing. Add it"
    if problem["type"] == "extra_forbidden":
        known = ", ".join(table.model_fields) or "none"
        return f"unknown key '{name}'. Its keys are: {known}"
    text = str(problem["msg"])
    return f"{name} is {problem['input']!r} ({text[:1].lower() + text[1:]}). Correct it"
