"""Writing a scene so that it stands on its own: TOML, model, and what the model needs."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

from flowborne.base.errors import SceneError
from flowborne.base.given import read_file
from flowborne.runs.run_folder import OWN_NAMES
from flowborne.scenes.bodies import bones_of, packages_of
from flowborne.scenes.capture import human_of
from flowborne.scenes.earlier import EARLIER_FILE, earlier_of
from flowborne.scenes.flesh import FleshTable, meshed
from flowborne.scenes.schema import Scene
from flowborne.solids.model_files import ASSETS, gathered
from flowborne.solids.tissue.mesh_file import ENDING, mesh_bytes

SCENE_FILE = "scene.toml"
HUMAN_FILE = "human.xml"
"""The model of a scene's human, for other programs; the scene itself makes it anew."""


class _Names:
    """Names that files get in one folder, each once.

    taken  names that no file gets, whatever their case
    """

    def __init__(self, taken: Iterable[str]) -> None:
        self._taken = {name.casefold() for name in taken}

    def name(self, file: str) -> str:
        """The file's own name; where it is taken, with a number before it."""
        own = name = Path(file).name
        number = 1
        while name.casefold() in self._taken:
            number += 1
            name = f"{number}-{own}"
        self._taken.add(name.casefold())
        return name


def scene_files(scene: Scene) -> dict[str, bytes]:
    """All files of the scene: name in its new folder -> content.

    Files keep their names unless two have the same, or a run has a file of that name; included
    models and meshes go to a folder `assets`.
    raises  SceneError when a file of the model is missing
    """
    files: dict[str, bytes] = {}
    changed: dict[str, Any] = {"plugins": tuple(Path(name).name for name in scene.plugins)}
    exported = (table.file for table in scene.output.exports)
    names = _Names([*OWN_NAMES, SCENE_FILE, HUMAN_FILE, ASSETS, *exported, *changed["plugins"]])
    if scene.flesh:
        changed["flesh"], files = _flesh_files(scene, names)
    if scene.model_path is not None:
        assert scene.solids is not None
        name = names.name(scene.model_path.name)
        files |= _model_files(scene.model_path, name, packages_of(scene))
        changed["solids"] = scene.solids.model_copy(update={"model": name, "packages": ()})
    for name, plugin in zip(changed["plugins"], scene.plugins, strict=True):
        files[name] = _read(scene.folder / plugin)
    if scene.human is not None:
        files[HUMAN_FILE] = human_of(scene).encode()
    if scene.clip is not None and scene.clip.file is not None:
        name = names.name(scene.clip.file)
        files[name] = _read(scene.folder / scene.clip.file)
        changed["clip"] = scene.clip.model_copy(update={"file": name})
    earlier = earlier_of(scene)
    if earlier is not None and scene.earlier is not None:
        name = names.name(EARLIER_FILE)
        files[name] = earlier.to_bytes()
        changed["earlier"] = scene.earlier.model_copy(update={"run": name})
    return {SCENE_FILE: scene.model_copy(update=changed).to_toml().encode()} | files


def with_meshes_of(scene: Scene, earlier: Scene) -> Scene:
    """The same scene with the meshes of its flesh from an earlier run where it names none."""
    known = {table.name: table.mesh for table in earlier.flesh if table.mesh is not None}
    tables = tuple(
        table.model_copy(update={"mesh": str(earlier.folder.resolve() / known[table.name])})
        if table.mesh is None and table.name in known
        else table
        for table in scene.flesh
    )
    return scene.model_copy(update={"flesh": tables})


def _flesh_files(scene: Scene, names: _Names) -> tuple[tuple[FleshTable, ...], dict[str, bytes]]:
    """The flesh's tables and the files that they name: every mesh, and the user's own surfaces."""
    spec, files, tables = bones_of(scene), {}, []
    for table in scene.flesh:
        mesh, recipe = meshed(spec, table, scene.folder)
        own = Path(table.mesh or f"flesh-{table.name}").with_suffix(ENDING)
        changed = {"mesh": names.name(str(own))}
        files[changed["mesh"]] = mesh_bytes(mesh, recipe)
        if table.surface is not None:
            changed["surface"] = names.name(table.surface)
            files[changed["surface"]] = _read(scene.folder / table.surface)
        tables.append(table.model_copy(update=changed))
    return tuple(tables), files


def _model_files(model: Path, name: str, packages: Sequence[Path]) -> dict[str, bytes]:
    """The model, under `name`, and what MuJoCo reads for it."""
    try:
        found = gathered(model, packages)
    except OSError as error:
        raise _unreadable(Path(error.filename), error) from None
    texts = {name if one == found.name else one: found.texts[one] for one in found.texts}
    return texts | found.assets


def _read(path: Path) -> bytes:
    try:
        return read_file(path)
    except OSError as error:
        raise _unreadable(path, error) from None


def _unreadable(path: Path, error: OSError) -> SceneError:
    return SceneError(f"file {path} cannot be read: {error.strerror}. Put it there.")
