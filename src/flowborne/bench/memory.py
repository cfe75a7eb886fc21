"""What a run holds in memory, and that it holds no more as it goes on."""

from __future__ import annotations

import multiprocessing
import tracemalloc
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from math import prod

from flowborne import Scene, Simulation, load_scene
from flowborne.bench.result import Result, verdict
from flowborne.machine import end_with_parent, peak_memory, state_bytes

NAME = "memory"
SCENE = "ns-block-drag-max"
EARLY, LATE = 10, 60
"""Frames after which the memory is read."""

GROWTH = 1.02
"""Memory after LATE frames over that after EARLY, at most."""


@dataclass(frozen=True)
class Held:
    """Memory after some frames, bytes.

    frame    how many
    now      held by Python and NumPy between two frames
    most     held by them at any time so far
    process  largest size of the whole process so far; 1 where the system does not tell
    """

    frame: int
    now: int
    most: int
    process: int


def measure() -> Iterator[Result]:
    """Bytes per cell, then growth."""
    yield from footprint(load_scene(SCENE))


def footprint(scene: Scene, early: int = EARLY, late: int = LATE) -> list[Result]:
    """Most that a run holds per cell, and what it holds after `late` frames over `early`."""
    before, after = held_apart(scene, (early, late))
    world = Simulation(scene, 1).world
    cells = prod(world.flow()[0].grid.shape)
    ratio = max(after.now / before.now, after.process / before.process)
    return [
        Result(
            NAME,
            f"{scene.name}: bytes per cell that a run holds at most, libraries left out",
            after.most / cells,
            "",
            "info",
            [f"{state_bytes(world) / cells:.0f} of them are one copy of the state"],
        ),
        Result(
            NAME,
            f"{scene.name}: memory after {late} frames over that after {early}",
            ratio,
            f"at most {GROWTH:g}",
            verdict(ratio <= GROWTH),
            [
                f"{m.frame} frames: {m.now / 1e6:.2f} MB held, {m.process / 1e6:.1f} MB the process"
                for m in (before, after)
            ],
        ),
    ]


def held_apart(scene: Scene, frames: tuple[int, ...]) -> list[Held]:
    """As `held`, in a process of its own, whose size nothing else has raised."""
    with ProcessPoolExecutor(1, multiprocessing.get_context("spawn"), end_with_parent) as executor:
        return executor.submit(held, scene, frames).result()


def held(scene: Scene, frames: tuple[int, ...]) -> list[Held]:
    """Memory of this process after so many frames of a scene, each number more than the last."""
    found = []
    tracemalloc.start()
    try:
        with Simulation(scene, 1, "serial") as simulation:
            for count in frames:
                while simulation.frame < count:
                    simulation.advance_frame()
                found.append(Held(count, *tracemalloc.get_traced_memory(), peak_memory() or 1))
    finally:
        tracemalloc.stop()
    return found
