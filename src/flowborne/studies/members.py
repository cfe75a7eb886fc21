"""The members of a study: runs of its scene, and the files that keep their results.

<id>.csv    history of a finished run
<id>.json   how it ended; written last, so that a member with this file is finished

The id is a digest of the scene, the settings and the version of flowborne: a change of the study
repeats only what it changes.
"""

from __future__ import annotations

import hashlib
import json
import threading
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from time import perf_counter

from flowborne.base.atomic import write_atomically, write_json
from flowborne.base.errors import PartError, SceneError, described
from flowborne.base.given import read_json
from flowborne.base.version import __version__
from flowborne.kernels.arrays import Array
from flowborne.kernels.jit import kernel_threads
from flowborne.runs.history import history_columns, read_history
from flowborne.runs.run_folder import RunFolder, RunFolderError, reading
from flowborne.scenes.load import load_scene
from flowborne.scenes.save import scene_files
from flowborne.sim.endings import COMPLETE, RunOutcome
from flowborne.sim.running import run

FAILED = "failed"
"""Outcome of a member without a run: its scene is wrong, or its process died."""

_one_at_a_time = threading.Lock()
"""Held by a run: its limit of BLAS threads is of the whole process."""


@dataclass(frozen=True)
class Ended:
    """How a member ended.

    outcome  of its run, in lower case, or FAILED
    message  what is wrong, without it ""
    cells    of its grid; None without a fluid
    seconds  that it took
    """

    outcome: str
    message: str
    cells: int | None = None
    seconds: float = 0.0

    @property
    def is_complete(self) -> bool:
        return self.outcome in COMPLETE


def scene_digest(scene: str, settings: Mapping[str, str]) -> str:
    """Digest of a scene with all its files, and of the version that runs it."""
    digest = hashlib.sha256(__version__.encode())
    for name, content in sorted(scene_files(load_scene(scene, settings)).items()):
        digest.update(f"{name} {len(content)} ".encode() + content)
    return digest.hexdigest()


def member_id(scene: str, settings: Mapping[str, str]) -> str:
    """Name of a member, from the digest of its scene and the TOML texts of its keys."""
    text = json.dumps([scene, sorted(settings.items())])
    return hashlib.sha256(text.encode()).hexdigest()[:16]


def run_member(scene: str, settings: Mapping[str, str], threads: int) -> tuple[Ended, bytes] | None:
    """Run a member in a worker: how it ended, and its history; None if it was interrupted.

    threads  for its kernels
    """
    began = perf_counter()
    with _one_at_a_time, kernel_threads(threads), TemporaryDirectory() as thrown_away:
        folder = RunFolder(Path(thrown_away) / "run")
        try:
            result = run(load_scene(scene, settings), folder.path, workers=1, film=False)
        except KeyboardInterrupt:
            return None
        except (PartError, RunFolderError, SceneError) as error:
            return Ended(FAILED, str(error)), b""
        except Exception as error:
            return Ended(FAILED, described(error)), b""
        outcome, cells = result.outcome.name.lower(), result.summary["cells"]
        message = "" if result.outcome is RunOutcome.DONE else result.message.split("; ")[0]
        message = message.replace(f"are in {folder.path}", "are there")
        ended = Ended(outcome, message, cells, perf_counter() - began)
        return ended, folder.history.read_bytes()


class Members:
    """The finished members in a folder."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        folder.mkdir(parents=True, exist_ok=True)

    def get(self, name: str) -> Ended | None:
        """How a member ended; None if it has not."""
        path = self.folder / f"{name}.json"
        if not path.exists():
            return None
        with reading(self.folder.parent):
            return Ended(**read_json(path))

    def history(self, name: str, columns: Sequence[str]) -> dict[str, Array]:
        """Column -> (frames,) numbers of a complete member, of those columns that it has."""
        path = self.folder / f"{name}.csv"
        with reading(self.folder.parent):
            known = history_columns(path)
            return read_history(path, [column for column in columns if column in known])

    def keep(self, name: str, ended: Ended, history: bytes) -> None:
        """Write the files of a finished member, each whole or not at all."""
        if history:
            write_atomically(self.folder / f"{name}.csv", lambda file: file.write(history))
        write_json(self.folder / f"{name}.json", asdict(ended))

    def forget(self, name: str) -> None:
        """Remove a member, so that it is run again."""
        for ending in ("json", "csv"):
            (self.folder / f"{name}.{ending}").unlink(missing_ok=True)
