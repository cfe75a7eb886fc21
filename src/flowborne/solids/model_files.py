"""The files that MuJoCo reads for a model, gathered so that they stand on their own.

A model names meshes, height fields, skins, textures, parts to include and models to attach, each
relative to a folder of its compiler elements or to a ROS package. Here they get names in one
folder; MuJoCo and a run folder get exactly these files.
"""

from __future__ import annotations

import posixpath
import re
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from urllib.parse import unquote
from xml.etree import ElementTree
from xml.etree.ElementTree import Element
from xml.parsers import expat
from xml.sax.saxutils import escape

from flowborne.base.given import read_file
from flowborne.solids.model_checks import check_composites, check_kind, check_mesh

ATTRIBUTE = re.compile(rb"\s+([^\s=/>]+)\s*=\s*(\"[^\"]*\"|'[^']*')")

Changes = Mapping[int, Mapping[str, str | None]]
"""Number of an element in text order -> attribute -> new value, None to remove it."""

ADDRESS = re.compile(r"(?:package|model):/+([^/]+)/(.+)")
"""Name of a package, and a path in it."""

ASSETS = "assets"
"""Folder next to the model for all files that it names."""

FOLDER_KEYS = {
    "mesh": ("meshdir", "assetdir"),
    "hfield": ("meshdir", "assetdir"),
    "skin": ("meshdir", "assetdir"),
    "flexcomp": ("meshdir", "assetdir"),
    "texture": ("texturedir", "assetdir"),
    "model": (),
}
"""Element that names a file -> compiler attributes that give its folder."""

FOLDERS = ("assetdir", "meshdir", "texturedir")

LATE_DECLARATION = re.compile(rb"((?:\s|<!--.*?-->)+)(<\?xml\s[^>]*\?>)", re.DOTALL)
"""Blanks and comments, and an XML declaration after them, which XML has at the start."""

MOST_NESTED = 500
"""Deepest nesting of elements; readers and writers recurse once per level."""


def with_attributes(text: bytes, changes: Changes) -> bytes:
    """XML with other values of existing attributes; the rest of the text, with its lines, stays."""
    starts: list[int] = []
    parser = expat.ParserCreate()
    parser.StartElementHandler = lambda *_: starts.append(parser.CurrentByteIndex)
    parser.Parse(text, True)
    pieces, done = [], 0
    for number in sorted(changes):
        name = re.compile(rb"<[^\s/>]+").match(text, starts[number])
        place = name.end() if name else len(text)
        while found := ATTRIBUTE.match(text, place):
            place = found.end()
            key = found[1].decode("utf-8", "replace")
            if key in changes[number]:
                value = changes[number][key]
                pieces += [text[done : found.start(1 if value is None else 2)], _quoted(value)]
                done = place
    return b"".join([*pieces, text[done:]])


def _quoted(value: str | None) -> bytes:
    """A value as it is written after an equals sign; empty for None."""
    if value is None:
        return b""
    return b'"%s"' % escape(value, {'"': "&quot;"}).encode("ascii", "xmlcharrefreplace")


def located(given: str, model: Path, packages: Sequence[Path]) -> Path:
    """The file at an address.

    Packages are searched for in the folders above the model, then in `packages`; each of these may
    contain the folder of the package, or be that folder.
    raises  ValueError if the file is not found
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
    """Possible folders of a package: inside a folder, or the folder itself."""
    yield folder / name
    called = None
    with suppress(OSError, ElementTree.ParseError):
        called = ElementTree.parse(folder / "package.xml").findtext("name")
    if name in (folder.name, (called or "").strip()):
        yield folder


def parsed(text: bytes | str) -> Element:
    """A model's text as a tree.

    raises  ElementTree.ParseError for a text that is not XML, ValueError for too deep nesting
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


@dataclass(frozen=True)
class ModelFiles:
    """A model and the files that it names: name in one folder -> content.

    name     name of the model itself
    texts    the model, parts that it includes, and models that it attaches
    assets   all other files
    sources  name -> the original file
    """

    name: str
    texts: dict[str, bytes] = field(default_factory=dict)
    assets: dict[str, bytes] = field(default_factory=dict)
    sources: dict[str, Path] = field(default_factory=dict)


def gathered(path: Path, packages: Sequence[Path] = ()) -> ModelFiles:
    """An MJCF or URDF file and all files that MuJoCo reads for it.

    Files keep their names, because nameless meshes are called after their files, and line numbers
    do not change. Gathering a gathered model again gives the same files.

    packages  folders that may contain ROS packages, in addition to those above the model
    raises    OSError for a file that cannot be read, ElementTree.ParseError for a text that is not
              XML, ValueError for a file that MuJoCo does not read
    """
    files = ModelFiles(_name_for_mujoco(path))
    _Gathering(files, packages).add_model(path, files.name)
    return files


def _name_for_mujoco(path: Path) -> str:
    """The name of a model with the ending by which MuJoCo knows its language: in small letters, and
    no other than these two."""
    return f"{path.stem}{'.urdf' if parsed(text_of(path)).tag == 'robot' else '.xml'}"


def text_of(path: Path) -> bytes:
    """A model's text, which begins with its XML declaration if it has one."""
    text = read_file(path)
    found = LATE_DECLARATION.match(text)
    if found is None:
        return text
    before, declaration = found.groups()
    return declaration + before + text[found.end() :]


@dataclass
class _Part:
    """A text of a model: the model itself, or a part that it includes.

    included  number of an include -> its part
    """

    path: Path
    text: bytes
    elements: list[Element]
    included: dict[int, _Part]

    def compiler(self) -> dict[str, str]:
        """Attributes of all compiler elements; the last value in the text counts."""
        given: dict[str, str] = {}
        for number, element in enumerate(self.elements):
            if element.tag == "compiler":
                given |= element.attrib
            elif number in self.included:
                given |= self.included[number].compiler()
        return given


class _Gathering:
    """Files of a model as they are found."""

    def __init__(self, files: ModelFiles, packages: Sequence[Path]) -> None:
        self._files = files
        self._packages = packages
        self._names: dict[tuple[Path, str, str], str] = {}

    def add_model(self, path: Path, name: str) -> None:
        """Add a model and its files; names in it are relative to its own folder."""
        whole = _read(path, path.parent, set())
        check_kind(whole.elements[0], path.suffix)
        given = whole.compiler()
        self._add_part(whole, name, posixpath.dirname(name), path, given)

    def _add_part(
        self, part: _Part, name: str, folder: str, model: Path, given: Mapping[str, str]
    ) -> None:
        changes: dict[int, dict[str, str | None]] = {}
        for number, key in _references(part.elements, given):
            element = part.elements[number]
            if element.tag == "include":
                inside = part.included[number]
                target, new = self._named(inside.path, folder, inside.path.name)
                if new:
                    self._add_part(inside, target, folder, model, given)
            else:
                source = self._source(element, key, model, given)
                model_of_its_own = element.tag == "model"
                called = _name_for_mujoco(source) if model_of_its_own else source.name
                target, new = self._named(source, "", called)
                if new and model_of_its_own:
                    self.add_model(source, target)
                elif new:
                    self._files.assets[target] = read_file(source)
            changes.setdefault(number, {})[key] = posixpath.relpath(target, folder or ".")
        for number, element in enumerate(part.elements):
            if element.tag == "compiler":
                changes[number] = dict.fromkeys((*FOLDERS, "strippath"))
        self._files.texts[name] = with_attributes(part.text, changes)
        self._files.sources[name] = part.path

    def _source(self, element: Element, key: str, model: Path, given: Mapping[str, str]) -> Path:
        """The file that an attribute of an element names."""
        file = element.attrib[key].replace("\\", "/")
        if element.tag == "mesh":
            check_mesh(file)
        if file.startswith(("package:", "model:", "file:")):
            return located(file, model, self._packages)
        if given.get("strippath") == "true":
            file = posixpath.basename(file)
        keys = FOLDER_KEYS[element.tag]
        return model.parent / next((given[key] for key in keys if key in given), "") / file

    def _named(self, source: Path, folder: str, called: str) -> tuple[str, bool]:
        """The name of a file in the gathered model, and whether the file is new.

        folder  folder to which names in the file are relative
        called  its own name there, if it is not taken
        """
        known = source.resolve(), source.name, folder
        if known in self._names:
            return self._names[known], False
        taken = {name.casefold() for name in self._names.values()}
        name, number = f"{ASSETS}/{called}", 1
        while name.casefold() in taken:
            number += 1
            name = f"{ASSETS}/{number}/{called}"
        self._names[known] = name
        self._files.sources[name] = source
        return name, True


def _read(path: Path, folder: Path, read: set[Path]) -> _Part:
    """A text of a model in `folder`; the files in `read` have been read before."""
    read.add(path.resolve())
    text = text_of(path)
    part = _Part(path, text, [*parsed(text).iter()], {})
    check_composites(part.elements[0], path)
    for number, element in enumerate(part.elements):
        file = element.get("file") if element.tag == "include" else None
        if not file:
            continue
        paths = [base / file.replace("\\", "/") for base in (folder, path.parent)]
        found = next((p for p in paths if p.is_file()), paths[0])
        if found.resolve() in read:
            raise ValueError(f"{path.name} includes {file} once more. Include it once.")
        part.included[number] = _read(found, folder, read)
    return part


def _references(elements: list[Element], given: Mapping[str, str]) -> Iterator[tuple[int, str]]:
    """Number and attribute of each element that names a file which MuJoCo reads.

    In a URDF these are meshes; by default MuJoCo discards the visual ones.
    """
    numbers = {element: number for number, element in enumerate(elements)}
    if elements[0].tag == "robot":
        parts = ["collision"] if given.get("discardvisual") != "false" else ["collision", "visual"]
        for part in parts:
            for mesh in elements[0].iterfind(f"link/{part}/geometry/mesh[@filename]"):
                yield numbers[mesh], "filename"
        return
    for number, element in enumerate(elements):
        if element.tag == "include" or element.tag in FOLDER_KEYS:
            for key, value in element.attrib.items():
                if key.startswith("file") and value:
                    yield number, key
