"""Characters of .fbx files: Assimp converts them to glTF, which is read and checked like any other.

As a program, it becomes Assimp under a limit of memory.

source  Open Asset Import Library, command line tool of the package cmeel-assimp
"""

from __future__ import annotations

import os
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

from flowborne.base.extras import assimp
from flowborne.characters.apart import check_bytes, limit_memory, run_apart
from flowborne.characters.gltf import GltfSource
from flowborne.characters.limits import wrong

OPTIONS = ("-fglb2", "-gs", "-lbw")
"""Format of the result; lengths in metres; the four largest weights of each vertex, which is as
many as Assimp writes."""

REFUSAL = "Failed to load file: "
"""What Assimp prints before the reason."""


def read_fbx(path: Path) -> GltfSource:
    """A file's skeleton, surface and clips.

    raises  SceneError when Assimp is not installed or cannot read the file, and like GltfSource
    """
    assimp()
    check_bytes(path.stat().st_size, path.name)
    with TemporaryDirectory() as folder:
        made = Path(folder) / path.name  # the name in messages
        status, said = run_apart(__name__, "FBX", path, str(made))
        if status or not made.is_file():
            reason = said.rpartition(REFUSAL)[2].strip() if REFUSAL in said else ""
            reason = " ".join(reason.split())[:150] or "reading it crashes the process"
            raise wrong(f"{path.name} cannot be read as FBX: {reason.rstrip('.')}")
        return GltfSource(made)


def convert(file: str, made: str) -> None:
    """Replace this process by Assimp, which writes a .glb file `made` of `file`."""
    prefix = assimp()
    libraries = str(prefix / "lib")
    limit_memory()
    os.execve(
        prefix / "bin" / "assimp",
        ["assimp", "export", file, made, *OPTIONS],
        os.environ | {"LD_LIBRARY_PATH": libraries, "DYLD_LIBRARY_PATH": libraries},
    )


if __name__ == "__main__":
    convert(sys.argv[1], sys.argv[2])
