"""The scene in a run folder: written, read to resume the run, and its table [film]."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from typing import Any

from pydantic import ValidationError

from flowborne.base.atomic import write_atomically
from flowborne.base.errors import SceneError
from flowborne.runs.run_folder import RunFolder, RunFolderError, reading
from flowborne.scenes.draft import explain
from flowborne.scenes.load import load_scene, override
from flowborne.scenes.save import scene_files, with_meshes_of
from flowborne.scenes.schema import Scene
from flowborne.scenes.schema_film import FilmTable


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
            "start it again with --replace"
        )
    with reading(folder.path):
        saved = load_scene(folder.scene)
    ours = scene_files(saved)
    theirs = scene_files(with_frames(with_meshes_of(wanted, saved), saved.time.frames))
    if ours == theirs:
        return saved
    name = folder.scene.name
    differing = [
        f"{key} is {before} there and {after} here"
        for key, before, after in _differences(_flat(ours[name]), _flat(theirs[name]))
    ] or [f"the file {other} differs" for other in sorted(ours) if ours[other] != theirs.get(other)]
    raise RunFolderError(
        f"{folder.path} holds a run of another scene ({'; '.join(differing[:3])}); "
        f"continue that one (flowborne run {folder.scene} --out {folder.path} --resume), or "
        "name another folder with --out"
    )


def _flat(toml: bytes) -> dict[str, Any]:
    """ "fluid.density"-like keys of a file and their values."""
    flat: dict[str, Any] = {}

    def walk(key: str, value: Any) -> None:
        parts: dict[Any, Any] | None = value if isinstance(value, dict) else None
        if isinstance(value, list) and value and isinstance(value[0], dict):
            parts = dict(enumerate(value))
        if parts is None:
            flat[key] = value
            return
        for name, part in parts.items():
            walk(f"{key}.{name}" if key else str(name), part)

    walk("", tomllib.loads(toml.decode()))
    return flat


def _differences(ours: dict[str, Any], theirs: dict[str, Any]) -> list[tuple[str, Any, Any]]:
    """(key, ours, theirs) for each difference; "absent" if one has no such key."""
    rows = [(key, ours.get(key, "absent"), theirs.get(key, "absent")) for key in ours | theirs]
    return [row for row in rows if row[1] != row[2]]


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
