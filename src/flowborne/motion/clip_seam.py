"""Whether a loop whose ends are joined can be followed where they are."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from flowborne.errors import SceneError
from flowborne.motion.clip_curves import Columns
from flowborne.motion.clip_loop import mismatch, stride_between
from flowborne.motion.clip_motion import TrajectoryClip, normalise

Array = NDArray[np.float64]

FASTER = 5.0
"""How many times as fast as in the rest of a loop its joints may go where its ends are joined."""

MORE = 1.2
"""Blend that is proposed, over the one at which they would go as fast as that."""

SLOW = 1.0
"""rad/s or m/s that counts as the speed of a joint which hardly moves in the clip."""

SHORTEST = 0.5
"""s of a loop that is proposed."""

TIMES = 240
"""At which speeds are looked at, of a round and of its seam each."""


def check_seam(motion: TrajectoryClip) -> None:
    """Raise SceneError where ends that differ are to be joined in so short a time that joints jump:
    what a joint is off by, over the time of the fade, is a speed of its own.

    motion  a loop with an overlap
    """
    within = np.linspace(motion.overlap, motion.length, TIMES)
    seam = motion.length + np.linspace(0.0, motion.overlap, TIMES)
    own, joined = _speeds(motion, motion.length + within), _speeds(motion, seam)
    ratio = joined / np.maximum(own, SLOW)
    worst = int(ratio.argmax())
    if ratio[worst] <= FASTER:
        return
    joint = _joint(motion.columns, worst)
    longer, remedies = MORE * motion.overlap * ratio[worst] / FASTER, []
    if longer < 0.5 * (motion.length + motion.overlap):
        remedies.append(f"make blend {longer:.2g} s or longer")
    better = _best_stop(motion)
    if better is not None:
        remedies.append(f"set stop = {better:.3g}, where the clip is most as it begins")
    remedy = ", or ".join(remedies) or "take a longer part of it"
    raise SceneError(
        f"where it begins again, joint '{joint}' moves {ratio[worst]:.2g} times as fast as "
        f"anywhere else in it, as a blend of {motion.overlap:g} s joins ends that differ. "
        f"{remedy[0].upper()}{remedy[1:]}."
    )


def _joint(columns: Columns, dof: int) -> str:
    """Joint of a dof, by its place among those that follow."""
    column, turns = int(columns.v[dof]), columns.balls + len(columns.free)
    owner = column // 3 if column < 3 * turns else column - 2 * turns
    return columns.names[columns.owners[owner]]


def _speeds(motion: TrajectoryClip, times: Array) -> Array:
    """(k,) largest speed of each dof at these times."""
    return np.asarray(np.abs([motion.velocity(time) for time in times]).max(axis=0))


def _best_stop(motion: TrajectoryClip) -> float | None:
    """s of the clip: a stop after which the fade joins what is most alike; None for clips that are
    too short for another."""
    columns, half = motion.columns, 0.5 * motion.overlap
    last = motion.start + motion.length + motion.overlap

    def row(time: float) -> Array:
        found = np.asarray(motion.spline(time))
        normalise(columns, found, np.zeros_like(found))
        return found

    begin = row(motion.start + half)
    times = np.arange(motion.start + SHORTEST + motion.overlap, last, 1.0 / 60.0)
    ends = [row(time - half) for time in times]
    off = [mismatch(columns, begin, end, stride_between(columns, begin, end))[0] for end in ends]
    return float(times[int(np.argmin(off))]) if off else None
