"""The off-screen window in which VTK draws, or the reason why there is none."""

from __future__ import annotations

import ctypes
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from pyvista import Plotter

LAST_RESORT = "vtkOSOpenGLRenderWindow"
"""Class of VTK's window if no other works, even if its library is missing."""

MESA = ("libOSMesa.so.8", "libOSMesa.so.6", "libOSMesa.so")
"""Names of the library of that window; without it the first rendering crashes."""

REMEDY = (
    "install OpenGL (on Debian and Ubuntu libegl1 and libgl1-mesa-dri, or libosmesa6), "
    "then draw with flowborne film"
)


def import_renderer() -> None:
    """Import PyVista and VTK. Raises ValueError if they cannot be imported."""
    try:
        import pyvista  # noqa: F401
    except ImportError as error:
        raise ValueError(f"three dimensions cannot be drawn ({error}); {REMEDY}") from error


def off_screen(width: int, height: int) -> Plotter:
    """Empty off-screen plotter of a size in pixels. Close it after use.

    raises  ValueError if this machine has no OpenGL
    """
    import_renderer()
    import pyvista
    from vtkmodules.vtkCommonCore import vtkLogger

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
    """Suppress VTK's messages about the kinds of windows that fail."""
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
