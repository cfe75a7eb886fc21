"""Runs as files for other programs, and how to add a kind of file.

An exporter is a dataclass with `write(run, path)`, registered by the ending of its files. It is
used by `flowborne export`, by `flowborne.export`, and by `exports` in a scene's `[output]`.
"""

from __future__ import annotations

from flowborne.io.atomic import write_atomically
from flowborne.io.exporters import EXPORTERS, Exporter, endings
from flowborne.io.open_run import OpenRun

__all__ = ["Exporter", "OpenRun", "endings", "register", "write_atomically"]

register = EXPORTERS.register
