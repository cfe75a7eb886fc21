"""The process that reads a binary USD file first, and may end by it."""

from __future__ import annotations

import sys
from contextlib import suppress
from pathlib import Path

from flowborne.characters.usd import UsdSource
from flowborne.errors import SceneError

LARGEST_MEMORY = 8 << 30
"""Bytes of addresses that reading may take, where the system can be asked for that."""


def main(path: Path) -> None:
    """Read all that an import reads. What is wrong with it is said by the process that asks."""
    if sys.platform != "win32":
        import resource

        resource.setrlimit(resource.RLIMIT_AS, (LARGEST_MEMORY, LARGEST_MEMORY))
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    with suppress(SceneError):
        source = UsdSource(path, probed=True)
        _ = source.rig, source.surface
        for clip in range(len(source.clips)):
            with suppress(SceneError):
                source.action(clip)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
