"""What a coupled step costs: time, Python's calls, and memory that it takes anew.

WaterLily, a free solver of moving bodies on a Cartesian grid without joints and control, publishes
for one core in single precision 123 to 137 ns a cell and step of a vortex without a body, and 1205
of a pulsing jelly in open water (README of WaterLily-Benchmarks at 00dffee).
"""

from __future__ import annotations

import sys
import tracemalloc
from collections import Counter
from collections.abc import Callable, Iterator
from math import prod
from types import CodeType, FrameType

import numpy as np

from flowborne import Scene, Simulation, load_scene
from flowborne.machine import kernel_threads
from flowborne_validation.bench.timing import Result, at_most

ROOMS = (("flyer-base", 96, 250.0), ("swimmer-jet-only", 120, 900.0))
"""Scenes, cells along the domain's longest side, and most ns a cell and step."""

TRIALS = ((32, 500.0), (64, 1200.0), (128, 4000.0), (256, 18000.0))
"""Cells a side of `BLOCK`, and most microseconds of a trial's step."""

BLOCK = "ns-block-drag-max"

STEP = "step_coupled"
"""Name of the function that takes a step."""


def steps() -> Iterator[Result]:
    """Rooms without control, then trials of a block in a stream; one thread."""
    for name, cells, most in ROOMS:
        yield of_room(load_scene(name, {"domain.resolution": str(cells)}), most)
    for cells, most in TRIALS:
        yield of_trials(load_scene(BLOCK, {"domain.resolution": str(cells)}), most)


def of_room(scene: Scene, most: float, frames: int = 4) -> Result:
    """Median time of a step, ns a cell."""
    with Simulation(scene, 1, "serial") as simulation, kernel_threads(1):
        simulation.advance_frame()
        reports = [simulation.advance_frame() for _ in range(frames)]
        shape, (_, lines) = simulation.world.flow()[0].grid.shape, of_two_frames(simulation)
    spent = float(np.median([report.seconds["total"] / len(report.steps) for report in reports]))
    lines.append("WaterLily: 123 to 137 ns without a body, 1205 of a pulsing jelly")
    cells = " x ".join(map(str, shape))
    title = f"{scene.name}, {cells} cells: ns a cell and step, one thread"
    return at_most("steps", title, 1e9 * spent / prod(shape), most, lines)


def of_trials(scene: Scene, most: float, frames: int = 4) -> Result:
    """Median time of a trial's step, microseconds."""
    with Simulation(scene, 1, "serial") as simulation, kernel_threads(1):
        simulation.advance_frame()
        spent = [simulation.advance_frame().seconds["control"] for _ in range(frames)]
        shape = simulation.world.flow()[0].grid.shape
        both, lines = of_two_frames(simulation)
    taken = both - 1  # the last is the world's own
    cells = " x ".join(map(str, shape[:2]))
    title = f"{scene.name}, {cells} cells: microseconds a step of a trial, one thread"
    lines.insert(0, f"{1e3 * np.median(spent):.1f} ms a decision of {taken} steps")
    return at_most("steps", title, 1e6 * float(np.median(spent)) / taken, most, lines)


def of_two_frames(simulation: Simulation) -> tuple[int, list[str]]:
    """Steps of the next frame, those of trials too; its Python's calls and the new memory of the
    one after it, in words."""
    calls = calls_of(simulation.advance_frame)
    taken = sum(n for code, n in calls.items() if code.co_name == STEP)
    tracemalloc.start()
    try:
        before, _ = tracemalloc.get_traced_memory()
        simulation.advance_frame()
        _, most = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    each = calls.total() / taken
    return taken, [
        f"{each:.0f} calls of Python functions a step",
        f"{1e-6 * (most - before):.2f} MB more than between two frames, at most",
    ]


def calls_of(action: Callable[[], object]) -> Counter[CodeType]:
    """How often an action calls each of Python's functions in this thread."""
    calls: Counter[CodeType] = Counter()

    def count(frame: FrameType, event: str, _: object) -> None:
        if event == "call":
            calls[frame.f_code] += 1

    before = sys.getprofile()
    sys.setprofile(count)
    try:
        action()
    finally:
        sys.setprofile(before)
    return calls
