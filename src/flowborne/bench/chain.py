"""What a joint more costs: chains of one to four joints, one worker."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import ExitStack

import numpy as np

from flowborne import Scene, Simulation, load_scene
from flowborne.bench.frames import FRAMES, frame_times, told
from flowborne.bench.result import Result, verdict

NAME = "chain"
JOINTS = (1, 2, 3, 4)
DEVIATION = 0.1
"""Part of the line's value by which a time may be off the line."""


def measure() -> Iterator[Result]:
    """How straight the line of times is."""
    yield straightness([load_scene(f"ns-chain-{n}") for n in JOINTS])


def straightness(scenes: Sequence[Scene], frames: int = FRAMES) -> Result:
    """Largest deviation of the quickest frames of scenes with 1, 2, ... joints from a line."""
    from flowborne.pictures import straight_line

    with ExitStack() as stack:
        simulations = [stack.enter_context(Simulation(scene, 1, "serial")) for scene in scenes]
        times = frame_times(simulations, frames)
    joints = np.arange(1.0, len(scenes) + 1.0)
    slope, start, deviation = straight_line(joints, times.min(axis=1))
    return Result(
        NAME,
        "largest deviation of the serial time of a frame from a line in the joints, part of it",
        deviation,
        f"at most {DEVIATION:g}",
        verdict(deviation <= DEVIATION),
        [
            *(f"{scene.name} {told(row)}" for scene, row in zip(scenes, times, strict=True)),
            f"line {1e3 * start:.1f} ms + {1e3 * slope:.1f} ms a joint",
        ],
    )
