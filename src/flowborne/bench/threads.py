"""What more threads gain in a room, and that they change no number."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from flowborne import Scene, Simulation, load_scene
from flowborne.bench.result import Result, verdict
from flowborne.machine import cores, kernel_threads

NAME = "threads"
SCENE, RESOLUTION = "swimmer-jet-only", 120
"""192,000 cells: every array of the grid is LARGE (see `kernels.jit`), so that threads start."""

FRAMES = 4
"""Frames on each number of threads: kernels compare their serial and parallel versions in the first
six calls, so both have run by then."""


def measure() -> Iterator[Result]:
    """Bits of a swimmer with a jet of dye on one thread and on all."""
    yield compare(load_scene(SCENE, {"domain.resolution": str(RESOLUTION)}))


def compare(scene: Scene, frames: int = FRAMES) -> Result:
    """Arrays of the state that differ after some frames on one thread and on all."""
    states, lines = [], []
    for threads in (1, cores()):
        with Simulation(scene, 1, "serial") as simulation, kernel_threads(threads):
            reports = [simulation.advance_frame() for _ in range(frames)]
            states.append(simulation.world.arrays())
        seconds = min(report.seconds["total"] for report in reports)
        lines.append(f"{threads} threads: {seconds:.3g} s for the quickest frame")
    alone, shared = states
    differing = [name for name in alone if not np.array_equal(alone[name], shared[name])]
    title = f"{scene.name}: arrays whose bits depend on the number of threads"
    if differing:
        lines.append(f"other bits in {', '.join(differing)}")
    return Result(NAME, title, len(differing), "0", verdict(not differing), lines)
