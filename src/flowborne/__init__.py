"""flowborne: creatures that answer the fluid around them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from flowborne.version import __version__

if TYPE_CHECKING:
    from flowborne.running import run
    from flowborne.scenes.load import load_scene
    from flowborne.simulation import Simulation

__all__ = ["Simulation", "__version__", "load_scene", "run"]

_PLACES = {
    "Simulation": "flowborne.simulation",
    "load_scene": "flowborne.scenes.load",
    "run": "flowborne.running",
}


def __getattr__(name: str) -> Any:
    """Import what is asked for when it is asked for, so that `import flowborne` is light."""
    if name not in _PLACES:
        raise AttributeError(f"module 'flowborne' has no attribute {name!r}")
    from importlib import import_module

    return getattr(import_module(_PLACES[name]), name)


def __dir__() -> list[str]:
    return sorted(set(globals()) | set(__all__))
