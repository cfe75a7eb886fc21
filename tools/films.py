"""Makes the films of the README and of the doors from built-in scenes: `make films`.

`make films NAMES="eel"` makes these films. The whale needs a character that is not in the
repository: `make films NAMES=whale`, after the commands of docs/import.md, in their folder.
"""

from __future__ import annotations

import sys
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from flowborne.scenes.load import load_scene
from flowborne.sim.endings import RunOutcome
from flowborne.sim.running import run
from flowborne.view.film import write_film
from flowborne.view.run import Run

DOCS = Path(__file__).parents[1] / "docs"


@dataclass(frozen=True)
class Film:
    """A film without curves, in which the flow fills the picture.

    scene     built-in scene, or file of one
    frames    of the run
    shot      keys of [film] that the film changes
    camera    keys of [film.camera]
    settings  changes of the scene, as those of `--set`
    """

    scene: str
    frames: int
    shot: Mapping[str, Any]
    camera: Mapping[str, Any]
    settings: Mapping[str, str] = field(default_factory=dict)


FILMS = {
    "whale": Film(
        "whale/fish-whale.toml",
        66,
        {"size": (720, 380), "start": 1.375},
        {"azimuth": -38.0, "elevation": 18.0, "distance": 8.6},
        {"time.steps_per_frame": "2"},
    ),
    "eel": Film(
        "eel",
        240,
        {"size": (340, 480), "frames_per_second": 15.0, "start": 0.5},
        {"target": (0.61, 0.48, 0.0), "distance": 2.3},
    ),
    "human-wind-back": Film(
        "human-wind-back", 120, {"size": (480, 400), "frames_per_second": 12.0, "stop": 3.0}, {}
    ),
    "ns-block-drag-max": Film(
        "ns-block-drag-max",
        130,
        {"size": (480, 400), "frames_per_second": 12.0},
        {"target": (0.3, 0.0, 0.0), "distance": 6.0},
    ),
}


def draw(folder: Path, name: str) -> None:
    """Draw a run as docs/NAME.webp."""
    film, made = FILMS[name], Run(folder)
    camera = made.shot.camera.model_copy(update=dict(film.camera))
    update = {"plots": False, "scale_bar": False, "camera": camera, **film.shot}
    write_film(made, DOCS / f"{name}.webp", shot=made.shot.model_copy(update=update))


def make(name: str) -> None:
    """Run a scene, and draw its film.

    raises  SystemExit when the run does not get to its end
    """
    film = FILMS[name]
    with TemporaryDirectory() as folder:
        scene = load_scene(film.scene, film.settings)
        result = run(scene, Path(folder), frames=film.frames, film=False)
        if result.outcome is not RunOutcome.DONE:
            sys.exit(f"{name}: {result.message}")
        draw(Path(folder), name)


if __name__ == "__main__":
    for name in sys.argv[1:] or [name for name in FILMS if name != "whale"]:
        make(name)
