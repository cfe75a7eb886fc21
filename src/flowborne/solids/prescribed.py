"""Prescribed dofs: their velocity after the step is given, and their force is computed.

Partial inverse dynamics: with P the prescribed dofs and F the free ones,

    v+_P = hold        v+_F = A_FF^-1 (r_F + impulse_F - A_FP hold)
    tau dt = A v+ - r - impulse      on P

`Driven` is the contract of bones alone, here, and of bones and flesh, in `flesh_solve`.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, replace
from typing import Self

import numpy as np
from scipy.linalg.lapack import dpotrf, dpotri

from flowborne.base.errors import BreakdownError
from flowborne.kernels.arrays import Array, Mask
from flowborne.solids.dynamics import Kinematics, SolidSystem, System
from flowborne.solvers.mobility import (
    Answering,
    DenseAnswer,
    Drag,
    Mobility,
    dense_mobility,
    no_mobility,
)


@dataclass(frozen=True)
class Driven(ABC):
    """The response of bodies to an impulse in a step when some dofs are driven.

    system      the equations of motion
    prescribed  (nv,) dofs that end the step with velocity `hold`
    hold        (nv,) rad/s or m/s; entries of free dofs are not used
    velocity    (nv,) v*, velocity after the step without an impulse
    limited     (nv,) dofs with a drive at its limit; they are free, and `push` acts on them
    push        (nv,) generalised force of limited drives, already in `system`
    turns       number of changes of the drives
    """

    system: System
    prescribed: Mask
    hold: Array
    velocity: Array
    limited: Mask
    push: Array
    turns: int

    @abstractmethod
    def answer(self, impulse: Array) -> Array:
        """(nv,) change of velocity by a generalised impulse (nv,); zero on prescribed dofs."""

    @abstractmethod
    def actuator(self, v_plus: Array, impulse: Array) -> Array:
        """(nv,) generalised force that the drives supplied; zero on dofs without a drive."""

    @abstractmethod
    def mobility(self, pose: Kinematics) -> Mobility:
        """The motion caused by a unit impulse: M = T A^-1 T^T."""

    @abstractmethod
    def answering(self, pose: Kinematics, drag: Drag) -> Answering:
        """The response of the bodies to a drag (k, k), kg."""

    @abstractmethod
    def same_mobility(self, other: Driven) -> bool:
        """Whether both respond equally to any impulse."""

    @abstractmethod
    def solved(self) -> Self:
        """The same with `velocity`, and what `answer` uses, for the other fields."""

    def after(self, impulse: Array) -> Array:
        """(nv,) velocity after the step with a generalised impulse (nv,), such as the fluid's."""
        return self.velocity + self.answer(impulse)

    def updated(self, v_plus: Array) -> Self | None:
        """With the contacts and limits at `v_plus`; None when they do not change."""
        system = self.system.updated(v_plus)
        return None if system is None else replace(self, system=system).solved()

    def redriven(self, prescribed: Mask, limited: Mask, push: Array) -> Self:
        """With other prescribed dofs, and other drives at their limits."""
        return replace(
            self,
            system=self.system.pushed(push - self.push),
            prescribed=prescribed,
            limited=limited,
            push=push,
            turns=self.turns + 1,
        ).solved()


@dataclass(frozen=True)
class PrescribedSystem(Driven):
    """The response of bones alone.

    inverse  (nv, nv) A_FF^-1, zero in rows and columns of prescribed dofs; symmetric
    """

    system: SolidSystem
    inverse: Array

    def under(self, applied: Array) -> Self | None:
        """As the step began, under another generalised force (nv,); None where it is made anew."""
        system = self.system.under(applied)
        return None if system is None else replace(self, system=system).solved()

    def answer(self, impulse: Array) -> Array:
        return np.asarray(self.inverse @ impulse)

    def actuator(self, v_plus: Array, impulse: Array) -> Array:
        s = self.system
        needed = (s.A @ v_plus - s.impulse - impulse) / s.dt
        return np.where(self.prescribed, needed, self.push)

    def mobility(self, pose: Kinematics) -> Mobility:
        if not self.inverse.any():
            return no_mobility(len(pose.twist_rows))
        return dense_mobility(self._response(pose))

    def answering(self, pose: Kinematics, drag: Drag) -> DenseAnswer:
        return DenseAnswer(self._response(pose), np.asarray(drag))

    def _response(self, pose: Kinematics) -> Array:
        return np.asarray(pose.twist_rows @ self.inverse @ pose.twist_rows.T)

    def same_mobility(self, other: Driven) -> bool:
        return isinstance(other, PrescribedSystem) and np.array_equal(self.inverse, other.inverse)

    def solved(self) -> Self:
        system, free = self.system, (~self.prescribed).nonzero()[0]
        velocity = np.where(self.prescribed, self.hold, 0.0)
        inverse = np.zeros(system.A.shape)
        if free.size:
            across = np.ix_(free, free)
            block = symmetric_inverse(system.A[across])
            inverse[across] = block
            velocity[free] = block @ (system.impulse[free] - system.A[free] @ velocity)
        return replace(self, inverse=inverse, velocity=velocity)


def prescribe(system: SolidSystem, prescribed: Mask, hold: Array) -> PrescribedSystem:
    """Prescribe dofs (nv,) to end the step with velocities `hold` (nv,), exactly.

    raises  BreakdownError when the matrix of the free dofs is not positive definite
    """
    zero, none, inverse = np.zeros(len(hold)), np.zeros(len(hold), bool), np.zeros(system.A.shape)
    given = prescribed.copy(), hold.copy()
    return PrescribedSystem(system, *given, zero, none, zero, turns=0, inverse=inverse).solved()


def symmetric_inverse(matrix: Array) -> Array:
    """Inverse of a symmetric positive definite matrix by Cholesky, exactly symmetric.

    raises  BreakdownError when it is not positive definite
    """
    factor, fault = dpotrf(matrix, lower=1)
    if fault == 0:
        lower, fault = dpotri(factor, lower=1)
    if fault:
        raise BreakdownError(
            f"the solid's matrix is not positive definite at free dof {fault - 1}. "
            "Give the body there mass and inertia, or its joint some armature"
        )
    inverse = lower + lower.T  # dpotrf has cleared the upper triangle
    inverse.flat[:: len(inverse) + 1] *= 0.5
    return np.asarray(inverse)
