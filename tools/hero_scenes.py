"""Frames of a hero film by Cycles; `tools/hero_films.py` runs it with Blender as a module.

    python tools/hero_scenes.py whale build/hero-films/whale --size 640 --samples 6

The folder has run.usd, and specks.npy where the film has specks. Frames are written to its folder
frames; those that are there stay.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import bpy
import numpy as np

from hero_nodes import Colour, Nodes, Point, add_object, turned_to
from hero_sea import Sea
from hero_water import Water

FADE = 12
"""Frames at the end of a loop that pass over to those before its start."""

THREADS = 2

QUARTER = 0.25
"""Size of the swimmer in its film."""

CORAL = (0.95, 0.18, 0.015)
"""Colour of the swimmer; water takes away most of its red."""

SPECK = 0.012
"""Half the width of a speck, m."""

Update = Callable[[int], None]


def main() -> None:
    """Render the frames that are missing."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("name", choices=SCENES)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--size", type=int, required=True, help="width, pixels")
    parser.add_argument("--samples", type=int, required=True, help="of a pixel")
    parser.add_argument("--frames", type=int, nargs="*", help="all unless given")
    told = parser.parse_args()
    folder = told.folder.absolute()
    frames, update = SCENES[told.name](folder)
    settings(told.size, told.samples)
    scene = bpy.context.scene
    for frame in frames if told.frames is None else told.frames:
        path = folder / "frames" / f"{frame:04d}.png"
        if not path.exists():
            scene.frame_set(frame)
            update(frame)
            scene.render.filepath = str(path)
            bpy.ops.render.render(write_still=True)


def settings(width: int, samples: int) -> None:
    """Cycles on processors alone, with denoising."""
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    scene.render.threads_mode, scene.render.threads = "FIXED", THREADS
    scene.render.use_persistent_data = True
    scene.render.resolution_x, scene.render.resolution_y = width, width * 9 // 16
    scene.view_settings.view_transform = "AgX"
    scene.view_settings.look = "AgX - Medium High Contrast"
    cycles = scene.cycles
    cycles.samples, cycles.use_denoising, cycles.denoising_quality = samples, True, "BALANCED"
    cycles.max_bounces, cycles.diffuse_bounces, cycles.transparent_max_bounces = 3, 1, 16
    cycles.volume_biased, cycles.volume_step_rate = True, 3.0
    cycles.caustics_reflective = cycles.caustics_refractive = False


def whale(folder: Path) -> tuple[range, Update]:
    """Seen from below, with specks that drift in the stream."""
    specks = np.load(folder / "specks.npy")
    frames = len(specks)
    skin = read(folder / "run.usd")
    middle = skin.poses[-frames:].mean((0, 1))
    poses, specks[..., :3] = looped(skin.poses - middle, frames), specks[..., :3] - middle
    camera = (4.3, -3.3, -1.9), (0.1, 0.15, 0.45)
    water = Water(frames, sun=(-0.25, 0.2, 0.9), surface=4.5, clear=(0.8, 0.925, 0.945))
    water.add()
    water.add_rays(camera, (9.5, 12.5, 16.0), 0.9)
    add_camera(camera, lens=29.0)
    body = add_body(skin, water, 2)
    cloud = add_mesh("specks", *octahedra(specks[0]))
    cloud.data.materials.append(water.material("specks", lambda nodes: (0.8, 0.9, 0.85)))

    def update(frame: int) -> None:
        put(body, poses[frame])
        put(cloud, octahedra(specks[frame])[0])

    return range(frames), update


def swimmer(folder: Path) -> tuple[range, Update]:
    """Above sand on which waves focus light; the ink is a volume. A quarter as large as its run."""
    skin = read(folder / "run.usd")
    camera = (2.9, -2.6, -0.75), (0.0, 0.0, -0.1)
    water = Water(len(skin.poses), sun=(-0.3, 0.1, 0.9), surface=3.0, clear=(0.85, 0.9, 0.92))
    water.add()
    water.add_rays(camera, (5.5, 7.5, 10.0), 0.8)
    water.add_sand(-2.2)
    add_camera(camera, lens=33.0)
    body = add_body(replace(skin, colours=[CORAL] * len(skin.colours)), water, 1)
    ink = bpy.data.volumes.new("ink")
    add_object("ink", ink).scale = (QUARTER,) * 3
    ink.materials.append(water.ink("ink", 12.0))

    def update(frame: int) -> None:
        put(body, QUARTER * skin.poses[frame])
        ink.filepath = str(folder / "run_dye" / f"run_{frame:04d}.vdb")

    return range(86, 158), update


def eagle(folder: Path) -> tuple[range, Update]:
    """Low over a sea, against the sun; the camera flies along."""
    frames, cycle = 56, 14
    skin = read(folder / "run.usd")
    poses = looped(skin.poses, cycle)
    poses += np.array([0.0, 0.0, 1.7]) - poses.mean((0, 1))
    camera = (2.2, -2.4, 2.1), (0.0, 0.15, 1.68)
    sea = Sea(frames, 24.0, speed=(0.0, -8.0), waves=1.3, camera=camera)
    sea.add_light(fill=(0.8, -0.9, 0.5))
    add_camera(camera, lens=38.0)
    focus = bpy.context.scene.camera.data.dof
    focus.use_dof, focus.focus_distance, focus.aperture_fstop = True, 3.4, 1.0
    body = add_body(replace(skin, colours=[*map(brown, skin.colours)]), sea, 2)
    surface = add_mesh("sea", sea.flat, sea.faces())
    surface.data.shade_smooth()
    surface.data.materials.append(sea.water())

    def update(frame: int) -> None:
        put(body, poses[frame % cycle])
        put(surface, sea.points(frame))

    return range(frames), update


def brown(base: Colour) -> Colour:
    """A colour of the model, with brown plumage for its red one."""
    return (0.8 * base[0], 0.35 * base[0], 0.15 * base[0]) if base[1] == 0.0 else base


SCENES = {"whale": whale, "swimmer": swimmer, "eagle": eagle}


@dataclass(frozen=True)
class Skin:
    """Surfaces of a run as one.

    colours  of the materials
    faces    corners of each face, and `kinds`, the number of its material
    poses    (frames, n, 3) m, vertices
    """

    colours: list[Colour]
    faces: list[tuple[int, ...]]
    kinds: list[int]
    poses: np.ndarray


def read(path: Path) -> Skin:
    """The surfaces of a run, then an empty scene; vertices that surfaces have in common are one."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.wm.usd_import(filepath=str(path))
    scene = bpy.context.scene
    seen = [
        each for each in bpy.data.objects if each.type == "MESH" and each.parent.name != "Bound"
    ]
    poses = []
    for frame in range(scene.frame_start, scene.frame_end + 1):
        scene.frame_set(frame)
        poses.append(np.concatenate([vertices(each) for each in seen]))
    corners, one = np.unique(poses[0].round(4), axis=0, return_index=True, return_inverse=True)[1:]
    faces, kinds, start = [], [], 0
    for number, each in enumerate(seen):
        faces += [tuple(one.ravel()[start + np.array(p.vertices)]) for p in each.data.polygons]
        kinds += [number] * len(each.data.polygons)
        start += len(each.data.vertices)
    colours = [colour(each.data.materials[0]) for each in seen]
    bpy.ops.wm.read_factory_settings(use_empty=True)
    return Skin(colours, faces, kinds, np.array(poses)[:, corners])


def colour(material: Any) -> Colour:
    """Base colour of an imported material."""
    return tuple(material.node_tree.nodes["Principled BSDF"].inputs["Base Color"].default_value)[:3]


def vertices(thing: Any) -> np.ndarray:
    """(n, 3) m, of an object as it is moved and bent in the present frame."""
    mesh = thing.evaluated_get(bpy.context.evaluated_depsgraph_get()).to_mesh()
    points = np.empty(3 * len(mesh.vertices))
    mesh.vertices.foreach_get("co", points)
    matrix = np.array(thing.matrix_world)
    return points.reshape(-1, 3) @ matrix[:3, :3].T + matrix[:3, 3]


def looped(poses: np.ndarray, frames: int) -> np.ndarray:
    """The last frames, which pass over to those before them."""
    made, share = poses[-frames:].copy(), np.linspace(0.0, 1.0, FADE)[:, None, None]
    made[-FADE:] += share * (poses[-frames - FADE : -frames] - made[-FADE:])
    return made


def add_mesh(name: str, points: np.ndarray, faces: list[tuple[int, ...]]) -> Any:
    """A new object of (n, 3) points, m, and the corners of each face."""
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(points.tolist(), [], faces)
    return add_object(name, mesh)


def add_body(skin: Skin, around: Water | Sea, levels: int) -> Any:
    """The skin, with its colours, mottled; `levels` of subdivision make it round."""
    thing = add_mesh("body", skin.poses[0], skin.faces)
    thing.data.shade_smooth()
    thing.modifiers.new("round", "SUBSURF").render_levels = levels
    rest = thing.data.attributes.new("rest", "FLOAT_VECTOR", "POINT")
    rest.data.foreach_set("vector", skin.poses[0].ravel())
    for number, each in enumerate(skin.colours):
        material = around.material(f"skin {number}", partial(mottled, base=each))
        thing.data.materials.append(material)
    thing.data.polygons.foreach_set("material_index", skin.kinds)
    return thing


def mottled(nodes: Nodes, base: Colour) -> Any:
    """A colour with spots that stay where they are on the skin."""
    rest = nodes.add("Attribute", attribute_name="rest")["Vector"]
    spots = nodes.add("TexNoise", {"Vector": rest, "Scale": 3.5, "Detail": 5.0})[0]
    return nodes.mix(nodes.smooth(spots, 0.3, 0.7), tuple(0.55 * c for c in base), base)


def octahedra(specks: np.ndarray) -> tuple[np.ndarray, list[tuple[int, ...]]]:
    """Corners and faces of specks, whose last column is their relative size."""
    corners = np.vstack([np.eye(3), -np.eye(3)])
    points = specks[:, None, :3] + SPECK * specks[:, None, 3:] * corners
    sides = [(x, y, z) for x in (0, 3) for y in (1, 4) for z in (2, 5)]
    faces = [tuple(6 * k + c for c in side) for k in range(len(specks)) for side in sides]
    return points.reshape(-1, 3), faces


def put(thing: Any, points: np.ndarray) -> None:
    """Move the vertices of an object."""
    thing.data.vertices.foreach_set("co", points.ravel())
    thing.data.update()


def add_camera(camera: tuple[Point, Point], lens: float) -> None:
    """A camera at a place that looks at another, both in m; focal length in mm."""
    place, target = camera
    thing = add_object("camera", bpy.data.cameras.new("camera"))
    thing.data.lens, thing.location = lens, place
    thing.rotation_euler = turned_to(np.subtract(target, place), "-Z")
    bpy.context.scene.camera = thing


if __name__ == "__main__":
    main()
