"""Two workers for the controller's trials against one."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import ExitStack

import numpy as np

from flowborne import Scene, Simulation, load_scene
from flowborne.bench.frames import FRAMES, frame_times, told
from flowborne.bench.result import Result, verdict

NAME = "workers"
SCENE = "ns-chain-4"
EXECUTORS = ("threads", "processes")
FASTER = 1.8
"""Times that two workers must be faster than one."""


def measure() -> Iterator[Result]:
    """How many times faster two are."""
    yield compare(load_scene(SCENE))


def compare(scene: Scene, frames: int = FRAMES) -> Result:
    """One worker's quickest frame over that of two, threads or processes, whichever is faster."""
    with ExitStack() as stack:
        simulations = [stack.enter_context(Simulation(scene, 1, "serial"))]
        for executor in EXECUTORS:
            simulations.append(stack.enter_context(Simulation(scene, 2, executor)))
        alone, *together = frame_times(simulations, frames)
    ratios = [float(alone.min() / times.min()) for times in together]
    best = int(np.argmax(ratios))
    return Result(
        NAME,
        f"{scene.name}: one worker's time over that of two {EXECUTORS[best]}",
        ratios[best],
        f"at least {FASTER:g}",
        verdict(ratios[best] >= FASTER),
        [
            f"one           {told(alone)}",
            *(
                f"two {executor:<9} {told(times)}; {ratio:.2f} times faster"
                for executor, times, ratio in zip(EXECUTORS, together, ratios, strict=True)
            ),
        ],
    )
