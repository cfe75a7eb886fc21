"""What flowborne brings of each part that a scene chooses by name: the tables of docs/parts.md."""

from __future__ import annotations

import tomllib
from importlib import import_module
from typing import Any

from docstrings import prose
from flowborne.base.registry import Registry
from flowborne.control.gradients import GRADIENTS
from flowborne.control.objective_kinds import OBJECTIVES, ObjectiveTable
from flowborne.control.rules import RULES
from flowborne.runs.exporters import EXPORTERS, own_exporters
from flowborne.scenes.control import ControllerTable
from flowborne.scenes.load import library, scene_names
from flowborne.scenes.schema import Scene
from flowborne.scenes.sides import BoundariesTable
from flowborne.shapes.own import SHAPES
from markdown_text import plain, table
from scene_keys import hints_of, kind_of, tables_in

CHOICES: dict[str, tuple[type, str]] = {
    "Objectives: `[[objectives]]`": (Scene, "objectives"),
    "Rules: `rule` of `[controller]`": (ControllerTable, "rule"),
    "Gradients: `gradient` of `[controller]`": (ControllerTable, "gradient"),
    "Drives: `servo`": (ControllerTable, "servo"),
    "Phases: `phases`": (ObjectiveTable, "phases"),
    "Motions: `[[motion]]`": (Scene, "motion"),
    "Winds: `[[wind]]`": (Scene, "wind"),
    "Sides of the domain: `[boundaries]`": (BoundariesTable, "x_min"),
    "Dye: `[[dye]]`": (Scene, "dye"),
}
"""Heading -> table of the schema, and its key that holds what is chosen."""

OWN: dict[str, Registry[Any]] = {
    "objective": OBJECTIVES,
    "rule": RULES,
    "gradient": GRADIENTS,
    "shape": SHAPES,
    "exporter": EXPORTERS,
}
"""Parts that a user can add, by their decorator in `flowborne.parts`."""


def chosen() -> str:
    """A table for each choice: the names, and what each is."""
    text = []
    for heading, (model, key) in CHOICES.items():
        rows = [
            [", ".join(f"`{kind}`" for kind in kind_of(one)), plain(prose(one.__doc__)[0])]
            for one in tables_in(hints_of(model)[key])
            if kind_of(one)
        ]
        text += [f"## {heading}", table(["kind", "what it is"], dict.fromkeys(map(tuple, rows)))]
    return "\n\n".join(text)


def exporters() -> str:
    """The endings that `flowborne export` writes."""
    rows = []
    for ending, module in own_exporters().items():
        found = import_module(module)
        rows.append([f"`{ending}`", plain(prose(found.__doc__)[0])])
    return table(["ending", "what it is"], rows)


def own() -> str:
    """What each part of one's own must have."""
    rows = []
    for what, registry in OWN.items():
        methods = ", ".join(f"`{name}()`" for name in registry.methods)
        rows.append([what, f"`flowborne.parts.{what}`", methods])
    return table(["part", "decorator", "methods"], rows)


def scenes() -> str:
    """The built-in scenes, with what they show."""
    rows = []
    for name in scene_names():
        scene = tomllib.loads((library() / f"{name}.toml").read_text(encoding="utf-8"))
        rows.append([f"`{name}`", plain(scene.get("figure", "")), plain(scene["description"])])
    return table(["scene", "shows", "what is seen"], rows)
