"""Prescribed dofs: the velocity they end the step with is given, the force they need is read off.

Partial inverse dynamics: with P the prescribed dofs and F the free ones,

    v+_P = hold        v+_F = A_FF^-1 (r_F + impulse_F - A_FP hold)
    tau dt = A v+ - r - impulse      on P
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy.linalg.lapack import dpotrf, dpotri

from flowborne.solids.dynamics import SolidSystem
from flowborne.solids.flesh_solve import PrescribedFlesh

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

OVER = 1e-9
"""Share by which a drive may exceed its limit, or a dof its velocity, before that counts."""

AT_ONCE = 6
"""Turns in which all drives that are wrong change; after them one at a time does."""


@dataclass(frozen=True)
class PrescribedSystem:
    """The solid's answer to an impulse when some dofs are prescribed.

    system      the system it was made from
    prescribed  (nv,) dofs that end the step with velocity `hold`
    hold        (nv,) rad/s or m/s; free dofs' entries are not used
    inverse     (nv, nv) A_FF^-1, zero in rows and columns of prescribed dofs; symmetric
    velocity    (nv,) v*, velocity after the step when there is no impulse
    limited     (nv,) dofs whose drive reached its limit; they are free and pushed by `push`
    push        (nv,) generalised force of limited drives, already in `system`
    turns       times that drives were released or taken up
    """

    system: SolidSystem
    prescribed: Mask
    hold: Array
    inverse: Array
    velocity: Array
    limited: Mask
    push: Array = field(repr=False)
    turns: int = 0

    def after(self, impulse: Array) -> Array:
        """(nv,) velocity after the step with a generalised impulse (nv,), the fluid's for one."""
        return np.asarray(self.velocity + self.inverse @ impulse)

    def actuator(self, v_plus: Array, impulse: Array) -> Array:
        """(nv,) generalised force that the drives supplied; zero on dofs without a drive."""
        s = self.system
        needed = (s.A @ v_plus - s.impulse - impulse) / s.dt
        return np.where(self.prescribed, needed, self.push)

    def updated(self, v_plus: Array) -> PrescribedSystem | None:
        """With the contacts and limits that `v_plus` implies; None when it has them already."""
        system = self.system.updated(v_plus)
        if system is None:
            return None
        return _solved(system, self.prescribed, self.hold, self.limited, self.push, self.turns)

    def redriven(self, prescribed: Mask, limited: Mask, push: Array) -> PrescribedSystem:
        """With other drives that keep their dofs, and others at their limits."""
        system = self.system.pushed(push - self.push)
        return _solved(system, prescribed, self.hold, limited, push, self.turns + 1)

    def answers_as(self, other: object) -> bool:
        """Whether both give the same answer to any impulse."""
        return isinstance(other, PrescribedSystem) and np.array_equal(self.inverse, other.inverse)


Driven = PrescribedSystem | PrescribedFlesh
"""Bones alone, or bones and flesh, some of whose dofs are prescribed."""


def prescribe(system: SolidSystem, prescribed: Mask, hold: Array) -> PrescribedSystem:
    """Prescribe dofs (nv,) to end the step with velocities `hold` (nv,), exactly.

    raises  ValueError when the free dofs' matrix is not positive definite
    """
    none = np.zeros(len(hold), bool)
    return _solved(system, prescribed, hold, none, np.zeros(len(hold)))


def within_limits(driven: Driven, limit: Array, v_plus: Array, actuator: Array) -> Driven | None:
    """The system with the drives that the solution implies; None when it has them already.

    A drive either keeps its dof at `hold` with a force within its limit, or pushes with all that
    it has towards a velocity that the dof does not reach: one that needs more is released, one
    whose dof runs past `hold` takes it up again. Together it is a linear complementarity problem
    of a positive definite matrix; changing one drive at a time, the first, ends for certain
    (Murty 1974), and all at once ends sooner as a rule.

    limit     (nv,) largest |generalised force| of each drive, inf for none
    v_plus    (nv,) velocity of the solution
    actuator  (nv,) force that its drives supply, as `driven.actuator` gives it
    """
    over = driven.prescribed & (np.abs(actuator) > limit * (1.0 + OVER))
    past = driven.limited
    if past.any():
        room = OVER * (np.abs(v_plus) + np.abs(driven.hold))
        past = past & (np.sign(driven.push) * (v_plus - driven.hold) > room)
    wrong = (over | past).nonzero()[0]
    if wrong.size == 0:
        return None
    if driven.turns >= AT_ONCE:
        wrong = wrong[:1]
    prescribed, limited, push = driven.prescribed.copy(), driven.limited.copy(), driven.push.copy()
    prescribed[wrong], limited[wrong] = past[wrong], over[wrong]
    push[wrong] = np.where(over[wrong], np.sign(actuator[wrong]) * limit[wrong], 0.0)
    return driven.redriven(prescribed, limited, push)


def _solved(
    system: SolidSystem, prescribed: Mask, hold: Array, limited: Mask, push: Array, turns: int = 0
) -> PrescribedSystem:
    free = (~prescribed).nonzero()[0]
    velocity = np.where(prescribed, hold, 0.0)
    inverse = np.zeros(system.A.shape)
    if free.size:
        across = np.ix_(free, free)
        block = symmetric_inverse(system.A[across])
        inverse[across] = block
        velocity[free] = block @ (system.impulse[free] - system.A[free] @ velocity)
    return PrescribedSystem(
        system, prescribed.copy(), hold.copy(), inverse, velocity, limited, push, turns
    )


def symmetric_inverse(matrix: Array) -> Array:
    """Inverse of a symmetric positive definite matrix by Cholesky, exactly symmetric.

    raises  ValueError when it is not positive definite
    """
    factor, fault = dpotrf(matrix, lower=1)
    if fault == 0:
        lower, fault = dpotri(factor, lower=1)
    if fault:
        raise ValueError(
            f"the solid's matrix is not positive definite at free dof {fault - 1}. "
            "Give the body there mass and inertia, or its joint some armature."
        )
    inverse = lower + lower.T  # dpotrf has cleared the upper triangle
    inverse.flat[:: len(inverse) + 1] *= 0.5
    return np.asarray(inverse)
