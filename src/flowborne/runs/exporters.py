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
"""Ending -> module of flowborne.formats that registers it, imported when it is first asked for."""


class Written(NamedTuple):
    """What an exporter has written.

    files  all of them
    note   a sentence to tell with them, such as how near they are to the run; may be empty
    """

    files: tuple[Path, ...]
    note: str = ""


class Exporter(Protocol):
    """Writes a run as a file."""

    def write(self, run: OpenRun, path: Path) -> Written | None:
        """Write the whole run to `path`; None stands for that one file and no note."""
        ...


EXPORTERS: Registry[Exporter] = Registry("exporter", ("write",), keys=("file",))
"""All exporters that are in use, by the ending of the files that they write: ".csv"."""


def provided(ending: str) -> Callable[[Class], Class]:
    """Class decorator of flowborne's own exporters; a user's for the same ending stays."""
    return EXPORTERS.register(ending) if ending not in EXPORTERS else lambda exporter: exporter


def endings() -> tuple[str, ...]:
    """Endings that can be written."""
    return (*FORMATS, *(kind for kind in EXPORTERS.kinds if kind not in FORMATS))


def can_write(ending: str) -> bool:
    """Whether there is an exporter for an ending, one's own before flowborne's."""
    if ending not in EXPORTERS and ending in FORMATS:
        # by name, for formats see scenes and bodies, which stand above this room
        import_module(f"flowborne.formats.{FORMATS[ending]}")
    return ending in EXPORTERS
