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

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csc_array, csr_array, dia_array

from flowborne.solids.model import SolidModel
from flowborne.solids.scratch import Scratch, scratch
from flowborne.solids.state import SolidState

Array = NDArray[np.float64]


@dataclass(frozen=True)
class FleshSystem:
    """A v+ = impulse, for bones and flesh without contact.

    A        (nv, nv) sparse, symmetric positive definite
    impulse  (nv,) A v + dt b
    dt       s
    v        (nv,) velocity before the step
    """

    A: csc_array
    impulse: Array
    dt: float
    v: Array


def assemble_flesh(
    model: SolidModel, state: SolidState, applied: Array, dt: float, centred: bool = False
) -> FleshSystem:
    """System of bones and flesh at `state`, with gravity, springs and dampers.

        A = M + dt D + dt^2 K      b = f - dt K v                 forces of the end of the step
        A = M + dt/2 D + dt^2/4 K  b = f                          centred

    The first is MuJoCo's (integrator "discrete"): first order, an oscillation of frequency omega
    loses omega dt / 2 of its amplitude in each radian. Centred is Newmark's average acceleration
    for positions that move by dt v before v changes: second order, without loss.

    applied  (nv,) generalised force, N or N m
    dt       s
    raises   ValueError when a contact, a joint limit or an equality has rows
    """
    s = scratch(model)
    s.set_time_step(dt)
    s.smooth_forces(state.q, state.v, applied)
    _refuse_rows(s)
    K, D = _stiffness(s, dt), _damping(s, dt)
    M = sparse_mass(model, s)
    force = s.smooth.copy()
    if centred:
        A = M + 0.25 * dt**2 * K + 0.5 * dt * D
    else:
        A = M + dt**2 * K + dt * D
        force += s.data.efm_c
    v = state.v.copy()
    return FleshSystem(csc_array(A), A @ v + dt * force, dt, v)


def static_forces(model: SolidModel, q: Array, applied: Array) -> tuple[csc_array, Array]:
    """Stiffness K (nv, nv) without mass, N/m or N m, and the forces (nv,) at rest at q (nq,)."""
    s = scratch(model)
    s.smooth_forces(q, np.zeros(model.nv), applied)
    _refuse_rows(s)
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


def _refuse_rows(s: Scratch) -> None:
    rows = int(s.data.nefc)
    if rows:
        raise ValueError(
            f"bones or flesh meet {rows} constraint row(s) of contacts, joint limits or "
            "equalities, which the system of flesh does not hold yet. Remove limits and contacts."
        )
