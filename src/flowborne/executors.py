"""Where the trials of a decision run."""

from __future__ import annotations

from flowborne.control.executors import Foreign, Mapper, Processes, Serial, Threads, mapper

__all__ = ["Foreign", "Mapper", "Processes", "Serial", "Threads", "mapper"]
