"""The JSON schema accepts what a scene may have, and refuses what editors should mark."""

from __future__ import annotations

import json
import tomllib
from pathlib import Path
from typing import Any

import pytest

from flowborne.cli.main import main
from flowborne.scenes.json_schema import json_schema
from flowborne.scenes.load import BUILT_IN, library

TYPES = {
    "object": dict,
    "array": list,
    "string": str,
    "boolean": bool,
    "integer": int,
    "number": (int, float),
    "null": type(None),
}

BOUNDS = {
    "minimum": lambda value, bound: value >= bound,
    "maximum": lambda value, bound: value <= bound,
    "exclusiveMinimum": lambda value, bound: value > bound,
}

SCHEMA = json_schema()


def accepts(value: Any, schema: Any = SCHEMA) -> bool:
    """Whether a schema of the words that ours has accepts a value."""
    if isinstance(schema, bool):
        return schema
    if "$ref" in schema and not accepts(value, SCHEMA["$defs"][schema["$ref"].split("/")[-1]]):
        return False
    if "anyOf" in schema and not any(accepts(value, one) for one in schema["anyOf"]):
        return False
    if "enum" in schema and value not in schema["enum"]:
        return False
    if "const" in schema and value != schema["const"]:
        return False
    if "type" in schema:
        kind = schema["type"]
        if not isinstance(value, TYPES[kind]) or (isinstance(value, bool) and kind != "boolean"):
            return False
    if isinstance(value, dict):
        known, other = schema.get("properties", {}), schema.get("additionalProperties", True)
        within = all(accepts(inner, known.get(key, other)) for key, inner in value.items())
        return within and set(schema.get("required", ())) <= set(value)
    if isinstance(value, list):
        return all(accepts(inner, schema.get("items", True)) for inner in value)
    return all(meets(value, schema[word]) for word, meets in BOUNDS.items() if word in schema)


@pytest.mark.parametrize("name", BUILT_IN)
def test_every_built_in_scene_is_accepted(name: str) -> None:
    assert accepts(tomllib.loads((library() / f"{name}.toml").read_text("utf-8")))


@pytest.mark.parametrize(
    ("text", "right"),
    [
        ('[boundaries]\nx_min = "open"', True),
        ('[boundaries]\nx_min = { kind = "open" }', True),
        ('[boundaries]\nx_min = "opn"', False),
        ('[controller]\nrule = "fixed"', True),
        ('[controller]\nrule = { kind = "mine", gain = 3.0 }', True),
        ('[output]\nexports = ["a.glb", { file = "b.usd" }]', True),
        ("[output]\njoints = 3", False),
        ("[fluid]\ndensity = 1000.0", True),
        ("[fluid]\ndensty = 1000.0", False),
        ("[fluid]\ndensity = -1.0", False),
        ("[time]\nframes = 0", False),
        ("[initial.positions]\nwrist = 3.0\nball = [1.0, 0.0, 0.0, 0.0]", True),
        ("[fluit]", False),
    ],
)
def test_keys_kinds_and_limits_are_known(text: str, right: bool) -> None:
    assert accepts(tomllib.loads(text)) is right


def test_the_command_prints_it(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    with pytest.raises(SystemExit) as left:
        main(["schema"])
    assert left.value.code == 0
    printed = json.loads(capsys.readouterr().out)
    assert printed == SCHEMA
    assert "frames between checkpoints" in printed["$defs"]["OutputTable"]["description"]
