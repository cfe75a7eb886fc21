# SPDX-License-Identifier: GPL-3.0-or-later
"""The Python environment in which flowborne is installed: the user's, or one made here."""

from __future__ import annotations

import sys
from pathlib import Path

from .process import JobError, Process, State

OLDEST = 3, 11
"""Python that flowborne needs."""

QUIET = ("--no-input", "--disable-pip-version-check", "--progress-bar", "off")


def engine_command(place: str) -> tuple[str, ...]:
    """The command of flowborne in an environment.

    place   folder of the environment, its Python, or its program `flowborne`
    raises  JobError when there is none
    """
    path = Path(place).expanduser()
    if path.is_dir():
        inside = ("bin/python", "Scripts/python.exe", "bin/flowborne", "Scripts/flowborne.exe")
        path = next((path / name for name in inside if (path / name).is_file()), path)
    if not place or not path.is_file():
        raise JobError(
            f"there is no flowborne in '{place}'. In the preferences of the extension, press Make "
            "Environment, or name the folder of an environment with flowborne"
        )
    return (str(path),) if path.stem == "flowborne" else (str(path), "-m", "flowborne")


class Install(Process):
    """An environment with flowborne, made by `python -m venv` and pip. All in it is replaced.

    folder  of the environment; the log is next to it
    """

    def __init__(self, folder: Path) -> None:
        super().__init__(folder.with_suffix(".log"))
        self.folder, self._source = folder, Path()

    def start(self, source: str) -> None:
        """Start with the Python of Blender.

        source  what pip installs: the folder or a wheel of flowborne
        raises  JobError when this cannot work
        """
        if sys.version_info < OLDEST:
            has, needs = (".".join(map(str, pair)) for pair in (sys.version_info[:2], OLDEST))
            raise JobError(
                f"the Python of this Blender is {has}, and flowborne needs {needs} or later: make "
                "an environment with another Python in a terminal, and name its folder"
            )
        self._source, self.message = Path(source).expanduser(), ""
        is_wheel = self._source.suffix == ".whl" and self._source.is_file()
        if not source or not (is_wheel or (self._source / "pyproject.toml").is_file()):
            raise JobError(
                f"'{self._source}' is no folder and no wheel of flowborne: name one in Install From"
            )
        self.log.parent.mkdir(parents=True, exist_ok=True)
        self.log.unlink(missing_ok=True)
        self._spawn(State.CREATING, [sys.executable, "-m", "venv", "--clear", str(self.folder)])

    @property
    def line(self) -> str:
        """What is done, with the last line of pip."""
        return f"{self.state.value}: {self._said(1)}" if self.active else super().line

    def _ended(self, code: int) -> None:
        doing = self.state
        try:
            flowborne = engine_command(str(self.folder))
        except JobError:  # venv has failed, or was cancelled
            super()._ended(code or 1)
            return
        if code == 0 and doing is State.CREATING:
            pip = [flowborne[0], "-m", "pip", "install", *QUIET, f"{self._source}[flesh]"]
            self._spawn(State.INSTALLING, pip)
        elif code == 0 and doing is State.INSTALLING:
            self._spawn(State.TRYING, [*flowborne, "--version"])
        elif code == 0 and doing is State.TRYING:
            self.state = State.DONE
        else:
            super()._ended(code)
        if self.state is State.FAILED:
            self.message = (
                f"{doing.value} failed; all that was printed is in {self.log}\n{self.message}"
            )
