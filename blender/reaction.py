# SPDX-License-Identifier: GPL-3.0-or-later
"""The settings of a run, and the scene file that flowborne runs with them."""

from __future__ import annotations

import json
import math
import tomllib
from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

Vector = tuple[float, float, float]

OBJECTIVES = ("effort", "least-drag", "most-drag", "most-lift")

UP = (0.0, 0.0, 1.0)

CHECKPOINT_FRAMES = 8
"""Frames between checkpoints, and at most that many are computed again after a cancel."""

SERVO = {
    "velocities": "present",
    "hypothetical_time": 0.05,
    "servo": {"kind": "pd", "frequency": 4.0},
}

QUICK = SERVO | {"rule": {"kind": "golden-section", "tolerance": 0.1}}
SLOW = SERVO | {"gradient": {"kind": "one-sided"}, "rule": {"kind": "resilient"}}
"""[controller], for a uniform wind, and where a trial solves for a flow or for flesh: half as many
trials per decision, and no search along the gradient, take a quarter of the time."""

FLESH_STEPS_PER_SECOND = 100.0
"""Least number of time steps with flesh: it shakes at up to some 10 Hz."""

PROBES = 1.0, 5.0
"""Displacement of a trial, degrees, with either controller."""

BASE_MEGABYTES, BYTES_PER_CELL = 320.0, 3700.0
SECONDS_PER_CELL, SECONDS_PER_CELL_AND_BONE = 2e-5, 3.3e-5
"""Memory of a run, and time per frame, measured on two cores that other programs use as well."""


class ReactionError(Exception):
    """The settings cannot be used; the text says why and what to do."""


@dataclass(frozen=True)
class Reaction:
    """The settings of a run.

    bones       names of the free bones
    cones       bone -> largest angle from its rest pose, degrees
    first       frame of Blender at which the bake starts
    frames      number of frames of the run, with those before the bake
    rate        frames per second
    unit        m per unit of Blender
    density     kg/m^3 of the character
    medium      kg/m^3 of the air or water
    flow        m/s of the medium
    simulated   whether the flow is simulated; otherwise a uniform wind acts on the surface
    resolution  cells along the longest side of the simulated domain
    gravity     m/s^2
    floats      whether forces move the root; otherwise it follows the animation
    objective   one of OBJECTIVES
    follow      weight of the distance from the animation, 0 for none
    strength    largest rate of a bone, degrees/s
    lead        frames of the run before `first`, in which bones settle
    loop        whether the animation is a cycle that the run repeats; its last round is baked
    ink         corners of a box in which the simulated flow is coloured, m; empty without one
    young       Young's modulus of the flesh around the bones, N/m^2; 0 without flesh
    follows     whether the bones follow the animation, so that only their flesh reacts
    """

    bones: tuple[str, ...]
    cones: Mapping[str, float]
    first: int
    frames: int
    rate: float
    unit: float = 1.0
    density: float = 1000.0
    medium: float = 1.2
    flow: Vector = (0.0, 0.0, 0.0)
    simulated: bool = False
    resolution: int = 48
    gravity: Vector = (0.0, 0.0, 0.0)
    floats: bool = False
    objective: str = "effort"
    follow: float = 0.0
    strength: float = 90.0
    lead: int = 0
    loop: bool = False
    ink: tuple[Vector, Vector] | tuple[()] = ()
    young: float = 0.0
    follows: bool = False

    def __post_init__(self) -> None:
        if not self.bones:
            raise ReactionError("no bone is free: select the bones that react, in Pose Mode")
        if self.frames <= self.lead:
            raise ReactionError("the frame range is empty: make the end later than the start")
        if self.loop and self.floats:
            raise ReactionError(
                "a root that floats leaves the cycle: clear Root Floats, or set Rounds to 1"
            )
        if not self.follows and self.objective.endswith("drag") and not any(self.flow):
            raise ReactionError(
                f"the objective {self.objective} needs a flow: set its velocity, or choose effort"
            )

    def save(self, path: Path) -> None:
        """Write the settings as JSON."""
        path.write_text(json.dumps(asdict(self), indent=2), encoding="utf-8")

    @classmethod
    def load(cls, path: Path) -> Reaction:
        """The settings from a file of `save`. Raises ReactionError when it cannot be read."""
        try:
            found = json.loads(path.read_text(encoding="utf-8"))
            lists = {key: tuple(found[key]) for key in ("bones", "flow", "gravity")}
            return cls(**found | lists | {"ink": tuple(map(tuple, found.get("ink", ())))})
        except (OSError, ValueError, TypeError, KeyError) as error:
            raise ReactionError(f"{path} cannot be read ({error}): start a new run") from error


def write_scene(imported: Path, reaction: Reaction) -> Path:
    """Change the scene and the model of an imported character to those of a reaction.

    imported  scene file that `flowborne import` has written
    returns   the new scene file, next to it
    raises    ReactionError when a free bone is no moving joint of the model
    """
    with imported.open("rb") as file:
        scene = tomllib.load(file)
    model = imported.parent / scene["solids"]["model"]
    tree = ElementTree.parse(model)
    _limit(tree, reaction)
    tree.write(model, encoding="utf-8")
    root = tree.find("worldbody//freejoint")
    assert root is not None, "flowborne import gives every character a root"
    path = imported.with_name("reaction.toml")
    path.write_text(toml(scene_of(scene, reaction, root.attrib["name"])), encoding="utf-8")
    return path


def _limit(tree: ElementTree.ElementTree[Any], reaction: Reaction) -> None:
    """Give the ball joints of free bones their range."""
    joints = {joint.attrib["name"]: joint for joint in tree.iterfind("worldbody//joint")}
    for bone in reaction.bones if not reaction.follows else ():
        if bone not in joints:
            raise ReactionError(
                f"bone '{bone}' moves nothing of its own: it has too little of the mesh, or is the "
                f"root. Select some of: {', '.join(joints)}"
            )
        if bone in reaction.cones:
            joints[bone].set("range", f"0 {reaction.cones[bone]:.6g}")
            joints[bone].set("limited", "true")


def scene_of(imported: Mapping[str, Any], reaction: Reaction, root: str) -> dict[str, Any]:
    """The tables of a scene, from those of an imported character.

    root  name of the character's free joint
    """
    scene = {key: value for key, value in imported.items() if key not in ("initial", "output")}
    time, slow = dict(scene["time"]), reaction.simulated or reaction.young > 0.0
    if reaction.young:
        scene["flesh"] = [table | {"young": reaction.young} for table in scene["flesh"]]
        least = math.ceil(FLESH_STEPS_PER_SECOND / reaction.rate)
        time["steps_per_frame"] = max(time["steps_per_frame"], least)
    if reaction.simulated:
        domain = dict(scene["domain"])
        sides = [high - low for low, high in zip(domain["lower"], domain["upper"], strict=True)]
        cell = max(sides) / reaction.resolution
        steps = time["steps_per_frame"] * reaction.resolution / domain["resolution"]
        crossed = math.hypot(*reaction.flow) / reaction.rate / cell
        time["steps_per_frame"] = math.ceil(max(steps, crossed))
        scene["domain"] = domain | {"resolution": reaction.resolution}
        scene["fluid"] = {"density": reaction.medium, "velocity": reaction.flow}
        if reaction.ink:
            lower, upper = reaction.ink
            scene["dye"] = [{"kind": "box", "lower": lower, "upper": upper}]
        far = {"kind": "far", "velocity": reaction.flow}
        scene["boundaries"] = {f"{axis}_{end}": far for axis in "xyz" for end in ("min", "max")}
    else:
        for table in ("domain", "fluid", "boundaries"):
            scene.pop(table)
        scene["wind"] = [{"kind": "faces", "velocity": reaction.flow, "density": reaction.medium}]
    if not reaction.follows:
        scene["control"] = [
            {"joints": reaction.bones, "strength": reaction.strength, "probe": PROBES[slow]}
        ]
        scene["objectives"] = [*_objectives(reaction)]
        scene["controller"] = SLOW if slow else QUICK
    return scene | {
        "gravity": reaction.gravity,
        "time": time | {"frames_per_second": reaction.rate, "frames": reaction.frames},
        "clip": scene["clip"] | {"loop": reaction.loop, "free": [root] if reaction.floats else []},
        "output": {"checkpoint_every": CHECKPOINT_FRAMES},
    }


def _objectives(reaction: Reaction) -> Iterator[dict[str, Any]]:
    """Entries of [[objectives]]."""
    if reaction.objective == "effort":
        yield {"kind": "effort"}
    else:
        goal, what = reaction.objective.split("-")
        direction = UP if what == "lift" else reaction.flow
        yield {"kind": "drag", "goal": goal, "direction": direction}
    if reaction.follow > 0.0:
        for bone in reaction.bones:
            yield {"kind": "input-motion", "joint": bone, "weight": reaction.follow}


def cost_of(path: Path, reaction: Reaction) -> str:
    """Cells, memory and time of a scene of `write_scene` with a simulated flow, for people."""
    with path.open("rb") as file:
        domain = tomllib.load(file)["domain"]
    sides = [high - low for low, high in zip(domain["lower"], domain["upper"], strict=True)]
    cells = math.prod(math.ceil(s / max(sides) * domain["resolution"] - 1e-9) for s in sides)
    megabytes = BASE_MEGABYTES + BYTES_PER_CELL * cells / 1e6
    free = 0 if reaction.follows else len(reaction.bones)
    per_cell = SECONDS_PER_CELL + SECONDS_PER_CELL_AND_BONE * free
    minutes = cells * per_cell * reaction.frames / 60.0
    return f"{cells} cells, {megabytes / 1e3:.1f} GB, about {math.ceil(minutes)} min"


def toml(tables: Mapping[str, Any]) -> str:
    """A TOML file of nested tables of texts, numbers, booleans, and lists of them."""
    return "".join(f"{_key(key)} = {_value(value)}\n" for key, value in tables.items())


def _value(value: Any) -> str:
    if isinstance(value, Mapping):
        return "{" + ", ".join(f"{_key(key)} = {_value(v)}" for key, v in value.items()) + "}"
    if isinstance(value, list | tuple):
        return "[" + ", ".join(map(_value, value)) + "]"
    return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")


def _key(key: str) -> str:
    return _value(str(key))
