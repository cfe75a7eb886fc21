"""The reader of a character's file, by its extension."""

from __future__ import annotations

from pathlib import Path
from typing import Protocol

from flowborne.base.errors import SceneError
from flowborne.base.extras import optional
from flowborne.characters.rig import Action, Rig, Surface

GLTF, USD = (".glb", ".gltf", ".vrm"), (".usd", ".usda", ".usdc", ".usdz")
FORMATS = (*GLTF, ".fbx", *USD)


class Source(Protocol):
    """The content of a file.

    clips     names of the clips
    rig       the skeleton
    surface   None when no mesh is bound to the skeleton
    left_out  names of meshes that are not bound to it
    """

    @property
    def clips(self) -> tuple[str, ...]: ...

    @property
    def rig(self) -> Rig: ...

    @property
    def surface(self) -> Surface | None: ...

    @property
    def left_out(self) -> tuple[str, ...]: ...

    def action(self, clip: int) -> Action:
        """A clip by its number in `clips`."""


def read_source(path: Path) -> Source:
    """The skeleton, surface and clips of a file.

    raises  SceneError when it is missing, of another format, or cannot be read
    """
    ending = path.suffix.lower()
    if ending in (".xml", ".mjcf", ".urdf"):
        raise SceneError(
            f"{path.name} is a model, which needs no import. Write a scene with model = "
            f'"{path.name}" under [solids].'
        )
    if ending not in FORMATS:
        raise SceneError(
            f"{path.name} is none of {', '.join(FORMATS)}. Export the character in one of these "
            "formats."
        )
    try:
        if not path.is_file():
            raise SceneError(f"there is no file {path}. Correct its name.")
    except PermissionError as error:
        raise SceneError(f"{path} cannot be read: {error.strerror}. Mend that.") from error
    if ending in GLTF:
        from flowborne.characters.gltf import GltfSource

        return GltfSource(path)
    if ending == ".fbx":
        from flowborne.characters.fbx import read_fbx

        return read_fbx(path)
    optional("pxr.Usd", "usd-core", "usd", f"characters in '{ending}' files", verb="read")
    from flowborne.characters.usd import UsdSource

    return UsdSource(path)


def clip_number(source: Source, clip: str | None, name: str) -> int:
    """Index of the clip with a name, or of the only clip.

    name    of the file, for messages
    raises  SceneError when there is no clip, none of that name, or several and no name is given
    """
    if not source.clips:
        raise SceneError(
            f"{name} has no clip. Name a file with clips for the same joints as its animations."
        )
    if clip is None and len(source.clips) > 1:
        raise SceneError(
            f"{name} has {len(source.clips)} clips. Name one as the clip: "
            f"{', '.join(source.clips)}."
        )
    if clip is not None and clip not in source.clips:
        raise SceneError(f"{name} has no clip '{clip}'. It has: {', '.join(source.clips)}.")
    return 0 if clip is None else source.clips.index(clip)
