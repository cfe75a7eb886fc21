"""The folder of a run: its files, and the lock for writing.

scene.toml       the scene as run, every default written out; the model's files beside it
history.csv      a row per frame
summary.json     the result of the run; its key "flowborne" marks the folder as a run's
states/          NNNNNN.npz, the data to draw a frame; 000000 is the start
checkpoint.npz   the whole state of the last saved frame
model.json       the bodies' geometry and the skin of flesh, to draw them
preview.png      the last frame
preview.mp4      the film
.lock            empty; locked by the process that writes the run
"""

from __future__ import annotations

import errno
import json
import os
import re
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from filelock import FileLock, Timeout

from flowborne.base.atomic import partial_name, write_json
from flowborne.base.errors import SceneError
from flowborne.base.given import FileError, possible_name, read_json, read_toml
from flowborne.base.version import __version__

MARK = "flowborne"
"""Key of summary.json that marks a run folder."""

RUNNING = "running"
"""Outcome in summary.json of an unfinished run."""

FIXED_NAMES = (
    "scene.toml",
    "history.csv",
    "checkpoint.npz",
    "model.json",
    "preview.png",
    "preview.mp4",
    "summary.json",
)
"""Files of every run; the mark is last, so that a partly removed folder is still a run's."""

LOCK_NAME = ".lock"

OWN_NAMES = (*FIXED_NAMES, LOCK_NAME, "states")
"""Names that are reserved in a run folder."""

STATE_NAME = re.compile(r"\d{6,}\.npz")
PARTIAL_STATE_NAME = re.compile(r"\.\d{6,}\.npz\.partial")

UNREADABLE = (
    ArithmeticError,
    AttributeError,
    LookupError,
    OSError,
    SceneError,
    TypeError,
    ValueError,
)
"""Errors from reading a damaged file of a run."""


class RunFolderError(Exception):
    """A run cannot be written or found; the text says why and what to do."""


class RunFolder:
    """The paths in a run folder."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.scene = path / "scene.toml"
        self.history = path / "history.csv"
        self.summary = path / "summary.json"
        self.states = path / "states"
        self.checkpoint = path / "checkpoint.npz"
        self.model = path / "model.json"
        self.picture = path / "preview.png"
        self.film = path / "preview.mp4"

    @classmethod
    def create(cls, path: Path, *, replace: bool = False) -> RunFolder:
        """Folder for a new run, with its mark and no other file of a run.

        replace  replace an earlier run; only files that a run writes are removed
        raises   RunFolderError when the folder is in use or cannot be written
        """
        folder = cls(path)
        folder.check_new(replace=replace)
        try:
            folder.states.mkdir(parents=True, exist_ok=True)
            folder._remove_partial()
            if folder.is_run():
                folder._remove_run()
            folder.mark([])
        except OSError as error:
            raise cannot_write(path, error) from error
        return folder

    @classmethod
    def existing(cls, path: Path) -> RunFolder:
        """Folder of an earlier run. Raises RunFolderError for any other folder."""
        folder = cls(path)
        check_name(path)
        if not path.is_dir():
            raise RunFolderError(f"there is no folder {path}; give the folder of an earlier run")
        if not folder.is_run():
            raise RunFolderError(f"{path} is not the folder of a run; give one that a run has made")
        return folder

    @contextmanager
    def locked(self) -> Iterator[None]:
        """Context in which no other process writes a run here; a missing folder is created.

        A folder that is empty at the end is removed. The lock ends with the process.
        raises  RunFolderError when a run is being written here, or the folder cannot be made
        """
        lock = FileLock(self.path / LOCK_NAME, blocking=False)
        try:
            self.path.mkdir(parents=True, exist_ok=True)
            lock.acquire()
        except Timeout:
            raise RunFolderError(
                f"another run is being written into {self.path}; wait for its end, or name "
                "another folder"
            ) from None
        except OSError as error:
            raise cannot_write(self.path, error) from error
        try:
            yield
        finally:
            if self.path.is_dir() and all(e.name == LOCK_NAME for e in self.path.iterdir()):
                (self.path / LOCK_NAME).unlink(missing_ok=True)
                self.path.rmdir()
            lock.release()

    def check_writable(self) -> None:
        """Raise RunFolderError unless the run here can be resumed."""
        self.check_links()
        if not os.access(self.path, os.W_OK):
            raise RunFolderError(f"{self.path} cannot be written; make it and its files writable")

    def check_links(self) -> None:
        """Raise RunFolderError where something in the folder is a symbolic link.

        A run that writes or removes by such a name would do so somewhere else.
        """
        for place, folders, files in os.walk(self.path):
            for name in (*folders, *files):
                if (found := Path(place) / name).is_symlink():
                    raise RunFolderError(
                        f"{found} is a symbolic link, and a run writes and removes nothing behind "
                        "one; remove the link, or name another folder"
                    )

    def check_new(self, *, replace: bool) -> None:
        """Raise RunFolderError unless a new run may be written here; touches nothing."""
        path = self.path
        check_name(path)
        if path.exists() and not path.is_dir():
            raise RunFolderError(f"{path} is a file; name a folder")
        if not path.exists():
            above = next(parent for parent in path.absolute().parents if parent.exists())
            if not above.is_dir() or not os.access(above, os.W_OK | os.X_OK):
                raise RunFolderError(
                    f"{path} cannot be made, because {above} cannot be written; name another folder"
                )
            return
        if not os.access(path, os.W_OK | os.X_OK):
            raise RunFolderError(f"{path} cannot be written; name another folder")
        if self.is_run():
            if not replace:
                raise RunFolderError(
                    f"{path} holds an earlier run; continue it with resume=True, start it "
                    "again with replace=True, or name another folder"
                )
        elif not self._is_empty():
            raise RunFolderError(
                f"{path} is not empty and was not made by a run; name another folder"
            )
        self.check_links()

    def is_run(self) -> bool:
        """Whether a run has made this folder. Raises RunFolderError if it may not be read."""
        try:
            summary = read_json(self.summary)
        except PermissionError:
            raise RunFolderError(f"{self.summary} cannot be read; make it readable") from None
        except (OSError, ValueError):
            return False
        return isinstance(summary, dict) and MARK in summary

    def is_unfinished(self) -> bool:
        """Whether a run is being written here, or was and has been killed."""
        return self.is_run() and self.read_summary().get("outcome") == RUNNING

    def mark(self, model_files: list[str]) -> None:
        """Say in summary.json that a run is being written here.

        model_files  names of the files that the run copies beside scene.toml
        """
        self.write_summary({"outcome": RUNNING, "model_files": model_files})

    def write_summary(self, summary: dict[str, Any]) -> None:
        write_json(self.summary, {MARK: __version__, **summary})

    def mark_ended(self, outcome: str, message: str) -> None:
        """Say in summary.json how a run ended, on a disc without room for another file: over its
        present content, which keeps its block. Raises OSError where even that cannot be written."""
        before = self.summary.read_bytes()
        ended = {"outcome": outcome, "message": message, "model_files": self.model_files()}
        content = json.dumps({MARK: __version__, **ended}, ensure_ascii=False).encode()
        with open(self.summary, "r+b", buffering=0) as file:
            try:
                written = file.write(content)
                if written < len(content):
                    raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
                file.truncate()
            except OSError:
                file.seek(0)
                file.write(before)
                file.truncate()
                raise

    def read_summary(self) -> dict[str, Any]:
        summary: dict[str, Any] = read_json(self.summary)
        return summary

    def read_scene(self) -> dict[str, Any]:
        """scene.toml as nested dictionaries; raises RunFolderError when it cannot be read."""
        with reading(self.path):
            return read_toml(self.scene)

    def model_files(self) -> list[str]:
        """Names of the files that this run has copied beside its scene, none outside the folder
        and none that no file can have."""
        copied = self.read_summary().get("model_files", []) if self.is_run() else []
        names = [str(name) for name in copied] if isinstance(copied, list) else []
        paths = [Path(name) for name in names if _is_possible(name)]
        return [str(path) for path in paths if not path.is_absolute() and ".." not in path.parts]

    def remove(self) -> None:
        """Remove everything that a run has written here, and the folder when it is then empty.

        raises  RunFolderError where a link has been put into it since the run began
        """
        self.check_links()
        self._remove_partial()
        self._remove_run()
        for path in (self.states, self.path):
            if path.is_dir() and not any(path.iterdir()):
                path.rmdir()

    def state(self, frame: int) -> Path:
        """File of the state after `frame` frames."""
        return self.states / f"{frame:06d}.npz"

    def drop_states_after(self, frame: int) -> None:
        """Remove the states of later frames, and what was half-written."""
        for path in self.state_files():
            if int(path.stem) > frame:
                path.unlink()
        self._remove_partial()

    def bytes_used(self) -> int:
        """Bytes of the files here that a run wrote."""
        if not self.is_run():
            return 0
        paths = [*self._named_files(), *self.state_files()]
        return sum(path.stat().st_size for path in paths)

    def _names(self) -> list[str]:
        """Names of the files of this run outside states/; the mark is the last."""
        return [*self.model_files(), *FIXED_NAMES]

    def _named_files(self) -> list[Path]:
        return [self.path / name for name in self._names() if (self.path / name).is_file()]

    def state_files(self) -> list[Path]:
        """Files of the existing states, in order."""
        if not self.states.is_dir():
            return []
        return sorted(path for path in self.states.iterdir() if STATE_NAME.fullmatch(path.name))

    def _is_empty(self) -> bool:
        """Whether only remains of a run that was killed at its start are here."""
        return all(
            (entry == self.states and entry.is_dir() and not any(entry.iterdir()))
            or entry.name in (LOCK_NAME, partial_name(self.summary.name))
            for entry in self.path.iterdir()
        )

    def _remove_run(self) -> None:
        paths = [*self.state_files(), *self._named_files()]
        for path in paths:
            path.unlink()
        for folder in {path.parent for path in paths} - {self.path, self.states}:
            if not any(folder.iterdir()):
                folder.rmdir()

    def _remove_partial(self) -> None:
        for name in self._names():
            path = self.path / name
            path.with_name(partial_name(path.name)).unlink(missing_ok=True)
        for path in list(self.states.iterdir()) if self.states.is_dir() else []:
            if PARTIAL_STATE_NAME.fullmatch(path.name):
                path.unlink()


@contextmanager
def reading(folder: Path) -> Iterator[None]:
    """Context in which errors from damaged files of a run become a RunFolderError."""
    try:
        yield
    except UNREADABLE as error:
        first = error.problems[0] if isinstance(error, SceneError) else str(error)
        said = f"it lacks {first}" if isinstance(error, KeyError) else first.rstrip(".")
        said, remedy = f"{folder} cannot be read ({said})", "start the run again with replace=True"
        if not is_damage(error.__cause__ or error):
            remedy = "make them readable"
        elif isinstance(error, SceneError):
            remedy = f"correct that, or if they are damaged {remedy}"
        raise RunFolderError(f"the files of run {said}; {remedy}") from error


def is_damage(error: BaseException) -> bool:
    """Whether a file of a run is damaged or gone, and the system does not just refuse it."""
    return not isinstance(error, OSError) or isinstance(error, FileNotFoundError | FileError)


def _is_possible(name: str) -> bool:
    try:
        return bool(possible_name(name))
    except ValueError:
        return False


def check_name(path: Path) -> None:
    """Raise RunFolderError for an impossible path of a folder."""
    try:
        path.exists()
    except OSError as error:
        raise RunFolderError(
            f"{str(path)[:60]} ... is no name of a folder ({error.strerror}); shorten it"
        ) from None


def cannot_write(path: Path, error: OSError) -> RunFolderError:
    """The error to raise when the system refuses to write into `path`."""
    return RunFolderError(f"{path} cannot be written ({error.strerror}); name another folder")


def write_remedy(error: Exception) -> str:
    """What to do where the system refuses to read or write the files of a run."""
    full = getattr(error, "errno", 0) in (errno.ENOSPC, errno.EDQUOT)
    return "make room" if full else "make the folder and its files readable and writable"


def make_folder(path: Path) -> None:
    """Create a folder if it is missing. Raises RunFolderError when it is not writable."""
    try:
        path.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise cannot_write(path, error) from error
    if not os.access(path, os.W_OK | os.X_OK):
        raise RunFolderError(f"{path} cannot be written; name another folder")


def check_space(path: Path, needed: int) -> None:
    """Raise RunFolderError when the disc that holds `path` has less than `needed` bytes free."""
    place = path.absolute()
    while not place.exists():
        place = place.parent
    free = shutil.disk_usage(place).free
    if free < needed:
        raise RunFolderError(
            f"the run needs about {needed / 1e6:.0f} MB in {path} and {free / 1e6:.0f} MB are "
            "free; make room, run fewer frames, or name another folder"
        )
