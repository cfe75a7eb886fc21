"""Specks that drift with the simulated flow of a run, as a loop.

A speck starts at a random place and time. It grows, drifts, and is gone at the end of its life. A
frame shows the specks of all rounds of the loop at once, so the last frame leads to the first.
"""

from __future__ import annotations

from math import pi

import numpy as np
from scipy.ndimage import map_coordinates

from flowborne.kernels.arrays import Array
from flowborne.runs.states import cell_velocity
from flowborne.view.open_run import OpenRun


def drifting(run: OpenRun, loop: int, count: int, rounds: int = 2) -> Array:
    """Places in m and relative sizes of specks, (loop, count * rounds, 4).

    loop    frames at the end of the run, which repeat
    count   specks that start in a loop
    rounds  loops that a speck lives
    """
    states = [run.state(number) for number in range(len(run.times) - loop, len(run.times))]
    grid = run.grid_at(states[0])
    flow = np.stack([cell_velocity(grid, state) for state in states])
    generator = np.random.default_rng(67)
    low, high = np.array(grid.origin), np.array(grid.upper)
    places = generator.uniform(low, high, (count, 3))
    starts = generator.integers(0, loop, count)
    shown = np.zeros((loop, rounds, count, 4))
    for age in range(rounds * loop):
        now = (starts + age) % loop
        inside = np.all((places > low) & (places < high), axis=1)
        size = inside * np.sin(pi * (age + 0.5) / (rounds * loop)) ** 0.5
        shown[now, age // loop, np.arange(count)] = np.column_stack([places, size])
        cells = np.vstack([now, ((places - low) / grid.spacing - 0.5).T])
        for axis in range(3):
            speed = map_coordinates(flow[..., axis], cells, order=1, mode="nearest")
            places[:, axis] += speed / run.frames_per_second
    return shown.reshape(loop, -1, 4)
