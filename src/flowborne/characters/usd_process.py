"""The process that reads a binary USD file first, because reading may crash."""

from __future__ import annotations

import sys
from contextlib import suppress
from pathlib import Path

from flowborne.base.errors import SceneError
from flowborne.characters.usd import UsdSource

MAX_MEMORY = 8 << 30
"""Limit of the address space, bytes; Windows has no such limit."""


def main(path: Path) -> None:
    """Read all that an import reads. The calling process reports errors."""
    if sys.platform != "win32":
        import resource

        resource.setrlimit(resource.RLIMIT_AS, (MAX_MEMORY, MAX_MEMORY))
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    with suppress(SceneError):
        source = UsdSource(path, probed=True)
        _ = source.rig, source.surface
        for clip in range(len(source.clips)):
            with suppress(SceneError):
                source.action(clip)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
