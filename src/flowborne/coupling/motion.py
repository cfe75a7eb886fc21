"""Prescribed motions, what drives the joints in a step, and what they are told from outside."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from flowborne.kernels.arrays import Array, Integers, Mask
from flowborne.solids.model import SolidModel


class Trajectory(Protocol):
    """A prescribed motion of some dofs, known for all time.

    dofs  (k,) indices into v, ascending: all dofs of each of its joints
    """

    @property
    def dofs(self) -> Integers: ...

    def position(self, time: float) -> Array:
        """(m,) the joints' entries of q at `time` (s): rad, m, unit quaternions."""
        ...

    def velocity(self, time: float) -> Array:
        """(k,) their entries of v, rad/s or m/s: the derivative of the positions."""
        ...


def velocity_after(
    model: SolidModel, q: Array, motion: Trajectory, time: float, dt: float
) -> Array:
    """(k,) velocity with which a motion goes on for a step after `time` (s).

    In leapfrog the velocities at an instant are those of half a step on, which the bodies then move
    with; given to driven dofs as it is to free ones, what they exchange is of second order in time.

    q  (nq,) a pose whose other joints do not matter
    """
    here, there = q.copy(), q.copy()
    indices = model.indices_of(motion.dofs)
    here[indices], there[indices] = motion.position(time), motion.position(time + dt)
    return model.difference(here, there)[motion.dofs] / dt


@dataclass
class JointCommand:
    """Which dofs are driven in a step and how; arrays over all nv dofs.

    prescribed      (nv,) bool
    rate            (nv,) velocity with which a driven dof moves during the step
    final_velocity  (nv,) velocity that a driven dof has at the end of the step
    torque_limit    (nv,) largest |generalised force| the drive may use; inf keeps the promise
    """

    prescribed: Mask
    rate: Array
    final_velocity: Array
    torque_limit: Array

    @classmethod
    def none(cls, nv: int) -> JointCommand:
        """Leaves every dof free."""
        return cls(np.zeros(nv, bool), np.zeros(nv), np.zeros(nv), np.full(nv, np.inf))

    def copy(self) -> JointCommand:
        return JointCommand(*(values.copy() for values in vars(self).values()))

    def set(
        self,
        dofs: Integers | Mask,
        rate: Array | float,
        final_velocity: Array | float,
        torque_limit: Array | float = np.inf,
    ) -> None:
        """Drive `dofs`, indices (k,) or a mask (nv,), with these velocities."""
        self.prescribed[dofs] = True
        self.rate[dofs] = rate
        self.final_velocity[dofs] = final_velocity
        self.torque_limit[dofs] = torque_limit


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
