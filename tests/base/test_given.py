"""Only regular files are read, and only up to a size."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from flowborne.base.given import MOST_BYTES, check_file, read_file, read_json, read_toml


def made(kind: str, folder: Path) -> Path:
    """Something that is no file to read."""
    path = folder / kind
    if kind == "pipe":
        os.mkfifo(path)
    elif kind == "folder":
        path.mkdir()
    elif kind == "device":
        path = Path("/dev/zero")
    elif kind == "MB":
        with open(path, "wb") as file:
            file.truncate(MOST_BYTES + 1)
    return path


@pytest.mark.parametrize("kind", ["pipe", "folder", "device", "MB"])
def test_what_has_no_end_is_refused_before_it_is_read(kind: str, tmp_path: Path) -> None:
    path = made(kind, tmp_path)
    for read in (check_file, read_file):
        with pytest.raises(OSError, match=kind):
            read(path)


def test_what_is_too_large_is_refused_with_its_size(tmp_path: Path) -> None:
    (tmp_path / "a").write_bytes(b"x" * 2**20)
    assert len(read_file(tmp_path / "a")) == 2**20
    with pytest.raises(OSError, match=r"it has 1 MB, and 0.5 MB are the most"):
        read_file(tmp_path / "a", 2**19)


def test_what_is_nested_deep_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "deep"
    path.write_text("[" * 100_000 + "]" * 100_000)
    with pytest.raises(ValueError, match="deep is nested hundreds deep"):
        read_json(path)
    path.write_text("a = " + "[" * 3000 + "]" * 3000)
    with pytest.raises(ValueError, match="deep is nested hundreds deep"):
        read_toml(path)
