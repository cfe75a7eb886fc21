"""Samples for Blender: tail and wings in wind, hair in water, a soft belly. A .blend and a picture.

    python tools/blender_sample.py --engine .venv --out build/blender-sample [NAME ...]

It needs Blender as a module, as `make blender-sample` installs it. A sample uses what an animator
uses in the panel. Its picture shows a frame before the run (left) and after it (right).
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from math import radians
from pathlib import Path
from typing import Any

import bpy
import numpy as np

from blender_characters import PERIOD, Colour, Point, bear, bird, fox, paint, swimmer

sys.path.insert(0, str(Path(__file__).parents[1]))

from blender.ink import add_ink
from blender.job import Job
from blender.jobs import start_job
from blender.panel import register

SIZE = 480, 400
"""Pixels of each half of a picture."""


@dataclass(frozen=True)
class Sample:
    """A character, and what an animator sets.

    character  makes it
    preset     free bones by their names
    limit      IK limits of the free bones, degrees
    pictured   frame
    camera     its place and the point at which it aims, m
    sky        colour of what is around
    ground     its colour; empty without one
    arrows     where they start
    along      direction of the flow, x or y
    wind       m/s of a Wind field; 0 without one
    ink        centre and size of a box in which the water is coloured, m
    settings   of the panel
    """

    character: Callable[[], Any]
    preset: str
    limit: float
    pictured: int
    camera: tuple[Point, Point]
    sky: Colour
    arrows: tuple[Point, ...]
    ground: Colour | tuple[()] = ()
    along: Point = (0.0, 1.0, 0.0)
    wind: float = 0.0
    ink: tuple[Point, Point] | tuple[()] = ()
    settings: dict[str, Any] = field(default_factory=dict)


SAMPLES = {
    "tail": Sample(
        fox,
        "TAIL",
        limit=30.0,
        pictured=13,
        camera=((4.8, -2.2, 2.6), (0.3, 1.25, 0.75)),
        sky=(0.62, 0.76, 0.9),
        ground=(0.22, 0.30, 0.13),
        along=(1.0, 0.0, 0.0),
        arrows=((-1.5, 1.7, 0.75), (-1.5, 2.4, 0.75), (-1.5, 3.1, 0.75)),
        wind=12.0,
        settings={"density": 60.0, "rounds": 4, "strength": radians(180.0), "follow": 0.05},
    ),
    "hair": Sample(
        swimmer,
        "HAIR",
        limit=60.0,
        pictured=19,
        camera=((2.3, -1.5, 1.1), (0.0, 0.55, 0.1)),
        sky=(0.05, 0.28, 0.42),
        arrows=((-0.45, -0.35, 0.3), (-0.45, 0.25, 0.5), (-0.45, 0.85, 0.3)),
        ink=((-0.12, -0.4, 0.35), (0.08, 0.08, 0.35)),
        settings={
            "medium": "WATER",
            "flow": (0.0, 1.0, 0.0),
            "simulated": True,
            "resolution": 40,
            "preroll": 12,
            "strength": radians(180.0),
        },
    ),
    "wings": Sample(
        bird,
        "WING",
        limit=50.0,
        pictured=13,
        camera=((1.1, -1.9, 1.9), (0.0, 0.15, 1.5)),
        sky=(0.35, 0.56, 0.85),
        arrows=((-0.6, -0.5, 1.62), (0.0, -0.55, 1.72), (0.5, -0.6, 1.35)),
        wind=8.0,
        settings={"density": 60.0, "rounds": 4, "strength": radians(720.0), "follow": 0.02},
    ),
    "belly": Sample(
        bear,
        "SOFT",
        limit=60.0,
        pictured=13,
        camera=((3.3, -1.3, 1.0), (0.0, -0.1, 0.72)),
        sky=(0.62, 0.76, 0.9),
        ground=(0.22, 0.30, 0.13),
        arrows=(),
        settings={"flow": (0.0, 0.0, 0.0), "flesh": "FOLLOW", "stiffness": 15.0, "rounds": 4},
    ),
}


def main() -> None:
    """Build, run, bake and render the samples."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--engine", required=True, help="environment of flowborne")
    parser.add_argument("--out", type=Path, required=True, help="folder")
    parser.add_argument("names", nargs="*", metavar="NAME", help=f"all of {', '.join(SAMPLES)}")
    told = parser.parse_args()
    out = told.out.absolute()
    out.mkdir(parents=True, exist_ok=True)
    bpy.context.preferences.filepaths.save_version = 0
    for name in told.names or SAMPLES:
        make(name, SAMPLES[name], told.engine, out)


def make(name: str, sample: Sample, engine: str, out: Path) -> None:
    """One sample: NAME.blend, its run, and blender-NAME.webp."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    if not hasattr(bpy.types.Object, "flowborne"):
        register()
    scene = bpy.context.scene
    scene.frame_start, scene.frame_end = 1, 1 + PERIOD
    rig = sample.character()
    surroundings(sample)
    settings(rig, sample)
    bpy.ops.wm.save_as_mainfile(filepath=str(out / f"{name}.blend"))
    halves = [picture(sample, out)]
    job = start_job(bpy.context, engine)
    finish(name, job)
    if job.reaction.young:
        bpy.ops.flowborne.flesh()
    if not job.reaction.follows:
        bpy.ops.flowborne.bake(bones="FREE")
    if sample.ink:
        job.start_export()
        finish(name, job)
        add_ink(bpy.context, job)
    bpy.ops.wm.save_mainfile(compress=True)
    halves.append(picture(sample, out))
    beside(halves, out / f"blender-{name}.webp")


def surroundings(sample: Sample) -> None:
    """Sun, sky, camera and arrows along the flow; a ground and a Wind field where there is one."""
    scene = bpy.context.scene
    if sample.ground:
        bpy.ops.mesh.primitive_plane_add(size=60.0)
        bpy.context.object.data.materials.append(paint(sample.ground))
    bpy.ops.object.light_add(type="SUN", rotation=(radians(40.0), radians(-25.0), 0.0))
    bpy.context.object.data.energy = 2.2
    scene.world = bpy.data.worlds.new("sky")
    scene.world.use_nodes = True
    background = scene.world.node_tree.nodes["Background"]
    background.inputs["Color"].default_value = (*sample.sky, 1.0)
    place, target = sample.camera
    bpy.ops.object.camera_add(location=place)
    scene.camera = bpy.context.object
    aim = bpy.data.objects.new("aim", None)
    aim.location = target
    scene.collection.objects.link(aim)
    scene.camera.constraints.new("TRACK_TO").target = aim
    across = (0.0, radians(90.0), 0.0) if sample.along[0] else (radians(-90.0), 0.0, 0.0)
    if sample.wind:
        bpy.ops.object.effector_add(type="WIND", location=sample.arrows[0], rotation=across)
        bpy.context.object.field.strength = sample.wind
    size = float(np.linalg.norm(np.subtract(place, target))) / 6.0
    for start in sample.arrows:
        for shape, forward, scale in (
            (bpy.ops.mesh.primitive_cylinder_add, 0.0, (0.02, 0.02, 0.3)),
            (bpy.ops.mesh.primitive_cone_add, 0.4, (0.06, 0.06, 0.1)),
        ):
            shape(location=np.add(start, size * forward * np.array(sample.along)), rotation=across)
            bpy.context.object.scale = size * np.array(scale)
            bpy.context.object.data.materials.append(paint((0.9, 0.9, 0.9)))


def settings(rig: Any, sample: Sample) -> None:
    """What an animator sets in the panel."""
    bpy.context.view_layer.objects.active = rig
    bpy.ops.flowborne.preset(kind=sample.preset)
    for bone in rig.pose.bones:
        if bone.select:
            for axis in "xyz":
                setattr(bone, f"use_ik_limit_{axis}", True)
                setattr(bone, f"ik_min_{axis}", radians(-sample.limit))
                setattr(bone, f"ik_max_{axis}", radians(sample.limit))
    if sample.wind:
        fields = (each for each in bpy.data.objects if each.field and each.field.type == "WIND")
        rig.flowborne.wind = next(fields)
    if sample.ink:
        centre, size = sample.ink
        bpy.ops.mesh.primitive_cube_add(size=1.0, location=centre, scale=size)
        bpy.context.object.hide_render = True
        rig.flowborne.ink = bpy.context.object
        bpy.context.view_layer.objects.active = rig
    for name, value in sample.settings.items():
        setattr(rig.flowborne, name, value)


def finish(name: str, job: Job) -> None:
    """Wait for the end of a job, and say how long it took."""
    began = time.monotonic()
    while job.active:
        time.sleep(0.1)
        job.step()
    if not job.complete:
        raise SystemExit(job.message)
    print(f"{name}: {job.line}, {time.monotonic() - began:.0f} s")


def picture(sample: Sample, out: Path) -> np.ndarray:
    """(height, width, 4) one frame by Cycles, on processors alone."""
    scene = bpy.context.scene
    scene.frame_set(sample.pictured)
    scene.render.engine = "CYCLES"
    scene.view_settings.view_transform = "Standard"
    scene.cycles.samples, scene.cycles.use_denoising = 32, True
    scene.render.resolution_x, scene.render.resolution_y = SIZE
    scene.render.filepath = str(out / "half.png")
    bpy.ops.render.render(write_still=True)
    image = bpy.data.images.load(scene.render.filepath)
    pixels = np.array(image.pixels[:]).reshape(SIZE[1], SIZE[0], 4)
    bpy.data.images.remove(image)
    Path(scene.render.filepath).unlink()
    return pixels


def beside(halves: list[np.ndarray], path: Path) -> None:
    """Write pictures next to each other as one."""
    whole = bpy.data.images.new("whole", 2 * SIZE[0], SIZE[1])
    whole.pixels = np.concatenate(halves, axis=1).ravel().tolist()
    whole.file_format = "WEBP"
    whole.save(filepath=str(path), quality=85)


if __name__ == "__main__":
    main()
