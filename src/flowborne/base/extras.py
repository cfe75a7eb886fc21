"""Optional libraries, and which extra of flowborne to install if one is missing."""

from __future__ import annotations

from importlib import import_module
from importlib.metadata import PackageNotFoundError, distribution
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from flowborne.base.errors import SceneError

DRAWING = {
    "imageio": "imageio",
    "imageio_ffmpeg": "imageio-ffmpeg",
    "matplotlib": "Matplotlib",
    "pyvista": "PyVista",
}
"""Modules that films and pictures are drawn with -> their packages."""

REINSTALL_MUJOCO = (
    "pip uninstall --yes mujoco mujoco-core, then pip install 'mujoco-core>=4.0.1,<5' "
    "(programs that need mujoco find MuJoCo there, too)"
)
"""How to mend an installation of MuJoCo."""


def optional(module: str, package: str, extra: str, what: str, verb: str = "made") -> Any:
    """A module that may not be installed.

    package  that it is in
    extra    of flowborne that brings it
    what     is made by it, in the plural, for the message; `verb` says what else is done by it
    raises   SceneError when it is not there
    """
    try:
        return import_module(module)
    except ImportError:
        raise _missing(package, extra, what, verb) from None


def _missing(package: str, extra: str, what: str, verb: str) -> SceneError:
    return SceneError(
        f"{what} are {verb} by {package}, which is not installed. "
        f"Install it with: pip install 'flowborne[{extra}]'."
    )


def flesh_library() -> Any:
    """PyVista, by which flesh is meshed. Raises SceneError when it is not there."""
    return optional("pyvista", "PyVista", "flesh", "meshes of flesh")


def check_mesher() -> None:
    """Raise SceneError where fTetWild is not installed; a process of its own imports it."""
    if find_spec("pytetwild") is None:
        raise _missing("pytetwild", "flesh", "meshes of flesh", "made")


def assimp() -> Path:
    """The folder with Assimp's bin and lib, by which .fbx files are read. Raises SceneError when it
    is not there."""
    try:
        return Path(str(distribution("cmeel-assimp").locate_file("cmeel.prefix")))
    except PackageNotFoundError:
        package = "cmeel-assimp (for Linux and macOS)"
        raise _missing(package, "fbx", "characters in '.fbx' files", "read") from None


def missing_to_draw() -> str | None:
    """One sentence where films cannot be drawn here, None where all is installed for them."""
    missing = [package for module, package in DRAWING.items() if find_spec(module) is None]
    if not missing:
        return None
    return (
        f"films and pictures need {', '.join(missing)}; install them with: "
        "pip install 'flowborne[film]'"
    )


def check_drawing() -> None:
    """Raise SceneError where films cannot be drawn here."""
    missing = missing_to_draw()
    if missing is not None:
        raise SceneError(f"{missing}.")
