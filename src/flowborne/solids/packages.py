"""Where the files are that a model names by a package of ROS."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from pathlib import Path
from urllib.parse import unquote
from xml.etree import ElementTree

ADDRESS = re.compile(r"(?:package|model):/+([^/]+)/(.+)")
"""Name of a package, and a path in it."""


def is_address(given: str) -> bool:
    """Whether a file is named by its package or as a URL, not by a path."""
    return given.startswith(("package:", "model:", "file:"))


def located(given: str, model: Path, packages: Sequence[Path]) -> Path:
    """The file that an address means.

    A package is looked for in the folders above the model, then in `packages`; each of them may
    hold its folder, or be the folder.
    raises  ValueError where it is not found
    """
    if given.startswith("file:"):
        return Path(unquote(re.sub("^file:/*", "/", given)))
    address = ADDRESS.fullmatch(given)
    if address is None:
        raise ValueError(f"'{given}' names no file. Write it as package://package/path.")
    name, path = address.groups()
    for folder in (*model.resolve().parents, *packages):
        for root in _roots(folder, name):
            if (root / path).is_file():
                return root / path
    raise ValueError(
        f"{given} is in none of the folders above the model. Name the folder that holds the "
        f"package '{name}' by packages in [solids]."
    )


def _roots(folder: Path, name: str) -> Iterator[Path]:
    """What may be the folder of a package in a folder that may hold it or be it."""
    yield folder / name
    if folder.name == name or _name(folder / "package.xml") == name:
        yield folder


def _name(manifest: Path) -> str:
    """The name in a package.xml; "" where there is none."""
    try:
        return (ElementTree.parse(manifest).findtext("name") or "").strip()
    except (OSError, ElementTree.ParseError):
        return ""
