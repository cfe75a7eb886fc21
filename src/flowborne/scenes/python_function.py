"""Objectives and winds that a user wrote: "module:function" in a scene."""

from __future__ import annotations

import importlib
from collections.abc import Callable
from typing import Any

from flowborne.errors import SceneError


def find_function(name: str) -> Callable[..., Any]:
    """The function "module:function". Raises SceneError when Python does not find it."""
    module, _, function = name.partition(":")
    try:
        found = getattr(importlib.import_module(module), function)
    except ModuleNotFoundError as error:
        raise SceneError(
            f"Python does not find module '{error.name}' of '{name}'. "
            "Install it, or put its folder on PYTHONPATH."
        ) from None
    except AttributeError:
        raise SceneError(
            f"module '{module}' has no function '{function}'. Correct the name."
        ) from None
    except Exception as error:
        raise SceneError(
            f"module '{module}' cannot be imported ({type(error).__name__}: {error}). Mend it."
        ) from error
    if not callable(found):
        raise SceneError(f"'{name}' is {found!r} and no function. Correct the name.")
    return found
