"""What joints are told to do from outside in a frame: motions to targets, and forces."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flowborne.coupling.motion import Trajectory
from flowborne.kernels.arrays import Array, Integers
from flowborne.solids.model import SolidModel


@dataclass(frozen=True, eq=False)
class TrajectoryKnots:
    """Joints that go from pose to pose at even velocities and are in each at its time.

    dofs   (k,) of the joints
    times  (n,) s, ascending; n at least 2
    poses  (n, nq), whose other joints do not matter
    """

    model: SolidModel
    dofs: Integers
    times: Array
    poses: Array

    def position(self, time: float) -> Array:
        """(m,) entries of q; beyond both ends the joints keep their velocity."""
        knot = self._knot(time)
        pose = self.poses[knot]
        if time != self.times[knot]:
            pose = self.model.integrate(pose, self._velocity(knot), time - self.times[knot])
        return pose[self.model.indices_of(self.dofs)]

    def velocity(self, time: float) -> Array:
        """(k,) entries of v."""
        return self._velocity(self._knot(time))[self.dofs]

    def _knot(self, time: float) -> int:
        """The last one at or before `time`."""
        before = int(np.searchsorted(self.times, time, side="right")) - 1
        return min(max(before, 0), len(self.times) - 1)

    def _velocity(self, knot: int) -> Array:
        """(nv,) after a knot."""
        knot = min(knot, len(self.times) - 2)
        here, there = self.poses[knot : knot + 2]
        return self.model.difference(here, there) / (self.times[knot + 1] - self.times[knot])


@dataclass(frozen=True, eq=False)
class Told:
    """What joints are told from outside. Neither the scene's motions nor its controller moves them.

    motions  to their targets
    pushed   (k,) dofs that a force drives
    force    (k,) N m or N
    """

    motions: tuple[Trajectory, ...]
    pushed: Integers
    force: Array

    def force_on(self, nv: int) -> Array:
        """(nv,) generalised force."""
        force = np.zeros(nv)
        force[self.pushed] = self.force
        return force

    def dofs(self) -> Integers:
        """All that are told."""
        return np.concatenate([self.pushed, *(motion.dofs for motion in self.motions)])


NOTHING_TOLD = Told((), np.zeros(0, np.int64), np.zeros(0))
