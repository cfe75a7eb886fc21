"""Pictures and films of runs in the pages of notebooks."""

from __future__ import annotations

from base64 import b64encode
from dataclasses import dataclass
from html import escape
from pathlib import Path

from flowborne.runs.run_folder import RunFolder

TAGS = {
    ".mp4": '<video controls loop src="data:video/mp4;base64,{}"></video>',
    ".webp": '<img src="data:image/webp;base64,{}">',
    ".png": '<img width="480" src="data:image/png;base64,{}">',
}
"""Ending of a file -> how a page shows its content."""


def embedded(path: Path) -> str:
    """HTML that shows a picture or a film; "" if there is none."""
    if not path.is_file():
        return ""
    return TAGS[path.suffix.lower()].format(b64encode(path.read_bytes()).decode())


def run_html(line: str, folder: Path) -> str:
    """HTML of a run: a line about it, and its preview if it has one."""
    return f"<p>{escape(line)}</p>{embedded(RunFolder(folder).picture)}"


@dataclass(frozen=True)
class Film:
    """A film in a file, which a notebook shows.

    path  of the file; of a sequence of images frames_0000.png and so on it is frames.png
    """

    path: Path

    def __repr__(self) -> str:
        return f"Film {self.path}"

    def __fspath__(self) -> str:
        return str(self.path)

    def _repr_html_(self) -> str:
        return embedded(self.path) or escape(str(self.path))
