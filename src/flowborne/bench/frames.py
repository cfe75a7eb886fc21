"""Frames of a scene against the clock."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from flowborne import Simulation
from flowborne.machine import kernel_threads

Array = NDArray[np.float64]

FRAMES = 24
"""How many are timed."""


def frame_times(simulations: Sequence[Simulation], frames: int = FRAMES) -> Array:
    """(len(simulations), frames) seconds of every frame after a first one that is not timed.

    The simulations take turns, so that what else the machine does meets all of them alike.
    """
    times = np.empty((len(simulations), frames))
    with kernel_threads(1):
        for simulation in simulations:
            simulation.advance_frame()
        for frame in range(frames):
            for n, simulation in enumerate(simulations):
                times[n, frame] = simulation.advance_frame().seconds["total"]
    return times


def told(times: Array) -> str:
    """Quickest and median frame in words."""
    return f"{1e3 * times.min():.1f} ms a frame, {1e3 * np.median(times):.1f} ms in the median"
