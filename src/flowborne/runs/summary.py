"""The result of a run, from its history: final means, convergence, timing and doubts."""

from __future__ import annotations

import os
import platform
import sys
from collections import deque
from collections.abc import Iterator, Sequence
from functools import cache
from importlib.metadata import version
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from flowborne.base.version import __version__
from flowborne.runs.history import history_columns, history_rows

if TYPE_CHECKING:
    from flowborne.coupling.world import Fluid

FINAL_PART = 0.1
"""Part of the frames, at the end, for the final mean of a joint ..."""

FINAL_FRAMES = 10
"""... and the least number of these frames."""

BUDGET_OPEN = 1e-6
"""`momentum_budget_error` above which momentum is not conserved; a sound run has about 1e-13."""


APART = 1e-4
"""`sweep_error` above which viscosity and pressure are apart: `coupling.creeping.AGREED`."""

LEAST_WATER = 0.75
"""Part of a thruster's disc that is water, below which its jet is not that of the disc."""


def final_frames(frames: int) -> int:
    """Number of frames at the end for a final mean."""
    return min(frames, max(FINAL_FRAMES, round(FINAL_PART * frames)))


def final_means(path: Path, columns: list[str], frames: int) -> dict[str, float]:
    """Mean of each column over the final frames of a history with `frames` rows."""
    last = deque(history_rows(path, columns), maxlen=final_frames(frames))
    return dict(zip(columns, np.mean(last, axis=0).tolist(), strict=True)) if last else {}


def converged_frame(
    path: Path, means: dict[str, float], within: dict[str, float], least: int
) -> int | None:
    """The first frame from which every joint stays within one strength step of its final mean.

    path    of the history
    means   column -> final mean
    within  column -> length of a strength step, rad or m
    least   number of frames, including the first, over which they must stay
    returns None without such joints, and when one leaves in the last `least` frames
    source  design page, section 8
    """
    columns = list(means)
    if not columns:
        return None
    target = np.array([means[column] for column in columns])
    # one part in 1e9 more: a joint exactly one step away counts as within
    radius = np.array([within[column] for column in columns]) * (1.0 + 1e-9)
    converged: int | None = None
    frame = 0.0
    for frame, *positions in history_rows(path, ["frame", *columns]):
        if np.all(np.abs(np.array(positions) - target) <= radius):
            converged = int(frame) if converged is None else converged
        else:
            converged = None
    stayed = converged is not None and frame - converged + 1 >= least
    return converged if stayed else None


def summarise(path: Path, within: dict[str, float], every: int | None) -> dict[str, Any]:
    """Final angles and objective, convergence and timing of a history.

    within  column of each controlled joint -> length of a strength step, rad or m
    every   frames from decision to decision; None when the joints cannot come to rest
    """
    columns = history_columns(path)
    frames = sum(1 for _ in history_rows(path, ["frame"]))
    positions = [c for c in columns if c.startswith(("angle_", "position_"))]
    controlled = final_means(path, [c for c in positions if c in within], frames)
    objective = final_means(path, ["objective"], frames).get("objective", np.nan)
    converged = None
    if every is not None:
        # the frames of the final mean and as many before them, and enough decisions
        least = max(2 * final_frames(frames), FINAL_FRAMES * every)
        converged = converged_frame(path, controlled, within, least)
    spent = [c for c in columns if c.startswith("seconds_")]
    totals = dict.fromkeys(spent, 0.0)
    for row in history_rows(path, spent):
        for column, seconds in zip(spent, row, strict=True):
            totals[column] += seconds
    first = next(islice(history_rows(path, ["seconds_total"]), 1), (0.0,))[0]
    whole = totals.pop("seconds_total", 0.0)
    last = deque(history_rows(path, ["time_s", *positions]), maxlen=1)
    return {
        "frames": frames,
        "time_s": last[0][0] if last else 0.0,
        "final": dict(zip(positions, last[0][1:], strict=True)) if last else {},
        "final_mean": controlled,
        "final_objective": objective if np.isfinite(objective) else None,
        "converged_frame": converged,
        "seconds_first_frame": first,
        "seconds_per_frame": (whole - first) / (frames - 1) if frames > 1 else whole,
        "seconds_by_part": {c.removeprefix("seconds_"): s for c, s in totals.items()},
    }


_version = cache(version)
"""Version of a package, read from its metadata once."""


def versions() -> dict[str, str]:
    """Versions of the packages that determine the numbers."""
    return {
        "flowborne": __version__,
        "python": platform.python_version(),
        **{name: _version(name) for name in ("numpy", "scipy", "numba", "mujoco-core")},
        "system": platform.platform(),
    }


def machine_memory() -> int | None:
    """Memory of this machine, bytes; None if the system does not report it."""
    try:
        return os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
    except (AttributeError, OSError, ValueError):
        return None


def peak_memory() -> int | None:
    """Peak memory of this process, bytes; None if the system does not report it."""
    if sys.platform == "win32":
        return None
    import resource

    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return peak if sys.platform == "darwin" else 1024 * peak


def doubts_of(history: Path, bodies: Sequence[str], fluid: Fluid | None) -> list[str]:
    """A sentence, without its full stop, for each reason not to trust the run.

    bodies  names of the moving bodies that displace fluid; they start inside the domain
    fluid   of the run
    """
    if fluid is None:
        return []
    found = departure(history, bodies, fluid), open_budget(history), apart(history)
    return [*(doubt for doubt in found if doubt), *dry_discs(history)]


def departure(history: Path, bodies: Sequence[str], fluid: Fluid) -> str | None:
    """The first body more than a cell outside the domain of the fluid; None when all stay inside.

    Periodic sides do not count. A domain that follows bodies is where the history has it.
    """
    grid, periodic, window = fluid.grid, fluid.boundaries.periodic(), fluid.window
    axes = np.array([axis for axis in grid.axes if not periodic[axis]], np.int64)
    columns = [f"{body}_{'xyz'[axis]}_m" for body in bodies for axis in axes]
    if not columns:
        return None
    moving = () if window is None else window.axes
    corners = [f"window_{'xyz'[axis]}_m" for axis in moving]
    corner, size = np.array(grid.origin), grid.spacing * np.array(grid.shape)
    for frame, *numbers in history_rows(history, ["frame", *corners, *columns]):
        corner[list(moving)] = numbers[: len(moving)]
        at = np.reshape(numbers[len(moving) :], (len(bodies), len(axes))) - corner[axes]
        left = np.any((at < -grid.spacing) | (at > size[axes] + grid.spacing), axis=1)
        if left.any():
            return (
                f"body '{bodies[int(left.argmax())]}' left the fluid's domain in frame "
                f"{frame:.0f}; enlarge [domain], or ask for fewer than {frame:.0f} frames"
            )
    return None


def open_budget(history: Path) -> str | None:
    """The frame with the largest error of the momentum budget, if above BUDGET_OPEN."""
    frame, error = worst(history, "momentum_budget_error")
    if error <= BUDGET_OPEN:
        return None
    return (
        f"momentum was lost or made: momentum_budget_error is {error:.2g} in frame {frame:.0f}, "
        "and some 1e-13 in a sound run; take more steps per frame, or enlarge [domain] if a body "
        "reaches through a side of it then"
    )


def apart(history: Path) -> str | None:
    """The frame in which viscosity and pressure agreed least, if they did not."""
    frame, error = worst(history, "sweep_error")
    if error <= APART:
        return None
    return (
        f"viscosity and pressure did not agree: sweep_error is {error:.2g} in frame {frame:.0f}, "
        f"and at most {APART:g} where they do; take more steps per frame"
    )


def worst(history: Path, column: str) -> tuple[float, float]:
    """Frame and value where a column is largest; 0 in a history without it."""
    if column not in history_columns(history):
        return 0.0, 0.0
    rows = history_rows(history, ["frame", column])
    frame, value = max(rows, key=lambda row: row[1], default=(0.0, 0.0))
    return frame, value


def dry_discs(history: Path) -> Iterator[str]:
    """Thrusters whose discs lost more of their water than LEAST_WATER leaves."""
    for column in history_columns(history):
        if not column.startswith("disc_water_"):
            continue
        rows = history_rows(history, ["frame", column])
        frame, part = min(rows, key=lambda row: row[1], default=(0.0, 1.0))
        if part < LEAST_WATER:
            name = column.removeprefix("disc_water_")
            yield (
                f"{100.0 * part:.0f} % of the disc of thruster '{name}' were water in frame "
                f"{frame:.0f}, which had the whole thrust; put it farther from bodies, or "
                "enlarge [domain] if it is at a side"
            )
