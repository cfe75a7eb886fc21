"""Writing a scene so that it stands on its own: TOML, model, and what the model needs; and the
scene in a run folder: written, read to resume the run, and its table [film]."""

from __future__ import annotations

import tomllib
from collections.abc import Callable, Iterable, Mapping
from itertools import chain, count
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from flowborne.base.atomic import write_atomically
from flowborne.base.errors import SceneError
from flowborne.base.given import read_file
from flowborne.runs.run_folder import OWN_NAMES, RunFolder, RunFolderError, reading
from flowborne.scenes.bodies import bones_of, packages_of
from flowborne.scenes.capture import human_of
from flowborne.scenes.draft import explain
from flowborne.scenes.earlier import EARLIER_FILE, earlier_of
from flowborne.scenes.flesh import FleshTable, meshed, staleness
from flowborne.scenes.load import load_scene, override
from flowborne.scenes.schema import Scene
from flowborne.scenes.schema_film import FilmTable
from flowborne.solids.model_files import ASSETS, gathered
from flowborne.solids.tissue.mesh_file import mesh_bytes

SCENE_FILE = "scene.toml"
HUMAN_FILE = "human.xml"
"""The model of a scene's human, for other programs; the scene itself makes it anew."""


Named = Callable[[str], str]
"""The name that a file gets in a new folder, each name once."""


def _names(taken: Iterable[str]) -> Named:
    """Files keep their own names; where one is taken, whatever its case, with a number before
    it."""
    given = {name.casefold() for name in taken}

    def name(file: str) -> str:
        own = Path(file).name
        numbered = (f"{number}-{own}" for number in count(2))
        found = next(name for name in chain([own], numbered) if name.casefold() not in given)
        given.add(found.casefold())
        return found

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
    named = _names([*OWN_NAMES, SCENE_FILE, HUMAN_FILE, ASSETS, *exported, *changed["plugins"]])
    if scene.flesh:
        changed["flesh"], files = _flesh_files(scene, named)
    if scene.model_path is not None:
        assert scene.solids is not None
        name = named(scene.model_path.name)
        try:
            found = gathered(scene.model_path, packages_of(scene))
        except OSError as error:
            raise _unreadable(Path(error.filename), error) from None
        texts = {name if one == found.name else one: text for one, text in found.texts.items()}
        files |= texts | found.assets
        changed["solids"] = scene.solids.model_copy(update={"model": name, "packages": ()})
    for name, plugin in zip(changed["plugins"], scene.plugins, strict=True):
        files[name] = _read(scene.folder / plugin)
    if scene.human is not None:
        files[HUMAN_FILE] = human_of(scene).encode()
    if scene.clip is not None and scene.clip.file is not None:
        name = named(scene.clip.file)
        files[name] = _read(scene.folder / scene.clip.file)
        changed["clip"] = scene.clip.model_copy(update={"file": name})
    earlier = earlier_of(scene)
    if earlier is not None and scene.earlier is not None:
        name = named(EARLIER_FILE)
        files[name] = earlier.to_bytes()
        changed["earlier"] = scene.earlier.model_copy(update={"run": name})
    return {SCENE_FILE: scene.model_copy(update=changed).to_toml().encode()} | files


def with_meshes_of(scene: Scene, earlier: Scene) -> Scene:
    """The same scene with the meshes of its flesh from an earlier run where it has none to use."""
    known = {table.name: table.mesh for table in earlier.flesh if table.mesh is not None}
    spec, tables = bones_of(scene) if scene.flesh else None, []
    for table in scene.flesh:
        unused = table.mesh is None or staleness(spec, table, scene.folder) is not None
        if unused and table.name in known:
            path = earlier.folder.resolve() / known[table.name]
            table = table.model_copy(update={"mesh": str(path)})
        tables.append(table)
    return scene.model_copy(update={"flesh": tuple(tables)})


def _flesh_files(scene: Scene, named: Named) -> tuple[tuple[FleshTable, ...], dict[str, bytes]]:
    """The flesh's tables and the files that they name: every mesh, and the user's own surfaces."""
    spec, files, tables = bones_of(scene), {}, []
    for table in scene.flesh:
        mesh, recipe = meshed(spec, table, scene.folder)
        changed = {"mesh": named(table.kept_as)}
        files[changed["mesh"]] = mesh_bytes(mesh, recipe)
        if table.surface is not None:
            changed["surface"] = named(table.surface)
            files[changed["surface"]] = _read(scene.folder / table.surface)
        tables.append(table.model_copy(update=changed))
    return tuple(tables), files


def _read(path: Path) -> bytes:
    try:
        return read_file(path)
    except OSError as error:
        raise _unreadable(path, error) from None


def _unreadable(path: Path, error: OSError) -> SceneError:
    return SceneError(f"file {path} cannot be read: {error.strerror}. Put it there.")


def with_frames(scene: Scene, frames: int | None) -> Scene:
    """The same scene with another number of frames; the same when None."""
    if frames is None:
        return scene
    return scene.model_copy(update={"time": scene.time.model_copy(update={"frames": frames})})


def write_scene(folder: RunFolder, files: dict[str, bytes]) -> None:
    """Write the result of `scene_files`, scene.toml last, so that it never lacks its model."""
    names = [name for name in files if name != folder.scene.name]
    folder.mark(names)
    for name in [*names, folder.scene.name]:
        path = folder.path / name
        path.parent.mkdir(parents=True, exist_ok=True)
        contents = files[name]
        write_atomically(path, lambda file, contents=contents: file.write(contents))  # type: ignore[misc]


def scene_to_resume(folder: RunFolder, wanted: Scene) -> Scene:
    """The scene of an earlier run, which may differ from `wanted` in the number of frames only.

    raises  RunFolderError when the folder has no scene, or another one, with the differences
    """
    if not folder.scene.exists():
        raise RunFolderError(
            f"{folder.path} has no scene.toml: the run was stopped before it began; "
            "start it again with replace=True"
        )
    with reading(folder.path):
        saved = load_scene(folder.scene)
    ours = scene_files(saved)
    theirs = scene_files(with_frames(with_meshes_of(wanted, saved), saved.time.frames))
    if ours == theirs:
        return saved
    name = folder.scene.name
    before, after = (_flat(tomllib.loads(files[name].decode())) for files in (ours, theirs))
    differing = [
        f"{key} is {before.get(key, 'absent')} there and {after.get(key, 'absent')} here"
        for key in before | after
        if before.get(key, "absent") != after.get(key, "absent")
    ] or [f"the file {other} differs" for other in sorted(ours) if ours[other] != theirs.get(other)]
    raise RunFolderError(
        f"{folder.path} holds a run of another scene ({'; '.join(differing[:3])}); "
        f"continue that one (flowborne run {folder.scene} --out {folder.path} --resume), or "
        "name another folder"
    )


def _flat(value: Any, key: str = "") -> dict[str, Any]:
    """ "fluid.density"-like keys of tables and their values."""
    listed = isinstance(value, list) and value and isinstance(value[0], dict)
    if not (listed or isinstance(value, dict)):
        return {key: value}
    flat: dict[str, Any] = {}
    for name, part in enumerate(value) if listed else value.items():
        flat |= _flat(part, f"{key}.{name}" if key else str(name))
    return flat


def film_settings(folder: RunFolder, overrides: Mapping[str, str]) -> dict[str, Any]:
    """The table [film] of a run with every default filled in.

    overrides  dotted key -> TOML text of its new value: {"camera.orbit": "30"}
    raises     SceneError with every problem there is; RunFolderError when the scene is missing or
               cut
    """
    scene = folder.read_scene()
    raw = {"film": scene.get("film", {})}
    for key, text in overrides.items():
        override(raw["film"], key, text)
    try:
        table = FilmTable.model_validate(raw["film"])
    except ValidationError as error:
        located = [{**one, "loc": ("film", *one["loc"])} for one in error.errors()]
        problems = [explain(one, raw, folder.scene.name) for one in located]  # type: ignore[arg-type]
        raise SceneError(list(dict.fromkeys(problems))) from None
    dry = scene.get("fluid", {}).get("coupling", "none") == "none"
    if "field" in overrides and table.field != "none" and dry:
        raise SceneError(
            f"scene {folder.scene.name}, [film] field: '{table.field}' is of a fluid, and this run "
            "has none. Drop it."
        )
    return table.model_dump(exclude_none=True)
