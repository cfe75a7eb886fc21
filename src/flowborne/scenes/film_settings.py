"""What a film shows: the table [film] of a run's scene, changed on the command line."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from pydantic import ValidationError

from flowborne.errors import SceneError
from flowborne.runs.run_folder import RunFolder
from flowborne.scenes.draft import explain
from flowborne.scenes.load import override
from flowborne.scenes.schema_film import FilmTable


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
