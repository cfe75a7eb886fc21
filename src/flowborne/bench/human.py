"""The walking human of Figs. 5 and 9 against the clock on the wall, serial and parallel."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import ExitStack

import numpy as np

from flowborne import Scene, Simulation, load_scene
from flowborne.bench.frames import frame_times, told
from flowborne.bench.result import Result, verdict

NAME = "human"
SCENES = ("gravity-back", "gravity-arms", "wind-back", "wind-arms", "wind-drag")
FRAMES = 48
WORKERS = ((1, "serial"), (2, "threads"), (2, "processes"))


def measure() -> Iterator[Result]:
    """Speed of every scene of the human in a simple wind."""
    for scene in SCENES:
        yield speed(load_scene(f"human-{scene}"))


def speed(scene: Scene, frames: int = FRAMES) -> Result:
    """Frames a second over those that are shown, by the median frame, of the quickest way."""
    with ExitStack() as stack:
        simulations = [
            stack.enter_context(Simulation(scene, count, executor)) for count, executor in WORKERS
        ]
        times = frame_times(simulations, frames)
        shown = 1.0 / simulations[0].frame_time
    medians = np.median(times, axis=1)
    best = int(medians.argmin())
    ratio = float(1.0 / medians[best] / shown)
    return Result(
        NAME,
        f"{scene.name}: frames a second over {shown:g}",
        ratio,
        "at least 1",
        verdict(ratio >= 1.0),
        [
            f"{count} {executor:<9} {told(row)}"
            for (count, executor), row in zip(WORKERS, times, strict=True)
        ],
    )
