"""Exporters: a run as a file of another kind, by the ending of its name."""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from typing import NamedTuple, Protocol, TypeVar

from flowborne.registry import Registry
from flowborne.runs.open_run import OpenRun

Class = TypeVar("Class", bound=type)

FORMATS = {
    ".bvh": "bvh",
    ".usd": "usd",
    ".usda": "usd",
    ".usdc": "usd",
    ".glb": "glb",
    ".abc": "abc",
    ".vdb": "vdb",
    ".vtkhdf": "vtkhdf",
    ".csv": "table",
    ".parquet": "table",
}
"""Ending -> module of flowborne.formats that registers it, imported on first use."""


class Written(NamedTuple):
    """The result of an exporter.

    files  all files that it has written
    note   a sentence for the user, such as how exactly they match the run; may be empty
    """

    files: tuple[Path, ...]
    note: str = ""


class Exporter(Protocol):
    """Writes a run as a file."""

    def write(self, run: OpenRun, path: Path) -> Written | None:
        """Write the whole run to `path`; None means that one file and no note."""
        ...


EXPORTERS: Registry[Exporter] = Registry("exporter", ("write",), keys=("file",))
"""All loaded exporters, by the ending of their files, such as ".csv"."""


def provided(ending: str) -> Callable[[Class], Class]:
    """Class decorator of flowborne's exporters; a user's exporter for the same ending is kept."""
    return EXPORTERS.register(ending) if ending not in EXPORTERS else lambda exporter: exporter


def endings() -> tuple[str, ...]:
    """Endings with an exporter."""
    return (*FORMATS, *(kind for kind in EXPORTERS.kinds if kind not in FORMATS))


def can_write(ending: str) -> bool:
    """Whether there is an exporter for an ending; a user's comes before flowborne's."""
    if ending not in EXPORTERS and ending in FORMATS:
        # by name, because formats import scenes and bodies, which are above this room
        import_module(f"flowborne.formats.{FORMATS[ending]}")
    return ending in EXPORTERS
