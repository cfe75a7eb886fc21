"""The motion of a model's joints from a clip: trim, low-pass, loop, and the check of its seam."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline

from flowborne.base.errors import SceneError
from flowborne.kernels.arrays import Array
from flowborne.motion.clip import Clip
from flowborne.motion.clip_curves import (
    MAX_CYCLE_MISMATCH,
    UP,
    Columns,
    Stride,
    curves_of,
    mismatch,
    row_of,
    stride_between,
)
from flowborne.motion.clip_motion import TrajectoryClip, normalise
from flowborne.motion.quaternions import about, continuous, inverse, product, twist
from flowborne.solids.model import SolidModel

MAX_SEAM_SPEED_RATIO = 5.0
"""Largest speed of a joint in the seam of a loop, relative to the rest of the loop."""

BLEND_MARGIN = 1.2
"""Proposed blend, relative to the blend at which this ratio is reached."""

MIN_REFERENCE_SPEED = 1.0
"""Smallest reference speed, rad/s or m/s, for joints that hardly move."""

MIN_LOOP_DURATION = 0.5
"""Smallest duration of a proposed loop, s."""

SPEED_SAMPLES = 240
"""Number of times at which speeds are evaluated, in a cycle and in its seam each."""

MIN_FILTER_PERIODS = 0.1
"""Smallest duration of a clip, in periods of the low-pass cut-off."""


@dataclass(frozen=True)
class Passage:
    """The part of a clip to follow, with its loop, blend and filter.

    start, stop  s of the clip; None is its end
    loop         whether to start again at the end, from the position and heading reached
    blend        s, at most half the time from start to stop; see TrajectoryClip. A clip that ends
                 as it begins loops unchanged, any other is joined over `blend`
    smooth       Hz at which a low-pass halves the power (a Butterworth filter of second order,
                 forward and backward for zero lag), or None
    source       Winter 2009, Biomechanics and Motor Control of Human Movement, section 3.4.4.2
                 (cut-off of one pass from that of both)
    """

    start: float = 0.0
    stop: float | None = None
    loop: bool = False
    blend: float = 0.0
    smooth: float | None = None


WHOLE_CLIP = Passage()
"""The whole clip, once."""


def trajectory_of_clip(
    model: SolidModel,
    clip: Clip,
    mapping: Mapping[str, str],
    passage: Passage = WHOLE_CLIP,
    *,
    joints: Sequence[str] | None = None,
    initial: Array | None = None,
) -> TrajectoryClip:
    """Motion of a model's joints along a clip.

    mapping  model joint -> clip joint; joints that the model lacks are ignored
    joints   model joints that follow the clip; all mapped ones by default
    initial  (nq,) pose before the start, moved to the clip's first position and heading; the rest
             pose by default
    raises   SceneError when an argument does not fit the clip or the model
    """
    start, blend = passage.start, passage.blend
    chosen = joints if joints is not None else [j for j in mapping if j in model.joint_names]
    columns, rows = curves_of(model, clip, mapping, chosen)
    stop = clip.duration if passage.stop is None else passage.stop
    _check_times(clip, start, stop, blend)
    times = clip.frame_time * np.arange(clip.frames)
    length, overlap, stride = stop - start, 0.0, None
    if passage.loop:
        stride = _whole_cycle(columns, rows, start / clip.frame_time, stop / clip.frame_time)
        if stride is not None:
            times, rows = _repeated(columns, rows, clip.frame_time, (start, stop), stride)
        else:
            overlap = blend
            length -= blend
    if passage.smooth is not None:
        rows = _smoothed(rows, clip.frame_time, passage.smooth)
    spline = CubicSpline(times, rows)
    if passage.loop and stride is None:
        stride = _joined(columns, spline, start, length, overlap)
    pose = model.rest().q if initial is None else initial
    entries = np.concatenate([model.positions_of(name) for name in columns.names])
    before = _moved_to_start(columns, row_of(columns, pose[entries]), spline(start))
    motion = TrajectoryClip(
        columns.dofs, columns, spline, start, length, blend, before, stride, overlap
    )
    if overlap > 0.0:
        check_seam(motion)
    return motion


def _check_times(clip: Clip, start: float, stop: float, blend: float) -> None:
    if not 0.0 <= start < stop <= clip.duration * (1.0 + 1e-9):
        raise SceneError(
            f"it lasts {clip.duration:g} s, but start is {start:g} s and stop {stop:g} s. "
            "Give a start before a stop within the clip."
        )
    if blend > (stop - start) / 2.0:
        raise SceneError(
            f"blend {blend:g} s is more than half of the {stop - start:g} s from start to "
            "stop. Make it shorter."
        )


def _whole_cycle(columns: Columns, rows: Array, first: float, last: float) -> Stride | None:
    """Stride of a loop between two frames if the clip ends as it begins, else None."""
    begin, end = round(first), round(last)
    if max(abs(first - begin), abs(last - end)) > 1e-6:
        return None
    stride = stride_between(columns, rows[begin], rows[end])
    return (
        stride
        if mismatch(columns, rows[begin], rows[end], stride)[0] < MAX_CYCLE_MISMATCH
        else None
    )


def _repeated(
    columns: Columns, rows: Array, frame_time: float, span: tuple[float, float], stride: Stride
) -> tuple[Array, Array]:
    """Times and rows of three successive cycles, which make the ends of the middle one smooth."""
    begin, end = round(span[0] / frame_time), round(span[1] / frame_time)
    cycle = rows[begin:end]
    repeated = np.concatenate(
        [columns.moved(cycle, *stride.repeated(n)) for n in (-1, 0, 1)]
        + [columns.moved(cycle[:1], *stride.repeated(2))]
    )
    quaternions = columns.quaternions(repeated)
    quaternions[...] = continuous(quaternions)
    frames = np.arange(len(repeated), dtype=np.float64) + (2 * begin - end)
    return frame_time * frames, repeated


def _joined(
    columns: Columns, spline: CubicSpline, start: float, length: float, overlap: float
) -> Stride:
    """Stride of a loop with cross-blended ends, exact in the middle of the fade."""
    begin, end = spline(start + overlap / 2.0), spline(start + length + overlap / 2.0)
    for row in (begin, end):
        normalise(columns, row, np.zeros_like(row))
    stride = stride_between(columns, begin, end)
    if overlap == 0.0:
        size, joint = mismatch(columns, begin, end, stride)
        raise SceneError(
            f"it loops without a blend, but joint '{joint}' ends {size:.3g} rad or m "
            "from where it begins. Give a blend, or start and stop one whole cycle apart."
        )
    return stride


def _smoothed(rows: Array, frame_time: float, cut_off: float) -> Array:
    """Rows after a zero-lag low-pass; `cut_off` (Hz) is that of both passes together."""
    one_pass = cut_off / (np.sqrt(2.0) - 1.0) ** 0.25
    if not 0.0 < one_pass < 0.5 / frame_time:
        most = 0.5 / frame_time * (np.sqrt(2.0) - 1.0) ** 0.25
        raise SceneError(
            f"smooth {cut_off:g} Hz is not between 0 and {most:.3g} Hz, the maximum for a clip "
            f"of {1.0 / frame_time:.4g} frames per second. Leave it out or lower it."
        )
    if cut_off * len(rows) * frame_time < MIN_FILTER_PERIODS:
        raise SceneError(
            f"smooth {cut_off:g} Hz removes all motion from {len(rows) * frame_time:.3g} s. "
            "Leave it out or raise it."
        )
    from scipy.signal import (
        butter,
        sosfiltfilt,
    )  # takes a fifth of a second, and few scenes need it

    filters = butter(2, one_pass, fs=1.0 / frame_time, output="sos")
    edge = min(len(rows) - 1, int(np.ceil(1.0 / (one_pass * frame_time))))
    return np.asarray(sosfiltfilt(filters, rows, axis=0, padlen=edge))


def _moved_to_start(columns: Columns, pose: Array, first: Array) -> Array:
    """A pose with the positions and headings of its free joints from the first row of a clip."""
    result = pose.copy()
    columns.positions(result)[...] = columns.positions(first)
    own, target = columns.quaternions(result), columns.quaternions(first)
    for ball in columns.free:
        heading = twist(product(target[ball], inverse(own[ball])), UP)
        own[ball] = product(about(UP, heading), own[ball])
    return result


def check_seam(motion: TrajectoryClip) -> None:
    """Raise SceneError when the cross-fade between different ends makes a joint too fast.

    The cross-fade adds a speed: the difference of the ends over its duration.

    motion  a loop with an overlap
    """
    within = np.linspace(motion.overlap, motion.length, SPEED_SAMPLES)
    seam = motion.length + np.linspace(0.0, motion.overlap, SPEED_SAMPLES)
    own, joined = _speeds(motion, motion.length + within), _speeds(motion, seam)
    ratio = joined / np.maximum(own, MIN_REFERENCE_SPEED)
    worst = int(ratio.argmax())
    if ratio[worst] <= MAX_SEAM_SPEED_RATIO:
        return
    joint = _joint(motion.columns, worst)
    longer, remedies = BLEND_MARGIN * motion.overlap * ratio[worst] / MAX_SEAM_SPEED_RATIO, []
    if longer < 0.5 * (motion.length + motion.overlap):
        remedies.append(f"make blend {longer:.2g} s or longer")
    better = _best_stop(motion)
    if better is not None:
        remedies.append(f"set stop = {better:.3g}, where the clip is closest to its beginning")
    remedy = ", or ".join(remedies) or "take a longer part of it"
    raise SceneError(
        f"where it starts again, joint '{joint}' moves {ratio[worst]:.2g} times as fast as "
        f"anywhere else, because a blend of {motion.overlap:g} s joins different ends. "
        f"{remedy[0].upper()}{remedy[1:]}."
    )


def _joint(columns: Columns, dof: int) -> str:
    """Joint of a dof, by its index among the followed dofs."""
    column, turns = int(columns.v[dof]), columns.balls + len(columns.free)
    owner = column // 3 if column < 3 * turns else column - 2 * turns
    return columns.names[columns.owners[owner]]


def _speeds(motion: TrajectoryClip, times: Array) -> Array:
    """(k,) largest speed of each dof at these times."""
    return np.asarray(np.abs([motion.velocity(time) for time in times]).max(axis=0))


def _best_stop(motion: TrajectoryClip) -> float | None:
    """The stop of the clip, s, with the smallest difference of the ends; None for short clips."""
    columns, half = motion.columns, 0.5 * motion.overlap
    last = motion.start + motion.length + motion.overlap

    def row(time: float) -> Array:
        found = np.asarray(motion.spline(time))
        normalise(columns, found, np.zeros_like(found))
        return found

    begin = row(motion.start + half)
    times = np.arange(motion.start + MIN_LOOP_DURATION + motion.overlap, last, 1.0 / 60.0)
    ends = [row(time - half) for time in times]
    sizes = [mismatch(columns, begin, end, stride_between(columns, begin, end))[0] for end in ends]
    return float(times[int(np.argmin(sizes))]) if sizes else None
