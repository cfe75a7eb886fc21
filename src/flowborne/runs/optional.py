"""Libraries that only some files need, and that come with an extra of flowborne."""

from __future__ import annotations

from importlib import import_module
from typing import Any

from flowborne.errors import SceneError


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
        raise SceneError(
            f"{what} are {verb} by {package}, which is not installed. "
            f"Install it with: pip install 'flowborne[{extra}]'."
        ) from None
