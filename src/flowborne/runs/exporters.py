"""Exporters: a run as a file of another kind, by the ending of its name."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from importlib import import_module
from pathlib import Path
from pkgutil import iter_modules
from typing import NamedTuple, Protocol, TypeVar

from flowborne.base.registry import Registry
from flowborne.runs.open_run import StoredRun

Class = TypeVar("Class", bound=type)

FORMATS = "flowborne.formats"
"""Package of flowborne's own exporters. Imported by name: it is above this room."""


class Written(NamedTuple):
    """What an exporter has written.

    files  all of them
    note   a sentence to tell with them, such as how near they are to the run; may be empty
    """

    files: tuple[Path, ...]
    note: str = ""


class Exporter(Protocol):
    """Writes a run as a file."""

    def write(self, run: StoredRun, path: Path) -> Written | None:
        """Write the whole run to `path`; None stands for that one file and no note."""
        ...


EXPORTERS: Registry[Exporter] = Registry("exporter", ("write",), keys=("file",))
"""All exporters that are in use, by the ending of the files that they write: ".csv"."""


_own: dict[str, str] = {}
"""Endings of flowborne's own exporters -> their modules."""


def provided(ending: str) -> Callable[[Class], Class]:
    """Class decorator of flowborne's own exporters; a user's for the same ending stays."""

    def add(exporter: Class) -> Class:
        _own[ending] = exporter.__module__
        return exporter if ending in EXPORTERS else EXPORTERS.register(ending)(exporter)

    return add


@cache
def own_exporters() -> dict[str, str]:
    """Endings of flowborne's own exporters -> their modules, which are imported."""
    for module in iter_modules(import_module(FORMATS).__path__):
        import_module(f"{FORMATS}.{module.name}")
    return dict(sorted(_own.items()))


def endings() -> tuple[str, ...]:
    """Endings that can be written."""
    own = own_exporters()
    return (*own, *(kind for kind in EXPORTERS.kinds if kind not in own))


def can_write(ending: str) -> bool:
    """Whether there is an exporter for an ending."""
    return ending in endings()
