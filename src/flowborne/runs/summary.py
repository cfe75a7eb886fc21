"""What came of a run, from its history."""

from __future__ import annotations

import os
import platform
import sys
from collections import deque
from functools import cache
from importlib.metadata import version
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np

from flowborne.runs.history import history_columns, history_rows
from flowborne.version import __version__

FINAL_PART = 0.1
"""Part of the frames, the last ones, whose mean is a joint's final mean ..."""

FINAL_FRAMES = 10
"""... but at least this many of them."""


def final_frames(frames: int) -> int:
    """Number of frames at the end over which a final mean is taken."""
    return min(frames, max(FINAL_FRAMES, round(FINAL_PART * frames)))


def final_means(path: Path, columns: list[str], frames: int) -> dict[str, float]:
    """Mean of each column over the final frames of a history with `frames` rows."""
    last = deque(history_rows(path, columns), maxlen=final_frames(frames))
    return dict(zip(columns, np.mean(last, axis=0).tolist(), strict=True)) if last else {}


def converged_frame(
    path: Path, means: dict[str, float], within: dict[str, float], least: int
) -> int | None:
    """The first frame after which every joint stays within one strength step of its final mean.

    path    of the history
    means   column -> final mean
    within  column -> length of a strength step, rad or m
    least   frames, this one included, over which they have to stay
    returns None when there is no such joint, and when one was away in the last `least` frames
    source  design page, section 8
    """
    columns = list(means)
    if not columns:
        return None
    target = np.array([means[column] for column in columns])
    # one part in 1e9 more: a joint that is exactly a step away counts as within
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
    every   frames from decision to decision; None where the joints cannot come to rest
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
    """Versions of what the numbers depend on."""
    return {
        "flowborne": __version__,
        "python": platform.python_version(),
        **{name: _version(name) for name in ("numpy", "scipy", "numba", "mujoco-core")},
        "system": platform.platform(),
    }


def machine_memory() -> int | None:
    """Memory of this machine, bytes; None where the system does not tell."""
    try:
        return os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
    except (AttributeError, OSError, ValueError):
        return None


def peak_memory() -> int | None:
    """Largest memory that this process has held, bytes; None where the system does not tell."""
    if sys.platform == "win32":
        return None
    import resource

    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return peak if sys.platform == "darwin" else 1024 * peak
