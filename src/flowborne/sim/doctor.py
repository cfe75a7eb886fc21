"""Checks of this machine and its libraries: `flowborne doctor`."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, metadata, requires, version
from pathlib import Path
from tempfile import TemporaryDirectory

from packaging.requirements import Requirement

from flowborne.base.extras import REINSTALL_MUJOCO, missing_to_draw
from flowborne.view.space.opengl import REMEDY

FOR_DEVELOPERS = ("all", "browser", "test")
"""Extras that are not reported: they serve development, or repeat others."""

DRAWING = "from flowborne.sim.doctor import draw_sphere; draw_sphere()"
"""Code of the process that draws a picture: a driver that crashes only ends that process."""

PIXELS = 64
"""Width and height of the test pictures."""

DRAWING_TIMEOUT = 120.0
"""Maximum time for drawing the test picture, s."""


@dataclass(frozen=True)
class Finding:
    """Result of a check.

    what    part of the machine that was checked
    found   its version or state, or the fault
    remedy  what to do about a fault; empty without one
    needed  whether a run needs this part
    """

    what: str
    found: str
    remedy: str = ""
    needed: bool = True

    @property
    def missing(self) -> bool:
        """Whether it prevents a run."""
        return self.needed and bool(self.remedy)

    def line(self) -> str:
        """The result in one line."""
        state = "missing" if self.missing else "optional" if self.remedy else "ok"
        found = f"{self.found}; {self.remedy}" if self.remedy else self.found
        return f"{state:<8}  {self.what:<12}  {found}"


def findings() -> Iterator[Finding]:
    """The result of each check, as soon as it is known."""
    for what in CHECKS:
        yield finding(what)
    for extra, required in sorted(extras().items()):
        lacking = [said for each in required if (said := lack(each))]
        remedy = f"pip install 'flowborne[{extra}]'" if lacking else ""
        found = ", ".join(lacking or (f"{each.name} {version(each.name)}" for each in required))
        yield Finding(f"[{extra}]", found, remedy, needed=False)


def finding(what: str) -> Finding:
    """The result of one of CHECKS; any error is one."""
    look, remedy, needed = CHECKS[what]
    try:
        return Finding(what, look(), needed=needed)
    except Exception as error:
        said = " ".join(str(error).split()) or type(error).__name__
        return Finding(what, said, remedy, needed)


def versions_here() -> str:
    """Versions of all libraries that affect the results."""
    from flowborne.runs.summary import versions

    return ", ".join(f"{name} {number}" for name, number in versions().items())


def libraries() -> str:
    """Number of libraries that every run needs. Raises ImportError with the missing ones."""
    needed = requirements()
    lacking = [said for each in needed if (said := lack(each))]
    if lacking:
        raise ImportError(", ".join(lacking))
    return f"all {len(needed)} that a run needs"


def mujoco_here() -> str:
    """Version of MuJoCo, after its equations of a step have been tested.

    `mujoco` and `mujoco-core` install the same folder: the files of the one installed last remain,
    and uninstalling one breaks the other.
    raises  OSError if both are installed at different versions
    """
    from flowborne.solids.engine import identity_error, mujoco

    here = f"{mujoco.__version__}, whose step is off by {identity_error():.0e} of the forces"
    try:
        other, core = version("mujoco"), version("mujoco-core")
    except PackageNotFoundError:
        return here
    folder = Path(mujoco.__file__).parent
    shared = f"mujoco {other} and mujoco-core {core} share the folder {folder}"
    if other != core:
        raise OSError(f"{shared}, and the MuJoCo in it is {mujoco.__version__}")
    return f"{here}; {shared}, so uninstall both or none"


def kernels() -> str:
    """Folder of compiled kernels, after one has been compiled or loaded from there."""
    import numpy as np

    from flowborne.kernels.faces import largest_size

    if largest_size(np.array([[[1.0, -3.0, 2.0]]])) != 3.0:
        raise ArithmeticError("a compiled kernel computes wrongly")
    folder = largest_size.outer.stats.cache_path
    if not os.access(folder, os.W_OK):
        raise OSError(f"compiled kernels cannot be kept in {folder}")
    return f"compiled, and kept in {folder}"


def threads() -> str:
    """Number of threads of large kernels, and the library that provides them."""
    from flowborne.kernels.jit import allowed_threads, cores, kernel_threads, numba_layer

    with kernel_threads():
        most = allowed_threads()
    if numba_layer() == "workqueue":
        raise OSError("neither TBB nor OpenMP is there, and one trial at a time has threads")
    return f"{most} for large kernels, {cores()} cores, from {numba_layer()}"


def memory() -> str:
    """Size of the machine's memory, if the system reports it."""
    from flowborne.runs.summary import machine_memory

    size = machine_memory()
    return "not reported by this system" if size is None else f"{size / 1e9:.1f} GB"


def films() -> str:
    """Formats of films, after one of two frames has been written and read in each."""
    if missing_to_draw() is not None:
        raise OSError("what draws films is not installed")
    import imageio_ffmpeg  # type: ignore[import-untyped]
    import numpy as np

    from flowborne.view.film import CODING, film_file

    frames = np.zeros((2, PIXELS, PIXELS, 4), np.uint8)
    frames[1] = 255
    with TemporaryDirectory() as folder:
        for ending in CODING:
            path = Path(folder) / f"film{ending}"
            with film_file(path, (PIXELS, PIXELS), 24.0) as send:
                for frame in frames:
                    send(frame)
            count, _ = imageio_ffmpeg.count_frames_and_secs(str(path))
            if count != len(frames):
                raise OSError(f"{count} of {len(frames)} frames are in a film in {ending}")
    return f"{', '.join(CODING)} by ffmpeg {imageio_ffmpeg.get_ffmpeg_version()}"


def opengl() -> str:
    """Class and renderer of 3D pictures, after one has been drawn in a separate process."""
    if missing_to_draw() is not None:
        raise OSError("what draws films is not installed")
    command = [sys.executable, "-c", DRAWING]
    done = subprocess.run(command, capture_output=True, text=True, timeout=DRAWING_TIMEOUT)
    if done.returncode < 0:
        raise OSError(f"drawing ends in a crash ({signal.Signals(-done.returncode).name})")
    if done.returncode:
        raise OSError(done.stderr.strip().rpartition("\n")[2])
    return done.stdout.strip()


def draw_sphere() -> None:
    """Draw a sphere off screen and print the renderer, or exit with the reason for a failure."""
    import pyvista

    from flowborne.view.space.opengl import off_screen

    try:
        plotter = off_screen(PIXELS, PIXELS)
    except ValueError as error:
        sys.exit(str(error).removesuffix(f"; {REMEDY}"))
    plotter.add_mesh(pyvista.Sphere(), color="white")
    plotter.set_background("black")
    picture = plotter.screenshot(return_img=True)
    if picture.min() == picture.max():
        sys.exit("a picture of a sphere is empty")
    lines = plotter.render_window.ReportCapabilities().splitlines()
    names = [line.partition(":")[2].strip() for line in lines if "renderer string" in line]
    print(", ".join([plotter.render_window.GetClassName(), *names]))


def extras() -> dict[str, list[Requirement]]:
    """Extra of flowborne -> the libraries that it installs on this system."""
    try:
        names = metadata("flowborne").get_all("Provides-Extra") or []
    except PackageNotFoundError:
        return {}
    brought = {name: requirements(name) for name in names if name not in FOR_DEVELOPERS}
    return {name: asked for name, asked in brought.items() if asked}


def requirements(extra: str = "") -> list[Requirement]:
    """Requirements of flowborne on this system, or the further ones of an extra.

    raises  PackageNotFoundError if flowborne itself is not installed
    """
    return [
        each
        for each in map(Requirement, requires("flowborne") or ())
        if ("extra" in str(each.marker)) == bool(extra)
        and (each.marker is None or each.marker.evaluate({"extra": extra}))
    ]


def lack(requirement: Requirement) -> str:
    """Why a required library cannot be used; empty if it can."""
    try:
        number = version(requirement.name)
    except PackageNotFoundError:
        return f"{requirement.name} is not installed"
    if requirement.specifier.contains(number, prereleases=True):
        return ""
    return f"{requirement.name} {number} is not {requirement.specifier}"


CHECKS: dict[str, tuple[Callable[[], str], str, bool]] = {
    "versions": (versions_here, "install flowborne again with pip install flowborne", True),
    "libraries": (libraries, "install them with pip install flowborne", True),
    "MuJoCo": (mujoco_here, REINSTALL_MUJOCO, True),
    "kernels": (
        kernels,
        "let NUMBA_CACHE_DIR name a folder that can be written, or install numba again",
        True,
    ),
    "threads": (
        threads,
        "install TBB with pip install tbb, or OpenMP (on Debian and Ubuntu libgomp1)",
        False,
    ),
    "memory": (memory, "", False),
    "films": (films, "install it with pip install 'flowborne[film]'; runs go without film", False),
    "OpenGL": (opengl, REMEDY, False),
}
"""Part of the machine -> function that returns its state or raises an error that describes a fault,
what to do about a fault, and whether a run needs the part."""
