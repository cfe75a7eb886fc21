"""Makes the films of the front page by Cycles, docs/hero-NAME.webp: `make hero-films`.

    make hero-films NAMES="whale eagle" CHARACTERS=models

A film is a run of flowborne, exported as USD, that tools/hero_scenes.py renders with Blender as a
module. All steps are in build/hero-films/NAME. What is there stays: a stopped film goes on.
CHARACTERS is a folder with files of https://github.com/Mesh2Motion/mesh2motion-app (CC0):
fish-whale.glb, shark-animations.glb, bird-eagle.glb, bird-animations.glb. `swimmer` needs none.
"""

from __future__ import annotations

import argparse
import subprocess
import xml.etree.ElementTree as ElementTree
from collections.abc import Mapping
from dataclasses import dataclass, field
from io import BytesIO
from pathlib import Path
from shutil import rmtree

import numpy as np
from PIL import Image

import flowborne as fb
from flowborne.base.atomic import write_atomically
from flowborne.scenes.load import load_scene
from flowborne.sim.endings import RunOutcome
from flowborne.sim.running import run
from hero_specks import drifting

TOOLS = Path(__file__).parent
DOCS = TOOLS.parent / "docs"

SAMPLES = 6
"""Rays of a pixel, before denoising."""

MAX_BYTES = 550_000
QUALITIES = (70, 65, 60, 55, 50, 45, 40)
"""Of the WebP: the first that gives at most MAX_BYTES, or the last."""


@dataclass(frozen=True)
class Character:
    """A rigged character, some of whose joints are free.

    file, animations, clip  as in `flowborne import`
    free                    joints that do not follow the clip
    cone                    largest angle of a free joint from its rest pose, degrees
    density                 kg/m^3
    scale                   m per unit of the file
    """

    file: str
    animations: str
    clip: str
    free: tuple[str, ...]
    cone: float
    density: float = 1000.0
    scale: float = 1.0


@dataclass(frozen=True)
class Film:
    """A run, and the length of its film.

    frames    of the run
    shown     frames of the film
    width     pixels; 16 to 9 of height
    scene     built-in one, or that of a character
    settings  changes of the scene, as those of `--set`
    specks    number of specks that drift with the flow
    rate      frames per second of the run, and of the film
    """

    frames: int
    shown: int
    width: int
    scene: str | Character
    settings: Mapping[str, str] = field(default_factory=dict)
    specks: int = 0
    rate: float = 24.0


def reaction(free: tuple[str, ...], strength: float, follow: float) -> dict[str, str]:
    """Settings for free joints with least effort.

    strength  degrees/s
    follow    weight of the distance from the clip, N m s/rad^2
    """
    near = ['{kind="effort"}']
    near += [f'{{kind="input-motion", joint="{joint}", weight={follow}}}' for joint in free]
    return {
        "clip.free": "[]",
        "control": f"[{{joints={list(free)}, strength={strength}}}]",
        "objectives": f"[{', '.join(near)}]",
    }


FINS, WINGS = ("front_fin_1_l", "front_fin_1_r"), ("wing_4_L", "wing_4_R")

FILMS = {
    "whale": Film(
        frames=100,
        shown=66,
        width=640,
        scene=Character(
            "fish-whale.glb", "shark-animations.glb", "Swim Horizontal", FINS, cone=50.0
        ),
        settings=reaction(FINS, strength=150.0, follow=200.0)
        | {
            "controller": '{servo={kind="pd", frequency=4.0}}',
            "time.steps_per_frame": "2",
            "domain.resolution": "44",
            "fluid.velocity": "[0.0, 1.5, 0.0]",
            "boundaries.y_min": '{kind="inflow", velocity=[0.0, 1.5, 0.0]}',
        },
        specks=500,
    ),
    "swimmer": Film(frames=158, shown=72, width=480, scene="swimmer", rate=30.0),
    "eagle": Film(
        frames=56,
        shown=56,
        width=480,
        scene=Character(
            "bird-eagle.glb", "bird-animations.glb", "Flap", WINGS, 40.0, density=60.0, scale=0.3
        ),
        settings=reaction(WINGS, strength=720.0, follow=0.1)
        | {
            "controller": '{velocities="present", hypothetical_time=0.05, '
            'rule={kind="golden-section", tolerance=0.1}, servo={kind="pd", frequency=4.0}}',
            "control.0.probe": "1.0",
            "time.steps_per_frame": "8",
            "domain.resolution": "8",
            "fluid": '{density=1.2, velocity=[0.0, 8.0, 0.0], coupling="none"}',
            "wind": '[{kind="faces", velocity=[0.0, 8.0, 0.0], density=1.2}]',
        },
    ),
}


def main() -> None:
    """Make the films that the command line names."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--blender", required=True, help="a Python with Blender as a module")
    parser.add_argument("--characters", type=Path, required=True, help="folder of the models")
    parser.add_argument("--out", type=Path, required=True, help="folder of the steps")
    parser.add_argument("names", nargs="*", metavar="NAME", help=f"all of {', '.join(FILMS)}")
    told = parser.parse_args()
    for name in told.names or FILMS:
        folder = told.out / name
        if not (folder / "run.usd").exists():
            simulate(FILMS[name], folder, told.characters)
        scenes = [told.blender, str(TOOLS / "hero_scenes.py"), name, str(folder)]
        subprocess.run(
            [*scenes, "--size", str(FILMS[name].width), "--samples", str(SAMPLES)], check=True
        )
        frames = sorted((folder / "frames").glob("*.png"))
        encode(frames, DOCS / f"hero-{name}.webp", FILMS[name].rate)


def simulate(film: Film, folder: Path, characters: Path) -> None:
    """Run and export the scene of a film.

    raises  SystemExit when the run does not get to its end
    """
    scene = film.scene
    if isinstance(scene, Character):
        scene = import_character(scene, folder / "scene", characters)
    loaded, made = load_scene(scene, film.settings), folder / "run"
    result = run(loaded, made, frames=film.frames, replace=True, film=False, progress=True)
    if result.outcome is not RunOutcome.DONE:
        raise SystemExit(f"{folder}: {result.message}")
    if film.specks:
        specks = drifting(fb.open_run(made), film.shown, film.specks)
        np.save(folder / "specks.npy", specks)
    fb.export(made, folder / "run.usd")


def import_character(character: Character, folder: Path, characters: Path) -> str:
    """Import a character anew and limit its free joints; returns its scene."""
    rmtree(folder, ignore_errors=True)
    made = fb.import_character(
        characters / character.file,
        folder,
        clip=character.clip,
        animations=characters / character.animations,
        density=character.density,
        scale=character.scale,
    )
    model = made.scene.with_suffix(".xml")
    tree = ElementTree.parse(model)
    for joint in tree.iterfind("worldbody//joint"):
        if joint.get("name") in character.free:
            joint.set("range", f"0 {character.cone}")
    tree.write(model)
    return str(made.scene)


def encode(pictures: list[Path], path: Path, rate: float) -> None:
    """Write pictures as an animated WebP of at most MAX_BYTES, if a quality gives it.

    Each frame is whole (`kmax`): frames that keep parts of earlier ones show blocks in soft light.
    """
    first, *others = [Image.open(each).convert("RGB") for each in pictures]
    for quality in QUALITIES:
        made = BytesIO()
        first.save(
            made,
            "WEBP",
            save_all=True,
            append_images=others,
            duration=round(1000.0 / rate),
            loop=0,
            quality=quality,
            method=6,
            kmin=0,
            kmax=1,
        )
        if made.tell() <= MAX_BYTES:
            break
    write_atomically(path, lambda file: file.write(made.getvalue()))


if __name__ == "__main__":
    main()
