"""Bones and flesh as one sparse linear system A (v+ - v) = dt b.

MuJoCo assembles bones, joints and tendons; `elasticity` assembles the flesh. The stiffness is the
positive semidefinite part of the derivative of the elastic forces: the softening by compression is
left out, so that A stays positive definite.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from scipy.sparse import csc_array, csr_array, diags_array

from flowborne.kernels.arrays import Array, Indices, Mask
from flowborne.solids.constraints import rows_of
from flowborne.solids.dynamics import System, centred
from flowborne.solids.model import SolidModel, SolidState
from flowborne.solids.momentum import Halfway, tendon_jacobian
from flowborne.solids.scratch import Scratch, scratch


@dataclass(frozen=True)
class FleshSystem(System):
    """The system of bones and flesh; A and impulse do not contain the constraint rows.

    A is sparse and stays the same while the zones of the rows change.

    model    the model
    elastic  (nv, nv) sparse, the part dt^2/2 K of A from the flesh
    """

    A: csr_array
    model: SolidModel
    elastic: csr_array

    def acting(self) -> tuple[Array, Array, Array]:
        """J (k, nv) and D (k,) of the active rows, and the impulse (nv,) of all rows at rest.

        The equations are (A + J^T D J) v+ = impulse + that impulse.
        """
        if self.rows is None:
            return np.zeros((0, len(self.v))), np.zeros(0), np.zeros(len(self.v))
        J, D, force = self.rows.acting(self.zones)
        return J, D, J.T @ (D * (J @ self.v)) + self.dt * force

    def updated(self, v_plus: Array) -> FleshSystem | None:
        zones, (own, same) = self.zones_at(v_plus), self.own_at(v_plus)
        if same and np.array_equal(zones, self.zones):
            return None
        return replace(self, zones=zones, own=own, impulse=self.impulse + own - self.own)

    def pushed(self, force: Array) -> FleshSystem:
        return replace(self, impulse=self.impulse + self.dt * force)


def assemble_flesh(
    model: SolidModel,
    state: SolidState,
    applied: Array,
    dt: float,
    before: SolidState | None = None,
    exact: Mask | None = None,
    added: csr_array | None = None,
) -> FleshSystem:
    """System of bones and flesh at `state`, with gravity, springs, dampers, limits and contact.

        A = M + dt/2 D + dt^2/4 K      b = f

    As in `assemble`, with the K and D of flesh added, but with dt^2/2 K in place of dt^2/4 K. No
    factor from 1/4 on loses energy; 1/2 keeps steps stable while flesh becomes up to twice as stiff
    as at the start of the step. With 1/4 the swimmer's legs tore in the eighth frame.

    applied  (nv,) generalised force, N or N m
    dt       s
    before, exact  as in `assemble`
    added    as in `assemble`; only entries between dofs of the pattern
    """
    s = scratch(model)
    s.set_time_step(dt)
    s.stiffen(state.v, exact)
    s.smooth_forces(state.q, state.v, applied)
    assert model.flesh is not None
    pattern, damping = model.flesh.pattern, model.flesh.damping
    M, (stiff, elastic) = sparse_mass(model, s), _flesh(model, s)
    whole, half = _jointed(model, s, centred, dt), 0.5 * dt**2 * stiff
    whole[pattern.of_mass] += M.data
    if added is not None:
        entries = added.tocoo()
        whole[pattern.places(*entries.coords)] += entries.data
    whole += half
    whole += 0.5 * dt * damping * stiff
    A, K = pattern.filled(whole), pattern.filled(stiff)
    force = s.smooth + elastic - damping * (K @ state.v)
    v = state.v.copy()
    still = A @ v
    centre, own = None, still + dt * force
    if before is not None:
        centre = Halfway(model, s, before, state, dt, still, M, force + s.bias)
        own, _ = centre.impulse(v)
    # `Halfway` has changed the pose in `s`, and rows need the whole forward pass at `state`
    rows, zones = None, np.zeros(0, np.int64)
    if s.data.nefc:
        s.forward(state.q, state.v, applied)
        rows, zones = rows_of(model, s)
    return FleshSystem(A, own, dt, v, rows, zones, centre, own, model, pattern.filled(half))


def static_forces(model: SolidModel, q: Array, applied: Array) -> tuple[csc_array, Array]:
    """Stiffness K (nv, nv), N/m or N m, and forces (nv,) at rest at q (nq,), without rows."""
    s = scratch(model)
    s.smooth_forces(q, np.zeros(model.nv), applied)
    joints = _jointed(model, s, lambda _, stiff, dt: stiff / dt, s.dt)
    stiff, elastic = _flesh(model, s)
    assert model.flesh is not None
    return csc_array(model.flesh.pattern.filled(joints + stiff)), s.smooth + elastic


def _flesh(model: SolidModel, s: Scratch) -> tuple[Array, Array]:
    """Values of K (nv, nv) and the forces (nv,) of flesh at the pose in `s`."""
    assert model.flesh is not None
    flesh = model.flesh
    nodes, J = flesh.nodes(s), flesh.moving_nodes(s)
    K = flesh.pattern.congruence(flesh.elasticity.stiffness(nodes), J)
    return K, J.T @ flesh.elasticity.forces(nodes).ravel()


def sparse_mass(model: SolidModel, s: Scratch) -> csr_array:
    """(nv, nv) mass matrix at the pose in `s`; call it after `Scratch.smooth_forces`."""
    assert model.flesh is not None
    entry = model.flesh.pattern.mass
    return csr_array((s.data.M[entry.data], entry.indices, entry.indptr), shape=entry.shape)


def _jointed(
    model: SolidModel, s: Scratch, part: Callable[[Array, Array, float], Array], dt: float
) -> Array:
    """Values of `part` of MuJoCo's dt D + dt^2 K and dt K, of joints and tendons."""
    assert model.flesh is not None
    data, pattern, active = s.data, model.flesh.pattern, slice(s.data.nefmT)
    values = np.zeros(pattern.matrix.nnz)
    if data.nefmT:
        strength = part(data.efm_ts[active], data.efm_tk[active], dt)
        tendons = _tendons(s, strength, data.efm_tid[active]).tocoo()
        values[pattern.places(*tendons.coords)] = tendons.data
    values[pattern.diagonal] += part(data.efm_diag, data.efm_ck, dt)
    return values


def _tendons(s: Scratch, strength: Array, active: Indices) -> csr_array:
    """Sum of strength J^T J over the active tendons."""
    J = tendon_jacobian(s)[active]
    return csr_array(J.T @ diags_array(strength) @ J)
