"""What a step in three dimensions costs, and how a frame grows with the number of cells.

The largest scene is run on all cores, too. Of the largest part, the pressure's iterations, what
they move through memory is set against what p = z + s p moves in the same run (after the triad of
McCalpin 1995), on one core and on all: where one takes most of what there is, others gain little.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from math import prod

import numpy as np

from flowborne import Scene, Simulation, load_scene
from flowborne.bench.memory import held_apart
from flowborne.bench.result import Result, timed
from flowborne.machine import PARTS, cores, kernel_threads, memory_bandwidth
from flowborne.operators import PressureSystem, faces_of

NAME = "size"
SCENES = {"flyer-base": (32, 64, 96), "swimmer-jet-only": (72, 120, 168)}
"""Scene -> cells along the domain's longest side; 168 are the swimmer's own."""

FRAMES = 4
"""How many are timed, after a first one."""

MOVED = 209
"""Bytes that an iteration moves for each cell if nothing stays in cache between two passes: 124 in
conjugate gradients, 74 on the finest level of the cycle, and a seventh of those on the others."""


def measure() -> Iterator[Result]:
    """Time and memory of a flyer of bones and a swimmer of flesh without control, one worker."""
    for scene, sides in SCENES.items():
        yield growth([load_scene(scene, {"domain.resolution": str(n)}) for n in sides])


def growth(scenes: Sequence[Scene], frames: int = FRAMES) -> Result:
    """Power of the number of cells with which the time of a frame grows, over all scenes."""
    cells, seconds, lines = [], [], []
    for scene in scenes:
        shape, steps, spent = parts_of(scene, frames)
        (memory,) = held_apart(scene, (2,))
        cells.append(prod(shape))
        seconds.append(sum(spent.values()))
        unit = 1e9 / cells[-1] / steps
        shares = ", ".join(f"{part} {unit * s:.0f}" for part, s in spent.items())
        lines.append(
            f"{' x '.join(map(str, shape))} cells: {seconds[-1]:.3g} s a frame, "
            f"{memory.most / 1e6:.0f} MB ({memory.most / cells[-1]:.0f} bytes a cell); "
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
    return Result(
        NAME,
        f"{scenes[0].name}: power of the number of cells with which the time of a frame grows",
        power,
        "",
        "info",
        lines,
    )


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
