"""What a frame in three dimensions costs, and how that grows with the number of cells."""

from __future__ import annotations

import multiprocessing
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from math import prod

import numpy as np

from flowborne.bench.memory import held
from flowborne.bench.result import Result
from flowborne.frame_report import PARTS
from flowborne.kernels.jit import kernel_threads
from flowborne.scenes.load import load_scene
from flowborne.scenes.schema import Scene
from flowborne.simulation import Simulation

NAME = "size"
SCENES = {"flyer-base": (32, 64, 96), "swimmer-jet-only": (72, 120, 168)}
"""Scene -> cells along the domain's longest side; 168 are the swimmer's own."""

FRAMES = 4
"""How many are timed, after a first one."""


def measure() -> Iterator[Result]:
    """Time and memory of a flyer of bones and a swimmer of flesh without control, one worker."""
    for scene, sides in SCENES.items():
        yield growth([load_scene(scene, {"domain.resolution": str(n)}) for n in sides])


def growth(scenes: Sequence[Scene], frames: int = FRAMES) -> Result:
    """Power of the number of cells with which the time of a frame grows, over all scenes."""
    cells, seconds, lines = [], [], []
    for scene in scenes:
        shape, spent = parts_of(scene, frames)
        with ProcessPoolExecutor(1, mp_context=multiprocessing.get_context("spawn")) as executor:
            (memory,) = executor.submit(held, scene, (2,)).result()
        cells.append(prod(shape))
        seconds.append(sum(spent.values()))
        shares = ", ".join(f"{part} {100.0 * s / seconds[-1]:.0f} %" for part, s in spent.items())
        lines.append(
            f"{' x '.join(map(str, shape))} cells: {seconds[-1]:.3g} s a frame, "
            f"{memory.most / 1e6:.0f} MB ({memory.most / cells[-1]:.0f} bytes a cell); {shares}"
        )
    power = float(np.polyfit(np.log(cells), np.log(seconds), 1)[0]) if len(cells) > 1 else np.nan
    return Result(
        NAME,
        f"{scenes[0].name}: power of the number of cells with which the time of a frame grows",
        power,
        "",
        "info",
        lines,
    )


def parts_of(scene: Scene, frames: int) -> tuple[tuple[int, int, int], dict[str, float]]:
    """Cells along each axis, and median seconds of each part of a frame on one thread."""
    with Simulation(scene, 1, "serial") as simulation, kernel_threads(1):
        simulation.advance_frame()
        spent = [simulation.advance_frame().seconds for _ in range(frames)]
        shape = simulation.world.flow()[0].grid.shape
    means = {part: float(np.median([seconds[part] for seconds in spent])) for part in PARTS}
    return shape, {part: s for part, s in means.items() if s > 0.0}
