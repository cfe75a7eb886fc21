"""What a frame costs: the time of its parts, its memory, and how both grow with the cells.

The pressure's iterations are the largest part of a frame in three dimensions. The memory bandwidth
that they use is compared with that of p = z + s p in the same run (after the triad of McCalpin
1995), on one core and on all: where one core uses most of the bandwidth, more cores gain little.
"""

from __future__ import annotations

import gc
import multiprocessing
import tracemalloc
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from math import prod

import numpy as np

from flowborne import Scene, Simulation, load_scene
from flowborne.machine import (
    PARTS,
    cores,
    end_with_parent,
    kernel_threads,
    memory_bandwidth,
    peak_memory,
    state_bytes,
)
from flowborne.worlds import PressureSystem, faces_of
from flowborne_validation.bench.timing import FRAMES, Result, at_most, info, timed

BLOCK = "ns-block-drag-max"

SIZES = {"flyer-base": (32, 64, 96), "swimmer-jet-only": (72, 120, 168)}
"""Scene -> cells along the domain's longest side; 168 are the swimmer's own."""

EARLY, LATE = 10, 60
"""Frames after which the memory is read."""

GROWTH = 1.02
"""Memory after LATE frames over that after EARLY, at most."""

MOVED = 209
"""Bytes that an iteration moves for each cell if nothing stays in cache between two passes: 124 in
conjugate gradients, 74 on the finest level of the cycle, and a seventh of those on the others."""


@dataclass(frozen=True)
class Held:
    """Memory after some frames, bytes.

    frame    number of frames
    now      held by Python and NumPy between two frames
    most     largest amount held by them so far
    process  largest size of the whole process so far; 1 where the system does not report it
    """

    frame: int
    now: int
    most: int
    process: int


def parts() -> Iterator[Result]:
    """Each part's share, one worker."""
    for scene in (BLOCK, "ns-chain-4"):
        yield shares(load_scene(scene))


def size() -> Iterator[Result]:
    """Time and memory of a flyer of bones and a swimmer of flesh without control, one worker."""
    for scene, sides in SIZES.items():
        yield growth([load_scene(scene, {"domain.resolution": str(n)}) for n in sides])


def memory() -> Iterator[Result]:
    """Bytes per cell, then growth."""
    yield from footprint(load_scene(BLOCK))


def shares(scene: Scene, frames: int = FRAMES) -> Result:
    """Mean seconds of every part of a frame; the trials are all of "control"."""
    with Simulation(scene, 1, "serial") as simulation, kernel_threads(1):
        simulation.advance_frame()
        spent = [simulation.advance_frame().seconds for _ in range(frames)]
    total = float(np.mean([seconds["total"] for seconds in spent]))
    means = {part: float(np.mean([seconds[part] for seconds in spent])) for part in PARTS}
    means["rest"] = total - sum(means.values())
    step = total - means["control"]
    shared = {part: "" if part == "control" else f"{s / step:6.1%}" for part, s in means.items()}
    title = f"{scene.name}: ms a frame, one worker; its parts, shares of the frame and of the step"
    lines = [
        f"{part:<10} {1e3 * s:8.2f} ms {s / total:6.1%} {shared[part]}".rstrip()
        for part, s in means.items()
    ]
    return info("parts", title, 1e3 * total, lines)


def growth(scenes: Sequence[Scene], frames: int = 4) -> Result:
    """Power of the number of cells with which the time of a frame grows, over all scenes.

    frames  number of timed frames, after a first one
    """
    cells, seconds, lines = [], [], []
    for scene in scenes:
        shape, steps, spent = parts_of(scene, frames)
        (held,) = memory_apart(scene, (2,))
        cells.append(prod(shape))
        seconds.append(sum(spent.values()))
        unit = 1e9 / cells[-1] / steps
        shares = ", ".join(f"{part} {unit * s:.0f}" for part, s in spent.items())
        lines.append(
            f"{' x '.join(map(str, shape))} cells: {seconds[-1]:.3g} s a frame, "
            f"{held.most / 1e6:.0f} MB ({held.most / cells[-1]:.0f} bytes a cell); "
            f"{unit * seconds[-1]:.0f} ns a cell and step: {shares}"
        )
    if cores() > 1:
        _, _, spread = parts_of(scenes[-1], frames, cores())
        total = sum(spread.values())
        lines.append(
            f"on {cores()} threads {total:.3g} s a frame, {seconds[-1] / total:.2f} times as fast"
        )
    lines.append(iterations_against_memory(shape))
    power = float(np.polyfit(np.log(cells), np.log(seconds), 1)[0]) if len(cells) > 1 else np.nan
    title = f"{scenes[0].name}: power of the number of cells with which the time of a frame grows"
    return info("size", title, power, lines)


def parts_of(
    scene: Scene, frames: int, threads: int = 1
) -> tuple[tuple[int, int, int], int, dict[str, float]]:
    """Cells along each axis, steps and median seconds of each part of a frame."""
    with Simulation(scene, 1, "serial") as simulation, kernel_threads(threads):
        simulation.advance_frame()
        reports = [simulation.advance_frame() for _ in range(frames)]
        shape = simulation.world.flow()[0].grid.shape
    spent = [report.seconds for report in reports]
    means = {part: float(np.median([seconds[part] for seconds in spent])) for part in PARTS}
    return shape, len(reports[-1].steps), {part: s for part, s in means.items() if s > 0.0}


def iterations_against_memory(shape: tuple[int, int, int]) -> str:
    """What iterations of the pressure solve in an empty room take and move, in words."""
    sizes = [tuple(n + (axis == a) for a, n in enumerate(shape)) for axis in range(3)]
    ones = [np.ones(size) for size in sizes]
    rhs = np.random.default_rng(0).standard_normal(shape)
    with kernel_threads(1):
        system = PressureSystem(faces_of(ones))
        solution, took = timed(lambda: system.solve(rhs), 3)
        most = memory_bandwidth()
    with kernel_threads():
        of_all = memory_bandwidth()
    each = 1e9 * took / solution.iterations / rhs.size
    return (
        f"pressure: {each:.1f} ns a cell and iteration, {MOVED / each:.0f} GB/s if nothing stays "
        f"in cache; p = z + s p moves {1e-9 * most:.0f} GB/s, on {cores()} threads "
        f"{1e-9 * of_all:.0f} GB/s"
    )


def footprint(scene: Scene, early: int = EARLY, late: int = LATE) -> list[Result]:
    """Largest memory of a run per cell; memory after `late` frames over that after `early`."""
    before, after = memory_apart(scene, (early, late))
    world = Simulation(scene, 1).world
    cells = prod(world.flow()[0].grid.shape)
    ratio = max(after.now / before.now, after.process / before.process)
    whole = f"{scene.name}: bytes per cell that a run holds at most, libraries left out"
    state = f"{state_bytes(world) / cells:.0f} of them are one copy of the state"
    later = f"{scene.name}: memory after {late} frames over that after {early}"
    lines = [
        f"{m.frame} frames: {m.now / 1e6:.2f} MB held, {m.process / 1e6:.1f} MB the process"
        for m in (before, after)
    ]
    return [
        info("memory", whole, after.most / cells, [state]),
        at_most("memory", later, ratio, GROWTH, lines),
    ]


def memory_apart(scene: Scene, frames: tuple[int, ...]) -> list[Held]:
    """`memory_here` of a new process, in which nothing else has taken memory."""
    with ProcessPoolExecutor(1, multiprocessing.get_context("spawn"), end_with_parent) as executor:
        return executor.submit(memory_here, scene, frames).result()


def memory_here(scene: Scene, frames: tuple[int, ...]) -> list[Held]:
    """Memory of this process after each number of frames of a scene, in increasing order."""
    found = []
    tracemalloc.start()
    try:
        with Simulation(scene, 1, "serial") as simulation:
            for count in frames:
                while simulation.frame < count:
                    simulation.advance_frame()
                gc.collect()
                found.append(Held(count, *tracemalloc.get_traced_memory(), peak_memory() or 1))
    finally:
        tracemalloc.stop()
    return found
