"""The files that an MJCF model names."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from xml.etree import ElementTree
from xml.etree.ElementTree import Element

from flowborne.given_files import check_file, read_file

FOLDER_KEYS = {
    "mesh": ("meshdir", "assetdir"),
    "hfield": ("assetdir",),
    "skin": ("assetdir",),
    "texture": ("texturedir", "assetdir"),
}
"""Element that names a file -> compiler attributes that say where its folder is, first wins."""

MOST_NESTED = 500
"""Elements of a model in each other; readers and writers of it call themselves for each."""


def parsed(text: bytes | str) -> Element:
    """A model's text as a tree.

    raises  ElementTree.ParseError for what is no XML, ValueError for one nested too deep
    """
    root = ElementTree.fromstring(text)
    level, depth = [root], 0
    while level:
        level, depth = [child for element in level for child in element], depth + 1
    if depth > MOST_NESTED:
        raise ValueError(
            f"its elements are nested {depth} deep, and {MOST_NESTED} is the most. Put fewer in "
            "each other."
        )
    return root


def parts(path: Path) -> Iterator[tuple[Path, Element]]:
    """A model and all that it includes, each once: file and tree.

    raises  OSError for a file that cannot be read, else as `parsed`
    """
    pending, seen = [path], set[Path]()
    while pending:
        part = pending.pop()
        if part.resolve() in seen:
            continue
        seen.add(part.resolve())
        root = parsed(read_file(part))
        yield part, root
        included = (element.get("file") for element in root.iter("include"))
        pending += [path.parent / name for name in included if name]


def folders(path: Path) -> dict[str, str]:
    """Element -> folder in which its files are, as the compiler elements of a model say."""
    given: dict[str, str] = {}
    for _, root in parts(path):
        for element in root.iter("compiler"):
            given |= element.attrib
    return {
        tag: next((given[key] for key in keys if key in given), "")
        for tag, keys in FOLDER_KEYS.items()
    }


def check_named(path: Path) -> None:
    """Raise OSError for a file that a model names and that is none, or too large to be read."""
    given = folders(path)
    for _, root in parts(path):
        for element in root.iter():
            for key in element.attrib:
                if key.startswith("file") and element.attrib[key] and element.tag != "include":
                    check_file(path.parent / given.get(element.tag, "") / element.attrib[key])
