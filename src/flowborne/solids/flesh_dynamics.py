"""Bones and flesh as one sparse linear system A (v+ - v) = dt b.

MuJoCo assembles bones, joints and tendons, `elasticity` the flesh. Its stiffness is the derivative
of its forces where that is positive; what compression takes away is left out, and A stays positive
definite.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csc_array, csr_array, dia_array

from flowborne.solids.dynamics import AT_REST, SETTLED, Rows, Zones, centred, rows_of
from flowborne.solids.model import SolidModel
from flowborne.solids.momentum import Halfway, halfway
from flowborne.solids.scratch import Scratch, scratch
from flowborne.solids.state import SolidState

Array = NDArray[np.float64]


@dataclass(frozen=True)
class FleshSystem:
    """A v+ = impulse, for bones and flesh; constraint rows apart, so that A stays as it is.

    model    what it is of
    A        (nv, nv) sparse, symmetric positive definite, without the rows
    elastic  (nv, nv) sparse, the part dt^2/2 K of A that is the flesh's
    impulse  (nv,) A v + dt b, without the rows
    dt       s
    v        (nv,) velocity before the step
    rows     constraint rows, and zones (k,), the state of each
    halfway  the forces half-way through the step, and own (nv,), the impulse that they give here
    """

    model: SolidModel
    A: csr_array
    elastic: csr_array
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
    before: SolidState | None = None,
) -> FleshSystem:
    """System of bones and flesh at `state`, with gravity, springs, dampers, limits and contact.

        A = M + dt/2 D + dt^2/4 K      b = f

    As in `assemble`, with the K and D of flesh besides, whose part is dt^2/2 K: no energy is lost
    with any part from a quarter on, and twice as much keeps steps stable while flesh is up to twice
    as stiff as at their start. With a quarter the swimmer's legs tore in the eighth frame.

    applied  (nv,) generalised force, N or N m
    dt       s
    before   state before the positions moved; as in `assemble`
    """
    s = scratch(model)
    s.set_time_step(dt)
    s.smooth_forces(state.q, state.v, applied)
    M = sparse_mass(model, s)
    A = M + _jointed(s, centred, dt)
    K, elastic = _flesh(model, s)
    assert model.flesh is not None
    damping = model.flesh.damping
    half = 0.5 * dt**2 * K
    A = A + half + 0.5 * dt * damping * K
    force = s.smooth + elastic - damping * (K @ state.v)
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
    return FleshSystem(model, csr_array(A), csr_array(half), own, dt, v, rows, zones, centre, own)


def static_forces(model: SolidModel, q: Array, applied: Array) -> tuple[csc_array, Array]:
    """Stiffness K (nv, nv), N/m or N m, and the forces (nv,) at rest at q (nq,), without rows."""
    s = scratch(model)
    s.smooth_forces(q, np.zeros(model.nv), applied)
    joints = _jointed(s, lambda _, stiff, dt: stiff / dt, s.dt)
    K, elastic = _flesh(model, s)
    return csc_array(joints + K), s.smooth + elastic


def _flesh(model: SolidModel, s: Scratch) -> tuple[csr_array, Array]:
    """K (nv, nv) and the forces (nv,) of flesh, where `s` has been placed."""
    assert model.flesh is not None
    places, J = model.flesh.nodes(s), model.flesh.moving_nodes(s)
    elasticity = model.flesh.elasticity
    K = J.T @ (elasticity.stiffness(places) @ J)
    return csr_array(K), J.T @ elasticity.forces(places).ravel()


def sparse_mass(model: SolidModel, s: Scratch) -> csr_array:
    """(nv, nv) mass matrix at the present pose, after the forces."""
    mj, nv = s.mj, model.nv
    lower = csr_array((s.data.M.copy(), mj.M_colind, _starts(mj.M_rownnz)), shape=(nv, nv))
    return csr_array(lower + lower.T - dia_array((lower.diagonal(), 0), shape=(nv, nv)))


def _jointed(s: Scratch, part: Callable[[Array, Array, float], Array], dt: float) -> csr_array:
    """What `part` makes of MuJoCo's dt D + dt^2 K and dt K of joints and tendons."""
    data = s.data
    active = slice(data.nefmT)
    strength = part(data.efm_ts[active], data.efm_tk[active], dt)
    tendons = _tendons(s, strength, data.efm_tid[active])
    return csr_array(tendons + _diagonal(part(data.efm_diag, data.efm_ck, dt)))


def _tendons(s: Scratch, strength: Array, active: NDArray[np.int32]) -> csr_array:
    """Sum of strength J^T J over active tendons; `strength` is theirs alone."""
    mj, data = s.mj, s.data
    if active.size == 0:
        return csr_array((mj.nv, mj.nv))
    J = csr_array(
        (data.ten_J.copy(), mj.ten_J_colind, _starts(mj.ten_J_rownnz)), (mj.ntendon, mj.nv)
    )
    chosen = J[active]
    return csr_array(chosen.T @ _diagonal(strength) @ chosen)


def _diagonal(values: Array) -> dia_array:
    return dia_array((values, 0), shape=(len(values), len(values)))


def _starts(counts: NDArray[np.int32]) -> NDArray[np.int64]:
    return np.concatenate([[0], np.cumsum(counts, dtype=np.int64)])
