"""The window without a screen in which VTK draws, or why there is none."""

from __future__ import annotations

import ctypes
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from pyvista import Plotter

LAST_RESORT = "vtkOSOpenGLRenderWindow"
"""Class of window that VTK makes when no other works, whether it has a library for it or not."""

MESA = ("libOSMesa.so.8", "libOSMesa.so.6", "libOSMesa.so")
"""Names of the library that this window needs; without it the first rendering is a crash."""

REMEDY = (
    "install OpenGL (on Debian and Ubuntu libegl1 and libgl1-mesa-dri, or libosmesa6), "
    "then draw with flowborne film"
)


def off_screen(width: int, height: int) -> Plotter:
    """Empty plotter of so many pixels that needs no screen. Close it after use.

    raises  ValueError when this machine has no OpenGL
    """
    try:
        import pyvista
        from vtkmodules.vtkCommonCore import vtkLogger
    except ImportError as error:
        raise ValueError(f"three dimensions cannot be drawn ({error}); {REMEDY}") from error
    with _silent(vtkLogger):
        plotter = pyvista.Plotter(off_screen=True, window_size=(width, height), lighting="none")
    if plotter.render_window.GetClassName() == LAST_RESORT and not _loads(MESA):
        plotter.close()
        raise ValueError(
            "three dimensions cannot be drawn without OpenGL, and neither libEGL nor libOSMesa "
            f"works here; {REMEDY}"
        )
    return plotter


@contextmanager
def _silent(log: Any) -> Iterator[None]:
    """Keep VTK from telling of each kind of window that it tries in vain."""
    before = log.GetCurrentVerbosityCutoff()
    log.SetStderrVerbosity(log.VERBOSITY_OFF)
    try:
        yield
    finally:
        log.SetStderrVerbosity(before)


def _loads(libraries: tuple[str, ...]) -> bool:
    for library in libraries:
        try:
            ctypes.CDLL(library)
        except OSError:
            continue
        return True
    return False
