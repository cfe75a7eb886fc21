"""One sparse factorisation of bones and flesh per step, with prescribed dofs eliminated.

As in solids.prescribed, with P the prescribed dofs and F the free ones,

    v+_P = hold        v+_F = B_FF^-1 (r_F + impulse_F - B_FP hold)
    tau dt = B v+ - r - impulse      on P

where B = A + J^T D J contains the active constraint rows. Their number is small, so only A_FF is
factorised, and B_FF^-1 follows from the formula of Sherman, Morrison and Woodbury:

    B^-1 = A^-1 - Y (D^-1 + J Y)^-1 Y^T      Y = A^-1 J^T

In a step, rotating flesh moves along straight lines, which stretches it by half the square of the
angle. Vibrations that the step cannot resolve absorb this energy and keep it: without damping, a
flag that swings through a third of its length tore after 90 steps. For a velocity v of frequency w,
S = A^-1 E scales v by s = (w dt)^2 / (2 + (w dt)^2), where E = dt^2/2 K is the part of A from the
flesh. Each step subtracts the impulse

    DAMPED_SHARE E S^(DAMPING_ORDER - 1) v,

a share DAMPED_SHARE s^DAMPING_ORDER of v, which acts almost only on unresolved vibrations. The
damping ratio of a vibration of n steps per period is DAMPED_SHARE (2 pi / n)^5 / 16.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, Self

import numpy as np
from scipy.linalg import cho_factor, cho_solve, solve_triangular
from scipy.sparse import csr_array

from flowborne.kernels.arrays import Array, Integers, Mask
from flowborne.solids.dynamics import Kinematics
from flowborne.solids.flesh_dynamics import FleshSystem
from flowborne.solids.model import SolidModel
from flowborne.solids.prescribed import Driven
from flowborne.solvers.cholesky import Cholesky, Ordering, cholesky, ordering_of
from flowborne.solvers.mobility import Drag, Mobility, SparseAnswer, factored_mobility

DAMPED_SHARE, DAMPING_ORDER = 0.25, 3
"""Share that a step takes from unresolved vibrations, and how sharply it selects them."""


def ordered(model: SolidModel, free: Integers) -> Ordering:
    """Elimination order of A (see `flesh_dynamics`) for the free dofs (nf,), valid for all poses.

    It is computed once per model and set of free dofs.
    """
    assert model.flesh is not None
    found = model.orderings
    key = free.tobytes()
    if key not in found:
        found[key] = ordering_of(model.flesh.pattern.matrix, free)
    return found[key]


@dataclass(frozen=True)
class PrescribedFlesh(Driven):
    """The response of bones and flesh.

    free    (nf,) the free dofs
    factor  of A_FF
    rows    Y_F (nf, k) and the factor of D^-1 + J Y, for the active rows
    """

    system: FleshSystem
    free: Integers
    factor: Cholesky
    rows: tuple[Array, Any]

    def answer(self, impulse: Array) -> Array:
        """B_FF^-1 of generalised impulses (nv,) or (nv, k), zero on prescribed dofs."""
        change = np.zeros_like(impulse)
        if impulse.any():
            change[self.free] = _solve(self.factor, self.rows, impulse[self.free])
        return change

    def actuator(self, v_plus: Array, impulse: Array) -> Array:
        if not self.prescribed.any():
            return self.push
        left = _remaining(self.system, v_plus) + impulse
        return np.where(self.prescribed, -left / self.system.dt, self.push)

    def mobility(self, pose: Kinematics) -> Mobility:
        T = csr_array(pose.jacobian[:, self.free])
        soft = self._soft(pose.moves[:, self.free])
        return factored_mobility(T, self.factor, self._constraints(), T @ soft)

    def answering(self, pose: Kinematics, drag: Drag) -> SparseAnswer:
        J, D, _ = self.system.acting()
        held = csr_array(J[:, self.free])
        B = self.system.A[self.free][:, self.free] + held.T @ (D[:, None] * held)
        return SparseAnswer(csr_array(B), csr_array(pose.jacobian[:, self.free]), csr_array(drag))

    def _constraints(self) -> Array:
        """(nf, k) Y' with B_FF^-1 = A_FF^-1 - Y' Y'^T."""
        Y, small = self.rows
        if small is None:
            return Y
        return np.asarray(solve_triangular(np.tril(small[0]), Y.T, lower=True).T)

    def _soft(self, moves: Mask) -> Array:
        """(nf, m) Z with Z Z^T the part of B_FF^-1 that moves bones, with flesh responding freely.

        moves  (nbody, nf) which dofs move bones
        """
        bones = np.flatnonzero(moves.any(axis=0))
        unit = np.zeros((len(self.free), len(bones)))
        unit[bones, np.arange(len(bones))] = 1.0
        answers = _solve(self.factor, self.rows, unit) if len(bones) else unit
        block = answers[bones]
        share, axes = np.linalg.eigh(0.5 * (block + block.T))
        return np.asarray(answers @ (axes / np.sqrt(np.maximum(share, np.finfo(float).tiny))))

    def same_mobility(self, other: Driven) -> bool:
        if not isinstance(other, PrescribedFlesh) or self.factor is not other.factor:
            return False
        return np.array_equal(self.system.zones, other.system.zones)

    def solved(self) -> Self:
        system, free, factor = self.system, np.flatnonzero(~self.prescribed), self.factor
        if not np.array_equal(free, self.free):
            factor = factored(system, free)
        J, D, _ = system.acting()
        Y = factor.solve(J[:, free].T) if len(D) else np.zeros((len(free), 0))
        rows = Y, cho_factor(np.diag(1.0 / D) + J[:, free] @ Y, lower=True) if len(D) else None
        velocity = np.where(self.prescribed, self.hold, 0.0)
        velocity[free] = _solve(factor, rows, _remaining(system, velocity)[free])
        return replace(self, velocity=velocity, free=free, factor=factor, rows=rows)


def prescribe_flesh(system: FleshSystem, prescribed: Mask, hold: Array) -> PrescribedFlesh:
    """Prescribe dofs (nv,) to end the step with velocities `hold` (nv,), exactly."""
    zero, none, free = np.zeros(len(hold)), np.zeros(len(hold), bool), np.flatnonzero(~prescribed)
    factor = factored(system, free)
    system = _damped(system, free, factor)
    given, rows = (prescribed.copy(), hold.copy()), (np.zeros((len(free), 0)), None)
    return PrescribedFlesh(system, *given, zero, none, zero, 0, free, factor, rows).solved()


def factored(system: FleshSystem, free: Integers) -> Cholesky:
    """The factor of A_FF for the free dofs (nf,)."""
    return cholesky(system.A.data, ordered(system.model, free))


def _damped(system: FleshSystem, free: Integers, factor: Cholesky) -> FleshSystem:
    """With the impulse that damps unresolved vibrations."""
    v = system.v
    for _ in range(DAMPING_ORDER - 1):
        kept = np.zeros_like(v)
        kept[free] = factor.solve((system.elastic @ v)[free])
        v = kept
    return replace(system, impulse=system.impulse - DAMPED_SHARE * (system.elastic @ v))


def _remaining(system: FleshSystem, v_plus: Array) -> Array:
    """(nv,) r - B v+."""
    J, D, push = system.acting()
    left = system.impulse + push
    return left - system.A @ v_plus - J.T @ (D * (J @ v_plus)) if v_plus.any() else left


def _solve(factor: Cholesky, rows: tuple[Array, Any], right: Array) -> Array:
    found = factor.solve(right)
    Y, small = rows
    if small is not None:
        found -= Y @ cho_solve(small, Y.T @ right)
    return found
