"""Makes docs/gallery.md and its pictures from the built-in scenes: `make gallery`.

The library is the only list, in the groups of `flowborne scenes`. `make gallery` makes the
pictures that are missing and writes the page; `make gallery NAMES="eel swimmer"` makes these
pictures again.
"""

from __future__ import annotations

import shlex
import sys
from collections.abc import Callable, Mapping
from contextlib import closing
from dataclasses import dataclass, field
from io import BytesIO
from math import radians, tan
from pathlib import Path
from tempfile import TemporaryDirectory

from PIL import Image

from flowborne.scenes.listing import (
    FLESHY,
    FLYERS,
    GROUPS,
    IN_STREAM,
    IN_WIND,
    OPEN,
    ROBOTS,
    VEHICLES,
    WALKERS,
    group_of,
    has_gas,
    has_inflow,
)
from flowborne.scenes.load import load_scene, read_scene, scene_names
from flowborne.scenes.schema import Scene
from flowborne.scenes.schema_film import CameraTable
from flowborne.sim.endings import RunOutcome
from flowborne.sim.running import run
from flowborne.view.pictures import Picture
from flowborne.view.run import Run
from markdown_text import plain
from marked import with_part

DOCS = Path(__file__).parents[1] / "docs"
PAGE, FOLDER = DOCS / "gallery.md", DOCS / "gallery"

SIZE = (480, 360)
"""Width and height of a picture, pixels."""

OVERSAMPLING = 2
"""Pixels that are drawn for one of the picture, along each side."""

MAX_BYTES = 30_000
QUALITIES = (88, 80, 70, 60, 50, 40)
"""Of the WebP: the first that gives at most MAX_BYTES, or the last."""

MANY_JOINTS = 10
"""Controlled joints from which a creature in three dimensions runs on a coarser grid."""


@dataclass(frozen=True)
class GroupRun:
    """Scenes of a group of the library, and the run of each that gives its picture.

    title     heading of the group
    holds     whether a scene of the group is one of them
    frame     number of the frame that is shown; the last one of a shorter scene
    settings  changes of the scene, as those of `--set`
    """

    title: str
    holds: Callable[[Scene], bool]
    frame: int
    settings: Mapping[str, str] = field(default_factory=dict)

    @property
    def options(self) -> str:
        """The settings on a command line."""
        return " ".join(f"--set {shlex.quote(f'{k}={v}')}" for k, v in self.settings.items())


RUNS = (
    GroupRun(OPEN, lambda scene: scene.dimensions == 2, 300),
    GroupRun(OPEN, has_gas, 320, {"domain.resolution": "36"}),
    GroupRun(
        OPEN,
        lambda scene: len(scene.controlled_joints()) >= MANY_JOINTS,
        48,
        {"domain.resolution": "36"},
    ),
    GroupRun(OPEN, lambda scene: bool(scene.flesh), 40, {"domain.resolution": "30"}),
    GroupRun(OPEN, lambda scene: True, 140),
    GroupRun(WALKERS, lambda scene: True, 60),
    GroupRun(IN_WIND, lambda scene: True, 80),
    GroupRun(IN_STREAM, lambda scene: True, 100, {"domain.resolution": "64"}),
    GroupRun(FLYERS, lambda scene: not scene.flesh, 320),
    GroupRun(FLYERS, lambda scene: True, 20, {"time.frames_per_second": "15.0"}),
    GroupRun(
        FLESHY,
        lambda scene: True,
        40,
        {
            "domain.lower": "[-6.0, -6.0, -10.0]",
            "domain.upper": "[6.0, 6.0, 6.0]",
            "domain.resolution": "32",
        },
    ),
    GroupRun(VEHICLES, lambda scene: True, 180),
    GroupRun(ROBOTS, lambda scene: scene.dimensions == 2, 180),
    GroupRun(ROBOTS, lambda scene: True, 180, {"domain.resolution": "61"}),
)
"""Of each group: the first that holds a scene."""

EARLIER = {"swimmer-held": 12, "swimmer-stroke": 6}
"""Frames that are shown of scenes that take too long to get to their group's."""


def run_of(scene: Scene) -> GroupRun:
    """The run that gives a scene's picture."""
    title = group_of(scene)
    return next(one for one in RUNS if one.title == title and one.holds(scene))


def frame_of(scene: Scene) -> int:
    """Number of the frame that is shown of a scene."""
    return min(EARLIER.get(scene.name, run_of(scene).frame), scene.time.frames)


def picture_of(name: str) -> Path:
    """The file of a scene's picture."""
    return FOLDER / f"{name}.webp"


def item(scene: Scene) -> str:
    """A scene on the page: picture, command, description."""
    said = plain(scene.description)
    return (
        f"- ![{said}](gallery/{picture_of(scene.name).name})\n\n"
        f"  `flowborne run {scene.name}`\n\n"
        f"  {said[:1].upper()}{said[1:]}. *Frame {frame_of(scene)}.*\n"
    )


def section() -> str:
    """All groups with their scenes, each in the order of the library."""
    scenes = [load_scene(name) for name in scene_names()]
    text = []
    for title in GROUPS:
        shown = [scene for scene in scenes if group_of(scene) == title]
        text += [f"## {title}\n", *map(item, shown), *notes(shown)]
    return "\n".join(text) + "\n"


def notes(scenes: list[Scene]) -> list[str]:
    """How the runs for the pictures differ from the scenes, a sentence for each set of options."""
    names: dict[str, list[str]] = {}
    for scene in scenes:
        names.setdefault(run_of(scene).options, []).append(f"`{scene.name}`")
    return [
        f"To save time, {listed(some)} ran with `{options}` for this page.\n"
        for options, some in names.items()
        if options
    ]


def listed(names: list[str]) -> str:
    """Names in a row: a, b and c."""
    *some, last = names
    return f"{', '.join(some)} and {last}" if some else last


def with_section(text: str) -> str:
    """The page with the built-in scenes of today."""
    return with_part(text, "gallery", section())


def draw(name: str) -> None:
    """Run a scene, and write its picture."""
    with TemporaryDirectory() as folder:
        simulate(name, Path(folder))
        write_picture(Path(folder), frame_of(load_scene(name)), picture_of(name))


def simulate(name: str, folder: Path) -> None:
    """Run a scene up to the frame that is shown.

    raises  SystemExit when the run does not get there
    """
    scene = load_scene(name, run_of(load_scene(name)).settings)
    result = run(scene, folder, frames=frame_of(scene), film=False)
    if result.outcome is not RunOutcome.DONE:
        sys.exit(f"{name}: {result.message}")


def write_picture(folder: Path, frame: int, path: Path) -> None:
    """A frame of a run as a small WebP."""
    made = Run(folder)
    width, height = SIZE
    shot = made.shot.model_copy(
        update={
            "plots": False,
            "scale_bar": False,
            "size": (width * OVERSAMPLING, height * OVERSAMPLING),
            "camera": camera_of(read_scene(folder / "scene.toml"), made.shot.camera),
        }
    )
    with closing(Picture(made, shot=shot)) as picture:
        pixels = picture.draw(frame)[:, :, :3].copy()
    small = Image.fromarray(pixels).resize(SIZE, Image.Resampling.LANCZOS)
    path.parent.mkdir(exist_ok=True)
    for quality in QUALITIES:
        coded = BytesIO()
        small.save(coded, "webp", quality=quality, method=6)
        if coded.tell() <= MAX_BYTES:
            break
    path.write_bytes(coded.getvalue())


def camera_of(scene: Scene, camera: CameraTable) -> CameraTable:
    """A camera that fills the picture with a slab's domain: with its middle where a stream passes
    through it, and with the bodies elsewhere. In space, without a domain, and with one that follows
    bodies, the film's own."""
    if scene.dimensions == 3 or scene.domain is None or scene.domain.follows:
        return camera
    (x0, y0), (x1, y1) = scene.domain.lower, scene.domain.upper
    half_height = 0.5 * min(y1 - y0, (x1 - x0) * SIZE[1] / SIZE[0])
    distance = half_height / tan(0.5 * radians(camera.lens))
    target = (0.5 * (x0 + x1), 0.5 * (y0 + y1), 0.0) if has_inflow(scene) else None
    return camera.model_copy(update={"distance": distance, "target": target})


def write(names: list[str]) -> None:
    """Make the pictures of these scenes and those that are missing, and the page.

    raises  SystemExit for a name that is no built-in scene's
    """
    if unknown := set(names) - set(scene_names()):
        sys.exit(f"no built-in scene: {', '.join(sorted(unknown))}")
    for name in scene_names():
        if name in names or not picture_of(name).exists():
            draw(name)
    for path in FOLDER.glob("*.webp"):
        if path.stem not in scene_names():
            path.unlink()
    PAGE.write_text(with_section(PAGE.read_text(encoding="utf-8")), encoding="utf-8")


if __name__ == "__main__":
    write(sys.argv[1:])
