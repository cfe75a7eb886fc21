"""Where the time of a frame goes."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from flowborne import Scene, Simulation, load_scene
from flowborne.bench.frames import FRAMES
from flowborne.bench.result import Result
from flowborne.machine import PARTS, kernel_threads

NAME = "parts"
SCENES = ("ns-block-drag-max", "ns-chain-4")


def measure() -> Iterator[Result]:
    """Each part's share, one worker."""
    for name in SCENES:
        yield shares(load_scene(name))


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
    return Result(
        NAME,
        f"{scene.name}: ms a frame, one worker; its parts, shares of the frame and of the step",
        1e3 * total,
        "",
        "info",
        [
            f"{part:<10} {1e3 * s:8.2f} ms {s / total:6.1%} {shared[part]}".rstrip()
            for part, s in means.items()
        ],
    )
