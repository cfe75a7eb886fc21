"""The scene as run, with its model, in the run folder."""

from __future__ import annotations

import tomllib
from typing import TYPE_CHECKING, Any

from flowborne.files.atomic import write_atomically
from flowborne.runs.run_folder import RunFolder, RunFolderError, reading

if TYPE_CHECKING:
    from flowborne.scenes.schema import Scene


def with_frames(scene: Scene, frames: int | None) -> Scene:
    """The same scene with another number of frames; the same when None."""
    if frames is None:
        return scene
    return scene.model_copy(update={"time": scene.time.model_copy(update={"frames": frames})})


def write_scene(folder: RunFolder, files: dict[str, bytes]) -> None:
    """Write what `scene_files` gave; scene.toml comes last, so that it never lacks its model."""
    names = [name for name in files if name != folder.scene.name]
    folder.mark(names)
    for name in [*names, folder.scene.name]:
        path = folder.path / name
        path.parent.mkdir(parents=True, exist_ok=True)
        contents = files[name]
        write_atomically(path, lambda file, contents=contents: file.write(contents))  # type: ignore[misc]


def scene_to_resume(folder: RunFolder, wanted: Scene) -> Scene:
    """The scene of an earlier run, which has to be `wanted` but for the number of frames.

    raises  RunFolderError when the folder has no scene, or another one: it says what differs
    """
    from flowborne.scenes.load import load_scene
    from flowborne.scenes.save import scene_files, with_meshes_of

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
        f"go on with that one (flowborne run {folder.scene} --out {folder.path} --resume), or "
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
    """(key, ours, theirs) wherever the two differ; "absent" where one has none."""
    keys = list(dict.fromkeys([*ours, *theirs]))
    return [
        (key, ours.get(key, "absent"), theirs.get(key, "absent"))
        for key in keys
        if ours.get(key, "absent") != theirs.get(key, "absent")
    ]
