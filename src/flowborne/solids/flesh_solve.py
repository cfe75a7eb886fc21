"""One sparse factorisation of bones and flesh a step, with prescribed dofs projected out.

As solids.prescribed does with dense matrices:

    v+_P = hold        v+_F = A_FF^-1 (r_F + impulse_F - A_FP hold)
    tau dt = A v+ - r - impulse      on P
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csc_array
from scipy.sparse.linalg import splu

from flowborne.solids.flesh_dynamics import FleshSystem

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]


@dataclass(frozen=True)
class PrescribedFlesh:
    """The answer of bones and flesh to impulses when some dofs are prescribed.

    system      the system it was made from
    prescribed  (nv,) dofs that end the step with a given velocity
    free        (nf,) the other dofs
    velocity    (nv,) v*, velocity after the step when there is no impulse
    factor      of A_FF
    """

    system: FleshSystem
    prescribed: Mask
    free: NDArray[np.int64]
    velocity: Array
    factor: Any

    def answer(self, impulse: Array) -> Array:
        """A_FF^-1 of generalised impulses (nv,) or (nv, k), zero on prescribed dofs."""
        change = np.zeros_like(impulse)
        change[self.free] = self.factor.solve(np.ascontiguousarray(impulse[self.free]))
        return change

    def after(self, impulse: Array) -> Array:
        """(nv,) velocity after the step with a generalised impulse (nv,), the fluid's for one."""
        return self.velocity + self.answer(impulse)

    def actuator(self, v_plus: Array, impulse: Array) -> Array:
        """(nv,) generalised force that the drives supplied; zero on dofs without a drive."""
        s = self.system
        needed = (s.A @ v_plus - s.impulse - impulse) / s.dt
        return np.where(self.prescribed, needed, 0.0)


def prescribe_flesh(system: FleshSystem, prescribed: Mask, hold: Array) -> PrescribedFlesh:
    """Prescribe dofs (nv,) to end the step with velocities `hold` (nv,), exactly."""
    free = np.flatnonzero(~prescribed)
    factor = symmetric_factor(csc_array(system.A[free][:, free]))
    velocity = np.where(prescribed, hold, 0.0)
    velocity[free] = factor.solve((system.impulse - system.A @ velocity)[free])
    return PrescribedFlesh(system, prescribed.copy(), free, velocity, factor)


def symmetric_factor(matrix: csc_array) -> Any:
    """SuperLU of a symmetric positive definite matrix, in an order that keeps it sparse.

    The symmetric order holds only while every pivot is taken from the diagonal.
    """
    return splu(
        matrix, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True}
    )
