"""What flowborne finds on this machine, and what is missing: `flowborne doctor`."""

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

from flowborne.extras import missing_to_draw
from flowborne.view.space.opengl import REMEDY

FOR_DEVELOPERS = ("all", "browser", "test")
"""Extras that bring nothing to a user that others do not."""

DRAWING = "from flowborne.doctor import draw_sphere; draw_sphere()"
"""Code of the process that draws a picture: a driver that crashes ends that process alone."""

PIXELS = 64
"""Width and height of the pictures that are tried."""

PATIENCE = 120.0
"""s after which a picture that is not drawn is given up."""


@dataclass(frozen=True)
class Finding:
    """One part of the machine.

    what    it is
    found   what is there, or what is wrong with it
    remedy  what to do about that; empty where it works
    needed  whether a run needs it
    """

    what: str
    found: str
    remedy: str = ""
    needed: bool = True

    @property
    def missing(self) -> bool:
        """Whether a run cannot do its work for it."""
        return self.needed and bool(self.remedy)

    def line(self) -> str:
        """All of it, for people."""
        state = "missing" if self.missing else "optional" if self.remedy else "ok"
        told = f"{self.found}; {self.remedy}" if self.remedy else self.found
        return f"{state:<8}  {self.what:<12}  {told}"


@dataclass(frozen=True)
class Check:
    """How a part of the machine is tried.

    look    what is there, in a few words; raises with what is wrong
    remedy  what to do about that
    """

    what: str
    look: Callable[[], str]
    remedy: str
    needed: bool = True

    def finding(self) -> Finding:
        try:
            return Finding(self.what, self.look(), needed=self.needed)
        except Exception as error:  # whatever is wrong is what is looked for
            said = " ".join(str(error).split()) or type(error).__name__
            return Finding(self.what, said, self.remedy, self.needed)


def findings() -> Iterator[Finding]:
    """Every part of the machine, as soon as it has been tried."""
    for check in CHECKS:
        yield check.finding()
    for extra, required in sorted(extras().items()):
        lacking = [said for each in required if (said := lack(each))]
        remedy = f"pip install 'flowborne[{extra}]'" if lacking else ""
        found = ", ".join(lacking or map(installed, required))
        yield Finding(f"[{extra}]", found, remedy, needed=False)


def versions_here() -> str:
    """Versions of what the numbers depend on."""
    from flowborne.runs.summary import versions

    return ", ".join(f"{name} {number}" for name, number in versions().items())


def libraries() -> str:
    """The libraries that every run needs. Raises ImportError with those that are not there."""
    needed = requirements()
    lacking = [said for each in needed if (said := lack(each))]
    if lacking:
        raise ImportError(", ".join(lacking))
    return f"all {len(needed)} that a run needs"


def kernels() -> str:
    """Where compiled kernels are kept, after one has been compiled, or taken from there."""
    import numpy as np

    from flowborne.kernels.vectors import largest

    if largest(np.array([1.0, 3.0, 2.0])) != 3.0:
        raise ArithmeticError("a compiled kernel computes wrongly")
    folder = largest.serial.stats.cache_path
    if not os.access(folder, os.W_OK):
        raise OSError(f"compiled kernels cannot be kept in {folder}")
    return f"compiled, and kept in {folder}"


def threads() -> str:
    """Threads of large kernels, and the library that they come from."""
    from flowborne.kernels.jit import allowed_threads, cores, kernel_threads, numba_layer

    with kernel_threads():
        most = allowed_threads()
    if numba_layer() == "workqueue":
        raise OSError("neither TBB nor OpenMP is there, and one trial at a time has threads")
    return f"{most} for large kernels, {cores()} cores, from {numba_layer()}"


def memory() -> str:
    """Size of the machine's memory, where the system tells."""
    if "SC_PHYS_PAGES" not in getattr(os, "sysconf_names", {}):
        return "this system does not tell how much"
    size = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    return f"{size / 1e9:.1f} GB"


def films() -> str:
    """Films of two frames, written as those of a run and read again, in every kind of file."""
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
    """What draws three dimensions, after it has drawn a picture in a process of its own."""
    if missing_to_draw() is not None:
        raise OSError("what draws films is not installed")
    command = [sys.executable, "-c", DRAWING]
    done = subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE)
    if done.returncode < 0:
        raise OSError(f"drawing ends in a crash ({signal.Signals(-done.returncode).name})")
    if done.returncode:
        raise OSError(done.stderr.strip().rpartition("\n")[2])
    return done.stdout.strip()


def draw_sphere() -> None:
    """Draw a sphere off screen and print what has drawn it, or end the process with why not."""
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
    told = plotter.render_window.ReportCapabilities().splitlines()
    names = [line.partition(":")[2].strip() for line in told if "renderer string" in line]
    print(", ".join([plotter.render_window.GetClassName(), *names]))


def extras() -> dict[str, list[Requirement]]:
    """Extra of flowborne -> the libraries that it brings on this system."""
    try:
        names = metadata("flowborne").get_all("Provides-Extra") or []
    except PackageNotFoundError:
        return {}
    brought = {name: requirements(name) for name in names if name not in FOR_DEVELOPERS}
    return {name: asked for name, asked in brought.items() if asked}


def requirements(extra: str = "") -> list[Requirement]:
    """What flowborne asks for on this system, or what an extra asks for besides.

    raises  PackageNotFoundError where flowborne itself is not installed
    """
    found = []
    for each in map(Requirement, requires("flowborne") or ()):
        marker = each.marker
        if ("extra" in str(marker)) != bool(extra):
            continue
        if marker is None or marker.evaluate({"extra": extra}):
            found.append(each)
    return found


def lack(requirement: Requirement) -> str:
    """What is wrong with the library that is asked for, in a few words; empty when nothing is."""
    try:
        number = version(requirement.name)
    except PackageNotFoundError:
        return f"{requirement.name} is not installed"
    if requirement.specifier.contains(number, prereleases=True):
        return ""
    return f"{requirement.name} {number} is not {requirement.specifier}"


def installed(requirement: Requirement) -> str:
    """Name and version of a library."""
    return f"{requirement.name} {version(requirement.name)}"


CHECKS = (
    Check("versions", versions_here, "install flowborne again with pip install flowborne"),
    Check("libraries", libraries, "install them with pip install flowborne"),
    Check(
        "kernels",
        kernels,
        "let NUMBA_CACHE_DIR name a folder that can be written, or install numba again",
    ),
    Check(
        "threads",
        threads,
        "install TBB with pip install tbb, or OpenMP (on Debian and Ubuntu libgomp1)",
        needed=False,
    ),
    Check("memory", memory, "", needed=False),
    Check(
        "films",
        films,
        "install it with pip install 'flowborne[film]'; runs go without film",
        needed=False,
    ),
    Check("OpenGL", opengl, REMEDY, needed=False),
)
"""What every machine is tried for."""
