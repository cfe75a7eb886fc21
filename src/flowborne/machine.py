"""Resources of a run: threads, memory, seconds by part, executors of trials, what is installed."""

from __future__ import annotations

from time import perf_counter

import numpy as np

from flowborne.base.extras import check_drawing
from flowborne.control.executors import (
    GRACE,
    Foreign,
    Mapper,
    Processes,
    Serial,
    Threads,
    end_with_parent,
    mapper,
)
from flowborne.kernels.jit import cores, kernel_threads
from flowborne.kernels.vectors import turn
from flowborne.runs.checkpoint import state_bytes
from flowborne.runs.summary import peak_memory
from flowborne.sim.frame import PARTS

__all__ = [
    "GRACE",
    "PARTS",
    "Foreign",
    "Mapper",
    "Processes",
    "Serial",
    "Threads",
    "check_drawing",
    "cores",
    "end_with_parent",
    "kernel_threads",
    "mapper",
    "memory_bandwidth",
    "peak_memory",
    "state_bytes",
]

__dir__ = __all__.copy

STREAM = (100, 100, 1000)
"""Shape of arrays that exceed every cache."""


def memory_bandwidth() -> float:
    """Bytes per second of p = z + s p, the best of six runs, on the threads allowed for kernels."""
    p, z = np.ones(STREAM), np.ones(STREAM)
    seconds = []
    for _ in range(6):
        started = perf_counter()
        turn(p, z, 0.5)
        seconds.append(perf_counter() - started)
    return 3.0 * p.nbytes / min(seconds)
