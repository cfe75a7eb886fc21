"""Against the clock on the wall: a block that finds most drag, as fast as it is shown."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from flowborne import Scene, Simulation, load_scene
from flowborne.bench.frames import frame_times, told
from flowborne.bench.result import Result, verdict

NAME = "realtime"
SCENE = "ns-block-drag-max"
SETTINGS = {"domain.resolution": "128", "controller.settle_steps": "0"}
SECONDS = 3
"""Time in the scene over which frames are timed."""


def measure() -> Iterator[Result]:
    """Speed with the workers that a run has by default."""
    yield speed(load_scene(SCENE, SETTINGS))


def speed(scene: Scene, seconds: float = SECONDS) -> Result:
    """Frames a second over those that are shown, by the median frame."""
    with Simulation(scene) as simulation:
        shown = 1.0 / simulation.frame_time
        (times,) = frame_times([simulation], round(seconds * shown))
        grid = simulation.world.setup.fluid
    reached = 1.0 / float(np.median(times))
    size = "" if grid is None else " x ".join(str(n) for n in grid.grid.shape[:2])
    return Result(
        NAME,
        f"{scene.name}, {size} cells, no settling: frames a second over {shown:g}",
        reached / shown,
        "at least 1",
        verdict(reached >= shown),
        [f"{told(times)}, {1e3 * times.mean():.1f} ms on average; {reached:.1f} frames a second"],
    )
