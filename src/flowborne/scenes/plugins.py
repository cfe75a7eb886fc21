"""Importing the Python files that a scene names, which register the user's own parts."""

from __future__ import annotations

import sys
from importlib.machinery import PathFinder
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from typing import Any

from flowborne.base.errors import PartError, SceneError
from flowborne.base.given import read_file

LOADED: dict[str, bytes] = {}
"""Module -> text of the file that it was made from."""

_FOLDERS: list[str] = []
"""Folders of plugins, added to sys.path for worker processes, which import by name."""


def load_plugins(raw: dict[str, Any], folder: Path, file: str) -> list[str]:
    """Import the files that a scene as read names in `plugins`; returns the problems.

    A file is a module of its own name, found from the scene's folder: `reach.py` is `reach`.

    folder  of the scene file
    file    its name, for messages
    """
    named = raw.get("plugins", [])
    if not isinstance(named, list) or not all(isinstance(name, str) for name in named):
        return []  # the schema says so
    problems = []
    for number, name in enumerate(named, start=1):
        try:
            _load(folder / name)
        except SceneError as error:
            problems += [f"scene {file}, plugins {number}: {text}" for text in error.problems]
    return problems


def _load(path: Path) -> None:
    """Import a file as a module, once. Raises SceneError when that cannot be done."""
    name = path.stem
    if path.suffix != ".py" or not name.isidentifier():
        raise SceneError(f"'{path.name}' is no Python module. Name a file such as reach.py.")
    try:
        text = read_file(path)
    except OSError as error:
        raise SceneError(f"file {path} cannot be read: {error.strerror}. Put it there.") from None
    if name in LOADED:
        if LOADED[name] != text:
            raise SceneError(
                f"another file {path.name} is in use already. Give one of them another name."
            )
        return
    folder = str(path.parent.resolve())
    own = {*_FOLDERS, folder}
    elsewhere = [place for place in sys.path if str(Path(place).resolve()) not in own]
    taken = name in sys.modules or name in sys.stdlib_module_names
    if taken or PathFinder.find_spec(name, elsewhere) is not None:
        raise SceneError(
            f"'{name}' is the name of another Python module, too. Give the file a name of its own."
        )
    spec = spec_from_file_location(name, path)
    assert spec is not None
    assert spec.loader is not None
    sys.modules[name] = module_from_spec(spec)
    try:
        with PartError.guarding(f"plugin '{path.name}'"):
            spec.loader.exec_module(sys.modules[name])
    except BaseException as error:
        del sys.modules[name]
        if isinstance(error, PartError):
            raise SceneError(f"{error}.") from error
        raise
    LOADED[name] = text
    if folder not in sys.path:
        _FOLDERS.append(folder)
        sys.path.append(folder)
