"""The JSON schema of a scene file, by which editors complete and check keys."""

from __future__ import annotations

from typing import Any

from flowborne.scenes.schema import Scene

DIALECT = "https://json-schema.org/draft/2020-12/schema"


def json_schema() -> dict[str, Any]:
    """The schema of scenes, with the parts that are registered now.

    It accepts every scene that `load_scene` accepts. It knows kinds and limits of values, and
    nothing of the model, or of one table beside another.
    """
    schema = _with_short_forms(Scene.model_json_schema())
    schema["required"].remove("name")  # that of the file
    return {"$schema": DIALECT, **schema}


def _with_short_forms(part: Any) -> Any:
    """The same with the bare name of a kind in place of its table, and kinds of the user's own,
    which the choice by `kind` of pydantic leaves out."""
    if isinstance(part, list):
        return [_with_short_forms(one) for one in part]
    if not isinstance(part, dict):
        return part
    part = {key: _with_short_forms(value) for key, value in part.items()}
    if "oneOf" in part:
        part["anyOf"] = part.pop("oneOf")
        kinds = part.pop("discriminator", {}).get("mapping", {})
        part["anyOf"] += [{"enum": sorted(kinds)}] if kinds else [{"type": "string"}]
    return part
