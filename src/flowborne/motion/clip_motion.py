"""A clip as the prescribed motion of many joints (`solids.trajectories.Trajectory`)."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from scipy.interpolate import CubicSpline

from flowborne.kernels.arrays import Array, Integers
from flowborne.motion.clip_curves import Columns, Stride
from flowborne.motion.quaternions import inverse, product
from flowborne.solids.model import SolidModel

Rows = tuple[Array, Array]
"""A row of joint positions (see Columns), unit quaternions, and its derivative."""

MAX_CACHED_TIMES = 64
"""Number of times for which positions and velocities are cached."""


@dataclass(eq=False)
class TrajectoryClip:
    """Joints that follow a clip; time 0 is the start of the trimmed clip.

    Before time 0 they are at rest. During the first `blend` seconds they are blended from the
    initial pose into the running clip. At the end the clip slows down to rest over `blend` seconds,
    and continues for half of that; or it starts again, where the first `overlap` seconds of a cycle
    are a cross-fade from the cycle before. If blend is above 0, velocity is continuous.

    dofs      (k,) all dofs of the joints, ascending
    columns   layout of the rows
    spline    row of joint positions over the clip's time, s; its quaternions are not normalised
    start     s of the clip at time 0
    length    s of the clip until its end, or the end of a cycle
    blend     s
    initial   (columns,) row of the pose before the start
    stride    from cycle to cycle; None when the clip does not loop
    overlap   s
    """

    dofs: Integers
    columns: Columns
    spline: CubicSpline
    start: float
    length: float
    blend: float
    initial: Array
    stride: Stride | None
    overlap: float
    _known: dict[float, Rows] = field(default_factory=dict, init=False, repr=False)

    def __getstate__(self) -> dict[str, Any]:
        return {**vars(self), "_known": {}}

    def position(self, time: float) -> Array:
        """(m,) entries of q of the joints in MuJoCo's order at `time` (s). Read only."""
        return self._prescribed(time)[0]

    def velocity(self, time: float) -> Array:
        """(k,) entries of v of the joints: rad/s, for a ball in body axes; m/s in world axes. Read
        only."""
        return self._prescribed(time)[1]

    def _prescribed(self, time: float) -> Rows:
        """Position and velocity, cached: all trials of a decision use the same few times."""
        known = self._known.get(time)
        if known is None:
            row, rate = self._at(time)
            balls = 4 * self.columns.balls
            spin = product(inverse(self.columns.quaternions(row)), self.columns.quaternions(rate))
            flat = np.concatenate([2.0 * spin[:, 1:].ravel(), rate[balls:]])
            known = row[self.columns.q], flat[self.columns.v]
            for values in known:
                values.setflags(write=False)
            if len(self._known) >= MAX_CACHED_TIMES:
                self._known.clear()
            self._known[time] = known
        return known

    def _at(self, time: float) -> Rows:
        row, rate = self._running(max(time, 0.0))
        if max(time, 0.0) < self.blend:
            share, slope = smooth_step(time / self.blend)
            still = self.initial, np.zeros_like(rate)
            row, rate = blended(self.columns, still, (row, rate), share, slope / self.blend)
        return row, rate if time >= 0.0 else np.zeros_like(rate)

    def _running(self, time: float) -> Rows:
        stride = self.stride
        if stride is None:
            clip_time, speed = self._slowed(time)
            row, rate = self._clip(clip_time)
            return row, speed * rate
        cycle, within = divmod(time, self.length)
        row, rate = self._clip(within)
        if cycle > 0 and within < self.overlap:
            old = self._moved(self._clip(within + self.length), stride, -1)
            share, slope = smooth_step(within / self.overlap)
            row, rate = blended(self.columns, old, (row, rate), share, slope / self.overlap)
        return self._moved((row, rate), stride, int(cycle))

    def _moved(self, rows: Rows, stride: Stride, cycles: int) -> Rows:
        """Rows after a number of strides."""
        turn, shift = stride.repeated(cycles)
        shifts = np.stack([shift, np.zeros(3)])[:, None]
        row, rate = self.columns.moved(np.stack(rows), turn, shifts)
        return row, rate

    def _slowed(self, time: float) -> tuple[float, float]:
        """Time of the clip since its start, and its rate: 1, then smoothly to 0 at the end."""
        brake = self.length - self.blend / 2.0
        if time <= brake and time < self.length:
            return time, 1.0
        if time >= brake + self.blend:
            return self.length, 0.0
        u = (time - brake) / self.blend
        covered = u - u**4 * (u * (u - 3.0) + 2.5)
        return brake + self.blend * covered, 1.0 - smooth_step(u)[0]

    def _clip(self, time: float) -> Rows:
        """Row and derivative at a time (s) since the start of the trimmed clip."""
        row, rate = self.spline(self.start + time), self.spline(self.start + time, 1)
        normalise(self.columns, row, rate)
        return row, rate


@dataclass(frozen=True, eq=False)
class TrajectoryPart:
    """Some joints of a clip; the positions of all its joints are computed once for all parts.

    clip        motion of these joints and others
    dofs        (k,) all dofs of these, ascending
    positions   (m,) indices of their entries in the positions of the clip
    velocities  (k,) indices of their entries in its velocities
    """

    clip: TrajectoryClip
    dofs: Integers
    positions: Integers
    velocities: Integers

    @staticmethod
    def of(clip: TrajectoryClip, model: SolidModel, dofs: Integers) -> TrajectoryPart:
        """The part of some dofs of the clip."""
        positions = np.searchsorted(model.indices_of(clip.dofs), model.indices_of(dofs))
        return TrajectoryPart(clip, dofs, positions, np.searchsorted(clip.dofs, dofs))

    def position(self, time: float) -> Array:
        return self.clip.position(time)[self.positions]

    def velocity(self, time: float) -> Array:
        return self.clip.velocity(time)[self.velocities]


def smooth_step(u: float) -> tuple[float, float]:
    """Smooth step from 0 to 1 with two derivatives that vanish at its ends, and its slope."""
    if not 0.0 < u < 1.0:
        return float(u >= 1.0), 0.0
    return u**3 * (u * (6.0 * u - 15.0) + 10.0), 30.0 * (u * (1.0 - u)) ** 2


def blended(columns: Columns, old: Rows, new: Rows, share: float, slope: float) -> Rows:
    """Blend of two motions with weight `share` of the new one, which grows by `slope` (1/s)."""
    row, rate = new[0].copy(), new[1].copy()
    opposite = np.sum(columns.quaternions(old[0]) * columns.quaternions(row), axis=-1) < 0.0
    columns.quaternions(row)[opposite] *= -1.0
    columns.quaternions(rate)[opposite] *= -1.0
    rate = old[1] + share * (rate - old[1]) + slope * (row - old[0])
    row = old[0] + share * (row - old[0])
    normalise(columns, row, rate)
    return row, rate


def normalise(columns: Columns, row: Array, rate: Array) -> None:
    """Normalise the quaternions of a row, and project their rates accordingly, in place."""
    q, dq = columns.quaternions(row), columns.quaternions(rate)
    size = np.sqrt(np.sum(q * q, axis=-1, keepdims=True))
    q /= size
    dq /= size
    dq -= q * np.sum(q * dq, axis=-1, keepdims=True)
