"""From a name or a path to a checked scene."""

from __future__ import annotations

import copy
import re
import tomllib
from collections.abc import Mapping
from dataclasses import replace
from importlib import resources
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from flowborne.base.arguments import PATH, TEXTS, Kind, or_none, read, takes
from flowborne.base.errors import SceneError
from flowborne.base.given import BACKSLASH, read_file
from flowborne.base.phrases import suggestion
from flowborne.motion.human.skeleton import SIDES
from flowborne.runs.run_folder import reading
from flowborne.scenes.bodies import with_steps
from flowborne.scenes.changes import CHANGEABLE
from flowborne.scenes.check import cross_check
from flowborne.scenes.draft import Draft, explain, keys_of
from flowborne.scenes.keyframe_file import inline_keyframes
from flowborne.scenes.plugins import load_plugins
from flowborne.scenes.schema import Scene

SCENE = Kind(PATH.read, "a Scene, the name of a built-in one, or the path of a scene file")


def join_elbows(raw: dict[str, Any]) -> None:
    """Add the elbow to each list of joints with its shoulder, in a scene as read, in place.

    It then has the strength and the objectives of the shoulder.
    """
    human = raw.get("human")
    if not (isinstance(human, dict) and human.get("elbows") is True):
        return
    for entries in (raw.get("control"), raw.get("objectives")):
        for entry in entries if isinstance(entries, list) else []:
            for key in ("joints", "wanted_by"):
                joints = entry.get(key) if isinstance(entry, dict) else None
                if isinstance(joints, list):
                    added = [f"{side}_elbow" for side in SIDES if f"{side}_shoulder" in joints]
                    joints += [elbow for elbow in added if elbow not in joints]


BUILT_IN = (
    "block-effort-wind",
    "block-effort-weak-wind",
    "block-drag-min",
    "block-drag-max",
    "block-drag-min-moving",
    "block-drag-max-moving",
    "ns-block-effort",
    "ns-block-drag-min",
    "ns-block-drag-max",
    "ns-chain-1",
    "ns-chain-2",
    "ns-chain-3",
    "ns-chain-4",
    "human-gravity-back",
    "human-gravity-arms",
    "human-wind-back",
    "human-wind-arms",
    "human-wind-drag",
    "human-wind-all",
    "flyer-base",
    "flyer-twist",
    "flyer-flesh",
    "swimmer",
    "swimmer-jet-only",
    "swimmer-no-control",
    "swimmer-stroke",
    "swimmer-held",
    "eel",
    "eel-room",
    "eel-free",
    "eel-sea",
    "eel-pair",
    "swimmer-sea",
    "flyer-air",
    "fish-robot",
    "fish",
    "rov",
)


MODELS = (".xml", ".mjcf", ".urdf")
"""Endings of models, which a scene names."""

DEEPEST = 30
"""Most tables and arrays in each other of a scene."""


def library() -> Path:
    """The folder of the built-in scenes."""
    return Path(str(resources.files("flowborne.scenes") / "library"))


def scene_names() -> tuple[str, ...]:
    """Names of the built-in scenes, in the order of the paper's figures."""
    return BUILT_IN


@takes(name_or_path=SCENE, overrides=or_none(TEXTS))
def load_scene(
    name_or_path: str | Path, overrides: Mapping[str, Any] | None = None, *, trust: bool = True
) -> Scene:
    """The scene of a built-in name or of a TOML file, checked whole.

    overrides  dotted key -> its new value, or the TOML text of it; list entries count from 0:
               {"domain.resolution": 64, "control.0.strength": 30.0}
    trust      import the Python that the scene names, as has to be done to run it; a scene that
               names some is refused without it, before any is imported; not a built-in one
    raises     SceneError with every problem there is
    """
    path = find(name_or_path)
    raw = read_tables(path)
    for key, text in (overrides or {}).items():
        override(raw, key, text)
    _check_depth(raw, path)
    if not trust and path.parent != library() and (named := python_of(raw)):
        raise SceneError(
            f"scene {path.name} brings Python, which can do whatever you can: {', '.join(named)}. "
            "Read it, then check with trust=True, which imports it as a run does."
        )
    draft, problems = _understood(raw, path)
    if draft is None:
        raise SceneError(problems)
    problems = problems + cross_check(draft)
    for index, change in enumerate(() if problems else draft.scene.changes, start=1):
        try:
            with_values(draft.scene, change.values)
        except SceneError as error:
            problems += [f"[[changes]] {index}: {problem}" for problem in error.problems]
    if problems:
        raise SceneError(problems)
    return with_steps(draft.scene)


def scene_of(scene: Scene | str | Path) -> Scene:
    """A scene, loaded if it is a name or a path. Raises SceneError as `load_scene`."""
    return scene if isinstance(scene, Scene) else load_scene(read(SCENE, scene, "scene"))


def read_scene(path: Path) -> Scene:
    """The scene of a file that was checked before, such as that of a run; not checked again.

    raises  RunFolderError for a file that is no scene
    """
    with reading(path.parent):
        raw = read_tables(path)
        _check_depth(raw, path)
        draft, problems = _understood(raw, path)
        if draft is None or problems:
            raise SceneError(problems)
        return draft.scene


def check_scene(name_or_path: str | Path, overrides: Mapping[str, str] | None = None) -> list[str]:
    """Everything that is wrong with a scene; an empty list when it is fine."""
    try:
        load_scene(name_or_path, overrides)
    except SceneError as error:
        return error.problems
    return []


def _understood(raw: dict[str, Any], path: Path) -> tuple[Draft | None, list[str]]:
    """The scene of a file with its plugins loaded, without its model, and the problems there."""
    raw.setdefault("name", path.stem)
    join_elbows(raw)
    problems = unloaded = load_plugins(raw, path.parent, path.name)
    problems = problems + inline_keyframes(raw, path.parent, path.name)
    draft, more = _validate(raw, path)
    if draft is not None and unloaded:
        draft = replace(draft, broken=draft.broken | {"plugins"})
    return draft, problems + more


def python_of(raw: Mapping[str, Any]) -> list[str]:
    """Python code that a scene as read names: plugin files, then functions."""
    plugins = raw.get("plugins", [])
    named = [f"plugin {name}" for name in plugins] if isinstance(plugins, list) else []
    for key in ("objectives", "wind", "policy"):
        tables = raw.get(key, [])
        tables = [tables] if isinstance(tables, dict) else tables
        for table in tables if isinstance(tables, list) else []:
            if isinstance(table, dict) and "function" in table:
                named.append(f"function {table['function']}")
    return list(dict.fromkeys(named))


def find(name_or_path: str | Path) -> Path:
    """The file of a built-in name or a path. Raises SceneError when there is none."""
    text = str(name_or_path)
    if text in BUILT_IN:
        return library() / f"{text}.toml"
    path = Path(name_or_path)
    try:
        if path.is_file() and path.suffix.lower() in MODELS:
            raise SceneError(
                f"scene {text} is a model, without a fluid. Write a TOML file beside it, with "
                f'model = "{path.name}" under [solids], and give that.'
            )
        if path.is_file():
            return path
        if path.is_dir():
            raise SceneError(f"scene {text} is a folder. Give the TOML file in it.")
    except PermissionError as error:
        raise SceneError(f"scene {text} cannot be read: {error.strerror}. Mend that.") from error
    except (OSError, ValueError):
        raise SceneError(f"{text[:60]} ... is no name of a file. Shorten it.") from None
    if path.suffix == ".toml" or path.parent != Path():
        raise SceneError(f"there is no scene file {text}. Correct the path.")
    end = suggestion(text, BUILT_IN, "Give a TOML file or one of")
    raise SceneError(f"there is no scene '{text}'{end}")


def read_tables(path: Path, kind: str = "scene") -> dict[str, Any]:
    """Tables of a TOML file, which messages call `kind`. Raises SceneError where it is none."""
    content = ""
    try:
        content = read_file(path).decode("utf-8-sig")
        return tomllib.loads(content)
    except OSError as error:
        raise SceneError(f"{kind} {path} cannot be read: {error.strerror}. Mend that.") from error
    except UnicodeDecodeError as error:
        raise SceneError(
            f"{kind} {path.name}: byte {error.start + 1} is not UTF-8 text. Save it as UTF-8."
        ) from None
    except tomllib.TOMLDecodeError as error:
        text = str(error)
        found = re.fullmatch(r"(.*) \(at (?:line (\d+), column (\d+)|end of document)\)", text)
        what, line, column = found.groups() if found else (text, None, None)
        where = f", line {line}, column {column}" if line else ", at its end" if found else ""
        remedy = "Correct it there."
        if line and re.search(r'".*\\', content.split("\n")[int(line) - 1]):
            remedy = f"{BACKSLASH}."
        raise SceneError(
            f"{kind} {path.name}{where}: this is not TOML ({what[:1].lower() + what[1:]}). {remedy}"
        ) from None
    except ValueError:
        raise SceneError(
            f"{kind} {path.name}: there is a number of thousands of digits in it. Shorten it."
        ) from None
    except RecursionError:
        raise _too_deep(path, kind) from None


def _check_depth(raw: dict[str, Any], path: Path) -> None:
    """Raise SceneError when a scene as read is nested deeper than any scene is."""
    level: list[Any] = [raw]
    for _ in range(DEEPEST):
        inner = [
            value for one in level for value in (one.values() if isinstance(one, dict) else one)
        ]
        level = [value for value in inner if isinstance(value, dict | list)]
    if level:
        raise _too_deep(path)


def _too_deep(path: Path, kind: str = "scene") -> SceneError:
    return SceneError(
        f"{kind} {path.name}: its arrays or tables are nested more than {DEEPEST} deep. "
        "Flatten them."
    )


def override(raw: dict[str, Any], key: str, text: str) -> None:
    """Set one value of a scene file as read; text that is not a TOML value stays text.

    Missing tables are added; the schema finds unknown keys.
    raises  SceneError for a key that leads nowhere
    """
    put(raw, key, value_of(text), f"{key}={text}")


def put(raw: dict[str, Any], key: str, wanted: Any, said: str) -> None:
    """Set a dotted key of a scene as read, in place.

    said    how that was asked for, for messages
    raises  SceneError for a key that leads nowhere
    """
    steps = key.split(".")
    if not all(steps):
        raise SceneError(f"{said}: '{key}' is no key. Write it as table.key=value.")
    value: Any = raw
    for depth, step in enumerate(steps):
        so_far = ".".join(steps[:depth])
        last = depth == len(steps) - 1
        if isinstance(value, list):
            if not step.isdecimal() or int(step) >= len(value):
                raise SceneError(
                    f"{said}: '{step}' is not an entry of {so_far}, which has "
                    f"{len(value)}. Count its entries from 0."
                )
            index: Any = int(step)
        elif isinstance(value, dict):
            index = step
        else:
            raise SceneError(f"{said}: {so_far} is {value!r} and has no keys. Shorten the key.")
        if last:
            value[index] = wanted
            return
        if isinstance(value, dict):
            value.setdefault(index, {})
        if isinstance(value[index], str):
            value[index] = {"kind": value[index]}
        value = value[index]


def at(raw: Any, key: str) -> Any:
    """What a scene as read has at a dotted key; None where it has nothing."""
    for step in key.split("."):
        if isinstance(raw, list):
            raw = raw[int(step)] if step.isdecimal() and int(step) < len(raw) else None
        else:
            raw = raw.get(step) if isinstance(raw, dict) else None
    return raw


def raw_of(scene: Scene) -> dict[str, Any]:
    """A scene as it would be read from its file, without its changes."""
    return scene.model_dump(mode="json", exclude_none=True, exclude={"changes"})


def with_values(scene: Scene, values: Mapping[str, Any], *, check: bool = True) -> Scene:
    """The same scene with other values of dotted keys, as they can change in a run.

    check   hold it against its model, too
    raises  SceneError with every problem there is
    """
    raw, where = raw_of(scene), f"scene {scene.name}"
    for key, value in values.items():
        if key.split(".")[0] not in CHANGEABLE:
            raise SceneError(
                f"{where}: '{key}' cannot change in a run. Change one of {', '.join(CHANGEABLE)}, "
                "or start another run."
            )
        put(raw, key, value, f"{where}, change of {key}")
    draft, problems = _validate(raw, scene.folder / f"{scene.name}.toml")
    if draft is None or problems:
        raise SceneError(problems)
    changed = draft.scene
    changed._kept = scene.kept
    kept = [(one.controlled_joints(), [t.kind for t in one.objectives]) for one in (scene, changed)]
    if kept[0] != kept[1]:
        raise SceneError(
            f"{where}: which joints are controlled and which objectives there are cannot change "
            "in a run. Change strengths and weights; a weight of 0 switches an objective off."
        )
    problems = cross_check(draft) if check else []
    if problems:
        raise SceneError(problems)
    return changed


def value_of(text: str) -> Any:
    """The TOML value that a text is, or the text."""
    try:
        return tomllib.loads(f"value = {text}")["value"]
    except (ValueError, RecursionError):
        return text


def _validate(raw: dict[str, Any], path: Path) -> tuple[Draft | None, list[str]]:
    """The valid parts of a scene, and the problems of the others.

    Wrong parts are taken out of a copy of `raw`, so that the rest is checked as well.
    """
    sound = copy.deepcopy(raw)
    numbers = {
        key: list(range(1, len(value) + 1)) for key, value in raw.items() if isinstance(value, list)
    }
    try:
        scene = Scene.model_validate(sound)
        return Draft(scene.in_folder(path.parent), path.name, frozenset(), numbers), []
    except ValidationError as error:
        errors = error.errors()
    problems = list(dict.fromkeys(explain(one, raw, path.name) for one in errors))
    broken: set[str] = set()
    doomed: set[tuple[str, int]] = set()
    for one in errors:
        keys = keys_of(one["loc"], raw)
        top = str(keys[0])
        if one["type"] == "extra_forbidden":
            _remove(sound, keys)
        elif len(keys) > 1 and isinstance(keys[1], int) and top in numbers:
            broken.add(top)
            doomed.add((top, keys[1]))
        else:
            broken.add(top)
            sound.pop(top, None)
    for top, index in sorted(doomed, reverse=True):
        if isinstance(sound.get(top), list):
            del sound[top][index], numbers[top][index]
    sound.setdefault("name", path.stem)
    try:
        scene = Scene.model_validate(sound)
    except ValidationError:
        return None, problems
    return Draft(scene.in_folder(path.parent), path.name, frozenset(broken), numbers), problems


def _remove(raw: Any, keys: tuple[str | int, ...]) -> None:
    """Take a key out of nested tables, unless the table around it is gone already."""
    for key in keys[:-1]:
        if isinstance(raw, dict) and key not in raw:
            return
        raw = raw[key]
    if isinstance(raw, dict):
        raw.pop(keys[-1], None)
