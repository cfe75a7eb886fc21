"""Time of frames: over those that are shown, and with several workers, joints and threads."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from flowborne import Scene, Simulation, load_scene
from flowborne.machine import cores, kernel_threads
from flowborne_validation.bench.timing import (
    FRAMES,
    Result,
    at_least,
    at_most,
    frame_times,
    in_words,
    times_together,
    verdict,
)

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
    times = times_together([(scene, *workers) for workers in WORKERS], frames)
    shown = 1.0 / scene.frame_time
    ratio = float(1.0 / np.median(times, axis=1).min() / shown)
    lines = [
        f"{count} {executor:<9} {in_words(row)}"
        for (count, executor), row in zip(WORKERS, times, strict=True)
    ]
    title = f"{scene.name}: frames a second over {shown:g}"
    return at_least("human", title, ratio, 1.0, lines)


EXECUTORS = ("threads", "processes")
FASTER = 1.8
"""Least speed-up by a second worker."""

DEVIATION = 0.1
"""Largest deviation of the time of a frame from a line in the joints, part of the line's value."""


def workers() -> Iterator[Result]:
    """Speed-up of the controller's trials by a second worker."""
    yield compare_workers(load_scene("ns-chain-4"))


def chain() -> Iterator[Result]:
    """Cost of a further joint: chains of one to four joints, one worker."""
    yield straightness([load_scene(f"ns-chain-{n}") for n in (1, 2, 3, 4)])


def threads() -> Iterator[Result]:
    """Bits and speed of a swimmer with a jet of dye on one thread and on all.

    Each array of its 192,000 cells is LARGE (see `kernels.jit`), so that threads start.
    """
    yield compare_threads(load_scene("swimmer-jet-only", {"domain.resolution": "120"}))


def compare_workers(scene: Scene, frames: int = FRAMES) -> Result:
    """One worker's quickest frame over that of two, threads or processes, whichever is faster."""
    runs = [(scene, 1, "serial"), *((scene, 2, executor) for executor in EXECUTORS)]
    alone, *together = times_together(runs, frames)
    ratios = [float(alone.min() / times.min()) for times in together]
    best = int(np.argmax(ratios))
    title = f"{scene.name}: one worker's time over that of two {EXECUTORS[best]}"
    lines = [f"one           {in_words(alone)}"]
    for executor, times, ratio in zip(EXECUTORS, together, ratios, strict=True):
        lines.append(f"two {executor:<9} {in_words(times)}; {ratio:.2f} times faster")
    return at_least("workers", title, ratios[best], FASTER, lines)


def straightness(scenes: Sequence[Scene], frames: int = FRAMES) -> Result:
    """Largest deviation of the quickest frames of scenes with 1, 2, ... joints from a line."""
    times = times_together([(scene, 1, "serial") for scene in scenes], frames)
    joints = np.arange(1.0, len(scenes) + 1.0)
    quickest = times.min(axis=1)
    slope, start = np.polyfit(joints, quickest, 1)
    line = slope * joints + start
    deviation = float((np.abs(quickest - line) / line).max())
    title = "largest deviation of the serial time of a frame from a line in the joints, part of it"
    lines = [f"{scene.name} {in_words(row)}" for scene, row in zip(scenes, times, strict=True)]
    lines.append(f"line {1e3 * start:.1f} ms + {1e3 * slope:.1f} ms a joint")
    return at_most("chain", title, deviation, DEVIATION, lines)


def compare_threads(scene: Scene, frames: int = 4) -> Result:
    """Arrays of the state that differ after some frames on one thread and on all.

    frames  kernels compare their serial and parallel versions in the first six calls, so that both
            have run after four
    """
    states, lines = [], []
    for count in (1, cores()):
        with Simulation(scene, 1, "serial") as simulation, kernel_threads(count):
            reports = [simulation.advance_frame() for _ in range(frames)]
            states.append(simulation.world.arrays())
        seconds = min(report.seconds["total"] for report in reports)
        lines.append(f"{count} threads: {seconds:.3g} s for the quickest frame")
    alone, shared = states
    differing = [name for name in alone if not np.array_equal(alone[name], shared[name])]
    title = f"{scene.name}: arrays whose bits depend on the number of threads"
    if differing:
        lines.append(f"other bits in {', '.join(differing)}")
    return Result("threads", title, len(differing), "0", verdict(not differing), lines)
