"""Builds sdists and wheels, and tries the wheels in fresh environments: `make dist`.

Every Python of those that flowborne supports and that this machine has gets an environment of its
own, with all that the wheel of flowborne depends on, then that of its validation.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tarfile
import zipfile
from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory

ROOT = Path(__file__).parents[1]
SUPPORTED = ("3.11", "3.12", "3.13", "3.14")

COMMANDS = (
    ("--version",),
    ("scenes",),
    ("check", "ns-block-drag-max"),
    ("doctor",),
    ("run", "ns-block-drag-max", "--frames", "2", "--out", "run"),
)
"""What a fresh environment must be able to do."""

VALIDATION = ROOT / "validation"
CASES = (("validate", "--case", "F6"), ("bench", "--help"))
"""And with the wheel of the validation."""


def interpreters() -> dict[str, str]:
    """Version -> path of its interpreter, where it is on the PATH or kept by pyenv."""
    found = {}
    for version in SUPPORTED:
        for python in _places(f"python{version}", version):
            if subprocess.run([python, "--version"], capture_output=True).returncode == 0:
                found[version] = python
                break
    return found


def _places(name: str, version: str) -> Iterator[str]:
    on_path = shutil.which(name)
    if on_path is not None:
        yield on_path
    kept = Path(os.environ.get("PYENV_ROOT", Path.home() / ".pyenv")) / "versions"
    yield from (str(path) for path in sorted(kept.glob(f"{version}.*/bin/{name}")))


def build(folder: Path, source: Path = ROOT) -> tuple[Path, Path]:
    """(sdist, wheel) of a source tree, put into `folder`; the wheel is built from the sdist.

    What builds them is that of this environment: nothing is fetched.
    """
    command = ["-m", "build", "--no-isolation", "--outdir", str(folder), str(source)]
    _run([sys.executable, *command], ROOT)
    (sdist,), (wheel,) = folder.glob("*.tar.gz"), folder.glob("*.whl")
    return sdist, wheel


def members(archive: Path) -> set[str]:
    """Names of the files of a wheel, or of an sdist without its first folder."""
    if archive.suffix == ".whl":
        with zipfile.ZipFile(archive) as wheel:
            return set(wheel.namelist())
    with tarfile.open(archive) as sdist:
        return {file.name.partition("/")[2] for file in sdist if file.isfile()}


def environment(python: str, folder: Path) -> str:
    """Path of the interpreter of a new and empty environment for `python`."""
    _run([python, "-m", "venv", "--without-pip", str(folder)], ROOT)
    return str(folder / ("Scripts" if os.name == "nt" else "bin") / "python")


def install(python: str, wheel: Path, *options: str) -> None:
    """Install a wheel into the environment of `python`, by the pip of this one."""
    pip = [sys.executable, "-m", "pip", "--quiet", "--python", python, "install"]
    _run([*pip, *options, str(wheel)], ROOT)


def flowborne(python: str, folder: Path, *arguments: str) -> str:
    """What the command prints in an environment, started in `folder`."""
    return _run([python, "-m", "flowborne", *arguments], folder)


def _run(command: list[str], folder: Path) -> str:
    """Output of a command that sees no other source tree.

    raises  RuntimeError with all that it said when it fails
    """
    clean = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
    done = subprocess.run(command, cwd=folder, env=clean, capture_output=True, text=True)
    if done.returncode:
        raise RuntimeError(f"{' '.join(command)}:\n{done.stdout}{done.stderr}")
    return done.stdout


def main() -> None:
    """Build into dist/, then try the wheel in one environment after the other."""
    shutil.rmtree(ROOT / "dist", ignore_errors=True)
    sdist, wheel = build(ROOT / "dist" / "flowborne")
    its_sdist, its_wheel = build(ROOT / "dist" / "validation", VALIDATION)
    print(*(file.name for file in (sdist, wheel, its_sdist, its_wheel)), sep="\n")
    for version, interpreter in interpreters().items():
        with TemporaryDirectory() as place:
            python = environment(interpreter, Path(place) / "environment")
            install(python, wheel)
            for arguments in (*COMMANDS, *CASES):
                if arguments is CASES[0]:
                    install(python, its_wheel)
                print(f"Python {version}: flowborne {' '.join(arguments)}", flush=True)
                flowborne(python, Path(place), *arguments)


if __name__ == "__main__":
    main()
