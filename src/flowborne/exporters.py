"""Runs as files for other programs, and how to add a kind of file.

An exporter is a dataclass with `write(run, path)`, registered by the ending of its files. It is
used by `flowborne export`, by `flowborne.export`, and by `exports` in a scene's `[output]`. One
that is registered for an ending of flowborne's own takes its place. docs/exporters.md lists those
that flowborne brings.
"""

from __future__ import annotations

from flowborne.files.atomic import replaced_whole, write_atomically
from flowborne.runs.exporters import EXPORTERS, Exporter, Written, endings
from flowborne.runs.open_run import OpenRun
from flowborne.runs.states import StateArray

__all__ = [
    "Exporter",
    "OpenRun",
    "StateArray",
    "Written",
    "endings",
    "register",
    "replaced_whole",
    "write_atomically",
]

register = EXPORTERS.register
