"""Bones and flesh as one sparse linear system A (v+ - v) = dt b, assembled by MuJoCo.

MuJoCo's arrays after its stages up to the smooth forces, with K and D the stiffness and damping of
joints, tendons and flesh, and c the flesh's damping time:

    efm_K = dt (dt + c) K of flesh
    efm_diag = dt D + dt^2 K of joints
    efm_c = -dt K v of all

K of flesh is the derivative of its forces where it is stretched. Where it is compressed it leaves
out the stiffness that compression takes away, and A stays positive definite.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csc_array, csr_array, dia_array

from flowborne.solids.dynamics import AT_REST, SETTLED, Rows, Zones, rows_of
from flowborne.solids.halfway import Halfway, halfway
from flowborne.solids.model import SolidModel
from flowborne.solids.scratch import Scratch, scratch
from flowborne.solids.state import SolidState

Array = NDArray[np.float64]


@dataclass(frozen=True)
class FleshSystem:
    """A v+ = impulse, for bones and flesh; constraint rows apart, so that A stays as it is.

    A        (nv, nv) sparse, symmetric positive definite, without the rows
    impulse  (nv,) A v + dt b, without the rows
    dt       s
    v        (nv,) velocity before the step
    rows     constraint rows, and zones (k,), the state of each
    halfway  the forces half-way through the step, and own (nv,), the impulse that they give here
    """

    A: csc_array
    impulse: Array
    dt: float
    v: Array
    rows: Rows | None
    zones: Zones
    halfway: Halfway | None
    own: Array

    @property
    def contacts(self) -> int:
        """Number of contacts with an active row."""
        return 0 if self.rows is None else self.rows.pushing(self.zones)

    def acting(self) -> tuple[Array, Array, Array]:
        """J (k, nv) and D (k,) of the active rows, and the impulse (nv,) of all rows at rest:
        (A + J^T D J) v+ = impulse + it."""
        if self.rows is None:
            return np.zeros((0, len(self.v))), np.zeros(0), np.zeros(len(self.v))
        J, D, force = self.rows.acting(self.zones)
        return J, D, J.T @ (D * (J @ self.v)) + self.dt * force

    def updated(self, v_plus: Array) -> FleshSystem | None:
        """System with the contacts, limits and Coriolis forces that `v_plus` (nv,) implies.

        None when it has them. The repeated solve is Newton's method on a piecewise quadratic
        function, and a fixed point for the forces of Coriolis; the caller bounds the number of
        turns.
        """
        zones, own, settled = self.zones, self.own, True
        if self.rows is not None:
            zones = self.rows.zones((v_plus - self.v) / self.dt, self.zones)
            settled = np.array_equal(zones, self.zones)
        if self.halfway is not None:
            own, rounding = self.halfway.impulse(v_plus)
            room = SETTLED * (abs(self.A) @ (np.abs(v_plus) + AT_REST)) + rounding
            settled = settled and bool((np.abs(own - self.own) <= room).all())
        if settled:
            return None
        return replace(self, zones=zones, own=own, impulse=self.impulse + own - self.own)

    def pushed(self, force: Array) -> FleshSystem:
        """System with an additional generalised force (nv,)."""
        return replace(self, impulse=self.impulse + self.dt * force)


def assemble_flesh(
    model: SolidModel,
    state: SolidState,
    applied: Array,
    dt: float,
    centred: bool = False,
    before: SolidState | None = None,
) -> FleshSystem:
    """System of bones and flesh at `state`, with gravity, springs, dampers, limits and contact.

        A = M + dt D + dt^2 K      b = f - dt K v                 forces of the end of the step
        A = M + dt/2 D + dt^2/4 K  b = f                          centred

    The first is MuJoCo's (integrator "discrete"): first order, an oscillation of frequency omega
    loses omega dt / 2 of its amplitude in each radian. Centred is Newmark's average acceleration
    for positions that move by dt v before v changes: second order, without loss. Large swings need
    a little damping in the tissue then, or its fast modes grow. Rows are those of the first in
    both.

    applied  (nv,) generalised force, N or N m
    dt       s
    before   state before the positions moved; as in `assemble`
    """
    s = scratch(model)
    s.set_time_step(dt)
    s.smooth_forces(state.q, state.v, applied)
    K, D = _stiffness(s, dt), _damping(s, dt)
    M = sparse_mass(model, s)
    force = s.smooth.copy()
    if centred:
        A = M + 0.25 * dt**2 * K + 0.5 * dt * D
    else:
        A = M + dt**2 * K + dt * D
        force += s.data.efm_c
    v = state.v.copy()
    still = A @ v
    centre, own = None, still + dt * force
    if before is not None:
        centre = halfway(model, s, before, state, dt, still, M, force + s.bias)
        own, _ = centre.impulse(v)
    # the half-way pose has overwritten MuJoCo's, and rows need its whole forward pass
    rows, zones = None, np.zeros(0, np.int64)
    if s.data.nefc:
        s.forward(state.q, state.v, applied)
        rows, zones = rows_of(model, s)
    return FleshSystem(csc_array(A), own, dt, v, rows, zones, centre, own)


def static_forces(model: SolidModel, q: Array, applied: Array) -> tuple[csc_array, Array]:
    """Stiffness K (nv, nv), N/m or N m, and the forces (nv,) at rest at q (nq,), without rows."""
    s = scratch(model)
    s.smooth_forces(q, np.zeros(model.nv), applied)
    return csc_array(_stiffness(s, s.dt)), s.smooth.copy()


def sparse_mass(model: SolidModel, s: Scratch) -> csr_array:
    """(nv, nv) mass matrix at the present pose, after the forces."""
    mj, nv = s.mj, model.nv
    lower = csr_array((s.data.M.copy(), mj.M_colind, _starts(mj.M_rownnz)), shape=(nv, nv))
    return csr_array(lower + lower.T - dia_array((lower.diagonal(), 0), shape=(nv, nv)))


def _stiffness(s: Scratch, dt: float) -> csr_array:
    """K of flesh, joints and tendons."""
    data, joints = s.data, s.data.efm_ck / dt
    K = _flesh_stiffness(s) / (dt * (dt + _damping_time(s)))
    return K + _diagonal(joints) + _tendons(s, s.data.efm_tk / dt, data.efm_tid[: data.nefmT])


def _damping(s: Scratch, dt: float) -> csr_array:
    """D of flesh, joints and tendons."""
    data, c = s.data, _damping_time(s)
    D = _flesh_stiffness(s) * (c / (dt * (dt + c)))
    tendons = _tendons(s, data.efm_ts / dt - data.efm_tk, data.efm_tid[: data.nefmT])
    return D + _diagonal(data.efm_diag / dt - data.efm_ck) + tendons


def _flesh_stiffness(s: Scratch) -> csr_array:
    """efm_K, which is stored without gaps between rows."""
    data, nv = s.data, s.mj.nv
    if data.nefmK == 0:
        return csr_array((nv, nv))
    entries = (data.efm_K_val.copy(), data.efm_K_colind.copy(), _starts(data.efm_K_rownnz))
    return csr_array(entries, shape=(nv, nv))


def _tendons(s: Scratch, strength: Array, active: NDArray[np.int32]) -> csr_array:
    """Sum of strength J^T J over tendons."""
    mj, data = s.mj, s.data
    if active.size == 0:
        return csr_array((mj.nv, mj.nv))
    J = csr_array(
        (data.ten_J.copy(), mj.ten_J_colind, _starts(mj.ten_J_rownnz)), (mj.ntendon, mj.nv)
    )
    chosen = J[active]
    return csr_array(chosen.T @ _diagonal(strength[active]) @ chosen)


def _damping_time(s: Scratch) -> float:
    return float(s.mj.flex_damping[0]) if s.mj.nflex else 0.0


def _diagonal(values: Array) -> dia_array:
    return dia_array((values, 0), shape=(len(values), len(values)))


def _starts(counts: NDArray[np.int32]) -> NDArray[np.int64]:
    return np.concatenate([[0], np.cumsum(counts, dtype=np.int64)])
