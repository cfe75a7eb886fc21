"""Objectives and winds that a user wrote as functions: "module:function" in a scene."""

from __future__ import annotations

import importlib
import inspect
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from flowborne.base.errors import PartError, SceneError
from flowborne.kernels.arrays import Array


def find_function(name: str) -> Callable[..., Any]:
    """The function "module:function". Raises SceneError when Python does not find it."""
    module, _, function = name.partition(":")
    try:
        with PartError.guarding(f"module '{module}'", ModuleNotFoundError):
            imported = importlib.import_module(module)
        found = getattr(imported, function)
    except ModuleNotFoundError as error:
        raise SceneError(
            f"Python does not find module '{error.name}' of '{name}'. "
            "Install it, put its folder on PYTHONPATH, or name its file in plugins."
        ) from None
    except AttributeError:
        raise SceneError(
            f"module '{module}' has no function '{function}'. Correct the name."
        ) from None
    except PartError as error:
        raise SceneError(f"{error}.") from error
    if not callable(found):
        raise SceneError(f"'{name}' is {found!r} and no function. Correct the name.")
    return found


def with_parameters(name: str, parameters: Mapping[str, Any]) -> Callable[..., Any]:
    """The function "module:function" with these parameters set.

    raises  SceneError when there is no such function, or when it does not take one of them
    """
    function = find_function(name)
    if not parameters:
        return function
    try:
        inspect.signature(function).bind_partial(**parameters)
    except (TypeError, ValueError) as error:
        raise SceneError(f"function '{name}': {error}. Correct the parameters.") from None
    return partial(function, **parameters)


@dataclass(frozen=True)
class WindFunction:
    """A wind by a function of the user's own; see `WindField`.

    function  (x (n, 3) in m, time in s) -> (n, 3) m/s
    name      for messages
    """

    function: Callable[..., Any]
    name: str

    def __call__(self, x: Array, time: float) -> Array:
        """(n, 3) velocity in m/s at the places x (n, 3). Raises PartError when it is not that."""
        with PartError.guarding(f"wind '{self.name}'"):
            given = self.function(x, time)
        try:
            velocity = np.asarray(given, dtype=np.float64)
        except (TypeError, ValueError):
            raise PartError(
                f"wind '{self.name}' gave a {type(given).__name__} that is no array of numbers: "
                "return velocities, a row (3,) for each place"
            ) from None
        if velocity.shape not in ((3,), x.shape) or not np.isfinite(velocity).all():
            raise PartError(
                f"wind '{self.name}' gave an array of shape {velocity.shape}, or numbers that are "
                f"not finite, for {len(x)} places: return finite velocities, a row (3,) for each"
            )
        return np.broadcast_to(velocity, x.shape)
