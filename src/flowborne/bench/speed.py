"""Frames a second over those that are shown: of a block with control, and of the walking human."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import ExitStack

import numpy as np

from flowborne import Scene, Simulation, load_scene
from flowborne.bench.timing import Result, at_least, frame_times, in_words

BLOCK = "ns-block-drag-max"
BLOCK_SETTINGS = {"domain.resolution": "128", "controller.settle_steps": "0"}
HUMAN = ("gravity-back", "gravity-arms", "wind-back", "wind-arms", "wind-drag")
WORKERS = ((1, "serial"), (2, "threads"), (2, "processes"))


def realtime() -> Iterator[Result]:
    """A block that finds most drag, with the workers that a run has by default."""
    yield default_speed(load_scene(BLOCK, BLOCK_SETTINGS))


def human() -> Iterator[Result]:
    """The human of Figs. 5 and 9 in a simple wind, serial and parallel."""
    for scene in HUMAN:
        yield best_speed(load_scene(f"human-{scene}"))


def default_speed(scene: Scene, seconds: float = 3.0) -> Result:
    """Frames a second over those that are shown, by the median frame.

    seconds  time in the scene over which frames are timed
    """
    with Simulation(scene) as simulation:
        shown = 1.0 / simulation.frame_time
        (times,) = frame_times([simulation], round(seconds * shown))
        grid = simulation.world.setup.fluid
    reached = 1.0 / float(np.median(times))
    size = "" if grid is None else " x ".join(str(n) for n in grid.grid.shape[:2])
    title = f"{scene.name}, {size} cells, no settling: frames a second over {shown:g}"
    mean = f"{1e3 * times.mean():.1f} ms on average; {reached:.1f} frames a second"
    return at_least("realtime", title, reached / shown, 1.0, [f"{in_words(times)}, {mean}"])


def best_speed(scene: Scene, frames: int = 48) -> Result:
    """The same with the executor that is quickest."""
    with ExitStack() as stack:
        simulations = [
            stack.enter_context(Simulation(scene, count, executor)) for count, executor in WORKERS
        ]
        times = frame_times(simulations, frames)
        shown = 1.0 / simulations[0].frame_time
    ratio = float(1.0 / np.median(times, axis=1).min() / shown)
    lines = [
        f"{count} {executor:<9} {in_words(row)}"
        for (count, executor), row in zip(WORKERS, times, strict=True)
    ]
    title = f"{scene.name}: frames a second over {shown:g}"
    return at_least("human", title, ratio, 1.0, lines)
