"""One sparse factorisation of bones and flesh a step, with prescribed dofs projected out.

As solids.prescribed does with dense matrices: with P the prescribed dofs and F the free ones,

    v+_P = hold        v+_F = B_FF^-1 (r_F + impulse_F - B_FP hold)
    tau dt = B v+ - r - impulse      on P

where B = A + J^T D J holds the active constraint rows. Their number is small, so that A_FF alone is
factorised and B_FF^-1 is found by the formula of Sherman, Morrison and Woodbury:

    B^-1 = A^-1 - Y (D^-1 + J Y)^-1 Y^T      Y = A^-1 J^T
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve
from scipy.sparse import csc_array
from scipy.sparse.linalg import splu

from flowborne.solids.flesh_dynamics import FleshSystem

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]


@dataclass(frozen=True)
class PrescribedFlesh:
    """The answer of bones and flesh to impulses when some dofs are prescribed.

    system      the system it was made from
    prescribed  (nv,) dofs that end the step with velocity `hold`
    hold        (nv,) rad/s or m/s; free dofs' entries are not used
    velocity    (nv,) v*, velocity after the step when there is no impulse
    free        (nf,) the free dofs
    factor      of A_FF
    rows        Y_F (nf, k) and the factor of D^-1 + J Y, for the active rows
    """

    system: FleshSystem
    prescribed: Mask
    hold: Array
    velocity: Array
    free: NDArray[np.int64]
    factor: Any
    rows: tuple[Array, Any]

    def answer(self, impulse: Array) -> Array:
        """B_FF^-1 of generalised impulses (nv,) or (nv, k), zero on prescribed dofs."""
        change = np.zeros_like(impulse)
        change[self.free] = _solve(self.factor, self.rows, impulse[self.free])
        return change

    def after(self, impulse: Array) -> Array:
        """(nv,) velocity after the step with a generalised impulse (nv,), the fluid's for one."""
        return self.velocity + self.answer(impulse)

    def actuator(self, v_plus: Array, impulse: Array) -> Array:
        """(nv,) generalised force that the drives supplied; zero on dofs without a drive."""
        left = _remaining(self.system, v_plus) + impulse
        return np.where(self.prescribed, -left / self.system.dt, 0.0)

    def updated(self, v_plus: Array) -> PrescribedFlesh | None:
        """With the contacts and limits that `v_plus` implies; None when it has them already."""
        system = self.system.updated(v_plus)
        if system is None:
            return None
        return _solved(system, self.prescribed, self.hold, self.free, self.factor)


def prescribe_flesh(system: FleshSystem, prescribed: Mask, hold: Array) -> PrescribedFlesh:
    """Prescribe dofs (nv,) to end the step with velocities `hold` (nv,), exactly."""
    free = np.flatnonzero(~prescribed)
    factor = symmetric_factor(csc_array(system.A[free][:, free]))
    return _solved(system, prescribed.copy(), hold.copy(), free, factor)


def _solved(
    system: FleshSystem, prescribed: Mask, hold: Array, free: NDArray[np.int64], factor: Any
) -> PrescribedFlesh:
    J, D, _ = system.pushed()
    Y = factor.solve(np.ascontiguousarray(J[:, free].T)) if len(D) else np.zeros((len(free), 0))
    rows = Y, cho_factor(np.diag(1.0 / D) + J[:, free] @ Y) if len(D) else None
    velocity = np.where(prescribed, hold, 0.0)
    velocity[free] = _solve(factor, rows, _remaining(system, velocity)[free])
    return PrescribedFlesh(system, prescribed, hold, velocity, free, factor, rows)


def _remaining(system: FleshSystem, v_plus: Array) -> Array:
    """(nv,) r - B v+."""
    J, D, push = system.pushed()
    return np.asarray(system.impulse + push - system.A @ v_plus - J.T @ (D * (J @ v_plus)))


def _solve(factor: Any, rows: tuple[Array, Any], right: Array) -> Array:
    found = factor.solve(np.ascontiguousarray(right))
    Y, small = rows
    if small is not None:
        found -= Y @ cho_solve(small, Y.T @ right)
    return np.asarray(found)


def symmetric_factor(matrix: csc_array) -> Any:
    """SuperLU of a symmetric positive definite matrix, in an order that keeps it sparse.

    The symmetric order holds only while every pivot is taken from the diagonal.
    """
    return splu(
        matrix, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True}
    )
