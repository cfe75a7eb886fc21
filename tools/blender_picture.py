"""A frame of an exported run as Blender renders it, and the .blend file, without a screen.

    flowborne export runs/swimmer --out swimmer.usd
    python tools/blender_picture.py swimmer.usd --frame 45 --out swimmer.png --blend swimmer.blend

It needs Blender as a module: `pip install bpy`, in an environment of its own, for bpy asks for one
version of Python. Everything else comes with the .usd: creature, motion, dye, camera, frame rate.
"""

from __future__ import annotations

import argparse
import site
from math import radians
from pathlib import Path

import bpy

GUIDES = ("Forces", "Paths", "Bound")
"""Objects that help to look at a run, and are none of a picture's."""

INK = (0.02, 0.05, 0.12)
"""Colour of dye as light goes through it."""

THICK = 25.0
"""Light that dye of a concentration of 1 takes away, over a diameter of the creature."""

WATER = (0.30, 0.55, 0.68)
"""Colour of the background."""

SAMPLES = 96
"""Rays of a pixel."""


def main() -> None:
    """Render what the command line says."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("usd", type=Path, help="what `flowborne export` wrote")
    parser.add_argument("--frame", type=int, required=True)
    parser.add_argument("--out", type=Path, required=True, help="picture, .png")
    parser.add_argument("--blend", type=Path, help="scene for Blender, .blend")
    parser.add_argument("--width", type=int, default=1280, help="of the picture, pixels")
    parser.add_argument("--lens", type=float, help="focal length, mm; the run's own unless given")
    told = parser.parse_args()
    if not told.usd.is_file():
        parser.error(f"there is no file {told.usd}; write it by `flowborne export`")
    read(told.usd, told.lens)
    dress()
    light()
    render(told.frame, told.width, told.out.absolute(), told.blend)


def read(path: Path, lens: float | None) -> None:
    """An empty scene with the run in it, at the run's frame rate, seen by its camera."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.wm.usd_import(filepath=str(path.absolute()))
    scene = bpy.context.scene
    scene.render.fps = round(frame_rate(path))
    scene.camera = next(each for each in bpy.data.objects if each.type == "CAMERA")
    if lens is not None:
        scene.camera.data.lens = lens


def frame_rate(path: Path) -> float:
    """Of a stage, 1/s, by the USD that Blender brings."""
    own = Path(bpy.utils.resource_path("LOCAL"))
    site.addsitedir(str(next(own.glob("python/lib/*/site-packages"))))
    from pxr import Usd

    return float(Usd.Stage.Open(str(path)).GetTimeCodesPerSecond())


def dress() -> None:
    """Hide the guides, smooth what is round, and give dye its colour."""
    for name in GUIDES:
        if name in bpy.data.objects:
            bpy.data.objects[name].hide_render = True
    for each in bpy.data.objects:
        if each.type == "MESH":
            each.data.shade_smooth()
    for volume in bpy.data.volumes:
        volume.materials.append(ink(volume.name))


def ink(name: str) -> bpy.types.Material:
    """A volume that takes light away where there is dye."""
    material = bpy.data.materials.new(name)
    material.use_nodes = True
    nodes = material.node_tree.nodes
    nodes.clear()
    shader = nodes.new("ShaderNodeVolumePrincipled")
    shader.inputs["Color"].default_value = (*INK, 1.0)
    shader.inputs["Density Attribute"].default_value = name
    shader.inputs["Density"].default_value = THICK / diameter()
    output = nodes.new("ShaderNodeOutputMaterial")
    material.node_tree.links.new(shader.outputs["Volume"], output.inputs["Volume"])
    return material


def diameter() -> float:
    """Of the largest surface, m."""
    return max(max(each.dimensions) for each in bpy.data.objects if each.type == "MESH")


def light() -> None:
    """Daylight from above and behind the camera, in water that is bright all around."""
    sun = bpy.data.lights.new("Sun", "SUN")
    sun.energy, sun.angle = 2.2, radians(8.0)
    lamp = bpy.data.objects.new("Sun", sun)
    lamp.rotation_euler = (radians(35.0), radians(-20.0), 0.0)
    bpy.context.scene.collection.objects.link(lamp)
    world = bpy.data.worlds.new("Water")
    world.use_nodes = True
    background = world.node_tree.nodes["Background"]
    background.inputs["Color"].default_value = (*WATER, 1.0)
    bpy.context.scene.world = world


def render(frame: int, width: int, picture: Path, blend: Path | None) -> None:
    """One frame by Cycles, on processors alone."""
    scene = bpy.context.scene
    scene.frame_set(frame)
    scene.render.engine = "CYCLES"
    scene.view_settings.view_transform = "Standard"
    scene.cycles.samples = SAMPLES
    scene.cycles.use_denoising = True
    scene.render.resolution_x, scene.render.resolution_y = width, width * 9 // 16
    scene.render.filepath = str(picture)
    if blend is not None:
        bpy.ops.wm.save_as_mainfile(filepath=str(blend.absolute()))
    bpy.ops.render.render(write_still=True)


if __name__ == "__main__":
    main()
