"""Packages that can be called: `flowborne.scenes` is one, and `flowborne.scenes()` lists scenes."""

from __future__ import annotations

import sys
from collections.abc import Callable
from importlib import import_module
from types import ModuleType
from typing import Any


def calls(package: str, module: str, function: str) -> None:
    """Make an imported package callable, with the help of the function that this calls: `function`
    of `module`, which is imported then."""

    class Called(ModuleType):
        def __call__(self, *given: Any, **named: Any) -> Any:
            return self.__wrapped__(*given, **named)

        @property
        def __wrapped__(self) -> Callable[..., Any]:
            found: Callable[..., Any] = getattr(import_module(module), function)
            return found

        @property
        def __doc__(self) -> str | None:  # type: ignore[override]
            return self.__wrapped__.__doc__

    sys.modules[package].__class__ = Called
