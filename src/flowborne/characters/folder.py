"""A character as a folder that `flowborne run` takes: scene, model, meshes, clip."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np
import tomli_w

from flowborne.base.arguments import NUMBER, PATH, TEXT, or_none, several, takes
from flowborne.base.errors import SceneError
from flowborne.characters.division import Division, divided
from flowborne.characters.flesh import CharacterFlesh, flesh_of
from flowborne.characters.limits import check_work
from flowborne.characters.model import as_cycle, clip_of, model_files, posed
from flowborne.characters.rig import (
    Action,
    Rig,
    Surface,
    heaviest,
    one_tree,
    printable,
    scaled,
    size_notes,
)
from flowborne.characters.source import clip_number, read_source
from flowborne.kernels.arrays import Array
from flowborne.motion.bvh import bvh_text
from flowborne.motion.clip import Clip
from flowborne.scenes.bodies import bones_of
from flowborne.scenes.build import build
from flowborne.scenes.flesh import meshed
from flowborne.scenes.load import load_scene
from flowborne.scenes.warn_speed import steps_for_bodies
from flowborne.solids.skins import skinned
from flowborne.solids.tissue.mesh_file import mesh_bytes

MARGIN = 0.35
"""Water on every side of the region reached by the clip, relative to its longest side."""

DENSITIES = (1e-3, 1e6)
"""kg/m^3"""

MAX_STEM_BYTES = 150
"""Length of the file name's stem that all files of a character share."""

YOUNG = 5e4
"""Young's modulus of flesh, N/m^2: that of relaxed muscle and fat."""

CELLS = 64
"""Cells along the longest side of the domain."""

SIDES = "\n".join(f'{axis}_{end} = "open"' for axis in "xyz" for end in ("min", "max"))


@dataclass(frozen=True)
class Imported:
    """The result of an import.

    scene  file of the scene
    notes  sentences about joints, surface and clip
    """

    scene: Path
    notes: tuple[str, ...]


@takes(
    file=PATH,
    out=PATH,
    clip=or_none(TEXT),
    animations=or_none(PATH),
    density=NUMBER,
    scale=NUMBER,
    flesh=several(TEXT, "names of joints"),
)
def import_character(
    file: str | Path,
    out: str | Path,
    *,
    clip: str | None = None,
    animations: str | Path | None = None,
    density: float = 1000.0,
    scale: float = 1.0,
    fill: bool = False,
    flesh: Sequence[str] = (),
) -> Imported:
    """Make a scene of a rigged character in a new folder.

    The character floats in a box of water, and its joints follow the clip. Users are expected to
    edit the scene.

    file        .glb, .gltf, .fbx or USD with a skeleton and a surface bound to it
    out         folder, created if missing
    clip        name of the clip; the only one by default
    animations  file of the clip, with joints of the same names; `file` by default
    density     kg/m^3
    scale       of the character's size, 0.01 for a file in centimetres
    fill        whether to close holes of any size instead of small ones only
    flesh       names of joints whose bodies are flesh around a thin core
    raises      SceneError when a file cannot be used, a library is missing, or the scene exists;
                OSError when the folder cannot be written
    """
    if not DENSITIES[0] <= density <= DENSITIES[1]:
        raise SceneError(
            f"density is {density:g} kg/m^3; it must be {DENSITIES[0]:g} to {DENSITIES[1]:g}. Give "
            "1000 for neutral buoyancy in water."
        )
    path = Path(file)
    name = _plain(path.stem)
    scene = Path(out) / f"{name}.toml"
    if scene.exists():
        raise SceneError(
            f"{scene} already exists and may have been edited. Name another folder, or remove it "
            "first."
        )
    source = read_source(path)
    surface = source.surface
    if surface is None:
        raise SceneError(
            f"{path.name} has no skin: no mesh is bound to its joints. Export the mesh with its "
            "weights, and do not apply the armature modifier."
        )
    moves = path if animations is None else Path(animations)
    moving = source if animations is None else read_source(moves)
    number = clip_number(moving, clip, moves.name)
    rig, surface = scaled(source.rig, surface, scale, path.name)
    skeleton, action = moving.rig, moving.action(number)
    if animations is None:
        skeleton, action = rig, replace(action, position=scale * action.position)
    rig, surface, skeleton, action, hung = _as_trees(rig, surface, skeleton, action)
    check_work(len(action.position), len(rig.names), len(surface.vertices), moves.name)
    shared = set(rig.names) & set(skeleton.names)
    if not shared:
        raise SceneError(
            f"{moves.name} has none of the joints of {path.name}, which are "
            f"{', '.join(rig.names)}. Give clips of the same skeleton."
        )
    division = divided(rig, surface, path.name, fill, flesh)
    soft = flesh_of(rig, division, flesh, path.name)
    sizes = tuple(size_notes(surface.vertices, density * division.volume, scale, path.name))
    pose = posed(rig, skeleton, action)
    once, strays = clip_of(rig, division, pose)
    cycle = as_cycle(once)
    motion = cycle or once
    files = model_files(name, rig, division, surface, density, soft)
    files[f"{name}.bvh"] = bvh_text(motion).encode()
    called = printable(f"{path.name}, {moving.clips[number]}")
    text = partial(_scene, name, called, motion, cycle is not None, _reach(rig, surface, pose))
    tissue = "" if soft is None else _flesh_table(name, rig, soft, density)
    files[scene.name] = (text() + tissue).encode()
    for made, content in files.items():
        target = Path(out) / made
        target.parent.mkdir(parents=True, exist_ok=True)
        target.write_bytes(content)
    try:
        steps = _steps(scene)
    except SceneError:
        scene.unlink()  # a scene that cannot run must not block the next import
        raise
    scene.write_bytes((text(steps) + tissue).encode())
    if soft is not None:
        _keep_mesh(scene)
    left_out = printable(", ".join(source.left_out))
    notes = (
        *hung,
        *_body_notes(rig, division, density),
        *([f"left out, because they have no weights for joints: {left_out}"] if left_out else []),
        *sizes,
        _clip_note(motion, moving.clips[number], strays),
    )
    return Imported(scene, notes)


def _as_trees(
    rig: Rig, surface: Surface, skeleton: Rig, action: Action
) -> tuple[Rig, Surface, Rig, Action, list[str]]:
    """Character and clip with one root each, and a note if the character had several."""
    roots = [name for name, parent in zip(rig.names, rig.parents, strict=True) if parent < 0]
    flat = len(roots) > 1
    main = heaviest(surface) if flat else 0
    known = rig.names[main] if flat and rig.names[main] in skeleton.names else skeleton.names[0]
    tree, order = one_tree(rig, main)
    own, moving = one_tree(skeleton, skeleton.names.index(known))
    notes = [
        f"its joints have no common root: {len(roots) - 1} of {len(roots)} without a parent hang "
        f"on '{rig.names[main]}', which has the most weight; parents in the file make chains of "
        "them (Blender: Armature, Parent, Make)"
    ]
    return (
        tree,
        replace(surface, weights=surface.weights[:, order]),
        own,
        replace(action, position=action.position[:, moving], rotation=action.rotation[:, moving]),
        notes if flat else [],
    )


def _plain(stem: str) -> str:
    """A name for files and models."""
    plain = "".join(c if c.isalnum() or c in "-_" else "-" for c in stem) or "character"
    return plain.encode()[:MAX_STEM_BYTES].decode(errors="ignore")


def _reach(rig: Rig, surface: Surface, pose: Action) -> tuple[Array, Array]:
    """(3,) lower and upper corner of the surface at rest and in every frame, m."""
    turn = pose.rotation @ np.swapaxes(rig.rotation, 1, 2)
    shift = pose.position - np.einsum("fnij,nj->fni", turn, rig.position)
    low, high = surface.vertices.min(axis=0), surface.vertices.max(axis=0)
    for turned, shifted in zip(turn, shift, strict=True):
        points = skinned(surface.vertices, surface.weights, turned, shifted)
        low, high = np.minimum(low, points.min(axis=0)), np.maximum(high, points.max(axis=0))
    return low, high


def _steps(scene: Path) -> int:
    """Steps per frame with which the fastest body of a scene crosses at most one cell per step."""
    loaded = load_scene(scene)
    return steps_for_bodies(loaded, build(loaded).world.setup)


def _scene(
    name: str, called: str, clip: Clip, loop: bool, reach: tuple[Array, Array], steps: int = 1
) -> str:
    """The scene file, with comments for the user."""
    low, high = reach
    room = MARGIN * float((high - low).max())
    root, last = clip.names[0], clip.names[-1]
    return f"""description = {_quoted(called)}
dimensions = 3

[time]
frames_per_second = {1.0 / clip.frame_time:.6g}
frames = {clip.frames - 1}
# the fastest body crosses at most one cell per step
steps_per_frame = {steps}

# z is up; +z of a glTF file is -y here, as in Blender
[domain]
lower = {_corner(low - room)}
upper = {_corner(high + room)}
resolution = {CELLS}

[fluid]
density = 1000.0

[boundaries]
{SIDES}

[solids]
model = "{name}.xml"

# All joints follow the clip except free ones, which forces move: the root floats.
# Joints of a [[control]] do not follow it.
[clip]
file = "{name}.bvh"
loop = {str(loop).lower()}
free = [{_quoted(root)}]

# it starts in the clip's first pose, with zero total momentum of body and water
[initial]
impulse = "none"

# [[control]]
# joints = [{_quoted(last)}]
# strength = 60.0
#
# [[objectives]]
# kind = "effort"

[output]
exports = ["{name}.glb"]
"""


def _flesh_table(name: str, rig: Rig, flesh: CharacterFlesh, density: float) -> str:
    """The table of the flesh in a scene file."""
    bones, neighbours = (
        ", ".join(_quoted(rig.names[joint]) for joint in joints)
        for joints in (flesh.cores, flesh.neighbours)
    )
    return f"""
[[flesh]]
name = "flesh"
bones = [{bones}]
neighbours = [{neighbours}]
surface = "{name}-meshes/flesh.obj"
size = {flesh.edge:.4g}
mesh = "{name}-flesh.npz"
young = {YOUNG:g}
density = {density:g}
"""


def _keep_mesh(scene: Path) -> None:
    """Write the mesh of the flesh of a scene to the file that the scene names."""
    loaded = load_scene(scene)
    (table,) = loaded.flesh
    assert table.mesh is not None
    mesh, recipe = meshed(bones_of(loaded), table, loaded.folder)
    (loaded.folder / table.mesh).write_bytes(mesh_bytes(mesh, recipe))


def _quoted(text: str) -> str:
    """A text as a TOML string."""
    return tomli_w.dumps({"text": text}).partition("= ")[2].strip()


def _corner(point: Array) -> list[float]:
    return [float(f"{x:.4g}") for x in point]


def _body_notes(rig: Rig, division: Division, density: float) -> Sequence[str]:
    """Notes on joints, bodies and mass."""
    rigid = [
        name
        for n, name in enumerate(rig.names)
        if division.owners[n] != n and n not in division.unsound
    ]
    lines = [
        f"{len(division.bodies)} bodies of {len(rig.names)} joints, {division.volume:.4g} m^3, "
        f"{density * division.volume:.4g} kg"
    ]
    if division.filled:
        count, widest = len(division.filled), max(division.filled)
        lines.append(f"{count} hole{'s' * (count > 1)} closed, the widest {widest:.3g} m across")
    if rigid:
        lines.append(f"rigid with their parent joint: {', '.join(rigid)}")
    if division.unsound:
        names = [rig.names[joint] for joint in division.unsound]
        lines.append(
            "joined to their neighbour, as the piece between their cuts is no body of its own "
            f"(inside out, or folded): {', '.join(names)}"
        )
    return lines


def _clip_note(clip: Clip, name: str, strays: float) -> str:
    return (
        f"clip '{name}': {clip.frames} frames in {clip.duration:.4g} s; its joints are at most "
        f"{strays:.2g} m from where the file has them"
    )
