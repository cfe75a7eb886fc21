"""Exporters of one's own: a run as a file of another kind, by the ending of its name."""

from __future__ import annotations

from pathlib import Path
from typing import Protocol

from flowborne.io.open_run import OpenRun
from flowborne.registry import Registry

BVH = ".bvh"
"""Ending of the exporter that flowborne brings."""


class Exporter(Protocol):
    """Writes a run as a file."""

    def write(self, run: OpenRun, path: Path) -> None:
        """Write the whole run to `path`."""
        ...


EXPORTERS: Registry[Exporter] = Registry("exporter", ("write",), taken=(BVH,), keys=("file",))
"""Exporters of one's own, by the ending of the files that they write: ".csv"."""


def endings() -> tuple[str, ...]:
    """Endings that can be written."""
    return BVH, *EXPORTERS.kinds
