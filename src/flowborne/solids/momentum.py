"""Momentum and energy of the bodies, and Coriolis forces at the half-way velocity of a step."""

from __future__ import annotations

from copy import copy

import mujoco
import numpy as np
from scipy.sparse import csr_array, diags_array

from flowborne.kernels.arrays import Array
from flowborne.kernels.momentum import about_origin, momentum_impulse
from flowborne.solids.model import SolidModel, SolidState
from flowborne.solids.scratch import Scratch, posed, scratch, twists_about_origin

Terms = tuple[Array, Array, Array]
"""What the forces half-way to a velocity are made of; see `kernels.momentum`."""

MOST_MOMENTA = 4
"""Half-way momenta of a model that a thread caches."""


def weight(model: SolidModel, s: Scratch) -> Array:
    """(bodies, 6) force of gravity on the subtree of each body, and its torque about the world
    origin; nodes of flesh count as bodies."""
    force = model.subtree_mass[:, None] * model.gravity
    return about_origin(force, np.zeros(force.shape), s.subtree_com)


def subtree_momentum(model: SolidModel, s: Scratch, state: SolidState) -> Array:
    """(bodies, 6) momentum of the subtree of each body, linear and about the world origin; nodes
    of flesh count as bodies."""
    s.place(state.q, state.v)
    mujoco.mj_subtreeVel(s.mj, s.data)
    linear = model.subtree_mass[:, None] * s.subtree_linvel
    return about_origin(linear, s.subtree_angmom, s.subtree_com)


def subtree_halfway_momentum(model: SolidModel, s: Scratch, state: SolidState, dt: float) -> Array:
    """As `subtree_momentum`, after the positions have moved for half a step. Read only.

    The last few are cached: all trials of a decision start from one state, and the report of a step
    needs the same momenta as its solve.
    """
    key = state.q.tobytes(), state.v.tobytes(), dt
    known = s.momenta.get(key)
    if known is None:
        q = model.integrate(state.q, state.v, 0.5 * dt)
        known = subtree_momentum(model, s, SolidState(q, state.v))
        known.setflags(write=False)
        if len(s.momenta) >= MOST_MOMENTA:
            s.momenta.pop(next(iter(s.momenta)))
    else:
        del s.momenta[key]
    s.momenta[key] = known  # least recently used first
    return known


def momentum(model: SolidModel, state: SolidState) -> Array:
    """(2, 3) linear momentum (N s) and angular momentum about the world origin (N m s)."""
    return subtree_momentum(model, scratch(model), state)[0].reshape(2, 3)


def halfway_momentum(model: SolidModel, state: SolidState, dt: float) -> Array:
    """(2, 3) momentum of the pose half a step after `state` at the state's velocity.

    The time scheme moves positions by dt v and then changes v, as leapfrog does: v belongs to the
    middle of the next step, and a free creature conserves this momentum to rounding. `momentum`
    oscillates about it by O(dt).
    """
    return subtree_halfway_momentum(model, scratch(model), state, dt)[0].reshape(2, 3)


def mass_matrix(model: SolidModel, q: Array) -> Array:
    """(nv, nv) joint space mass matrix, armature included."""
    s = posed(model, q)
    mujoco.mj_tendon(s.mj, s.data)  # tendons may have armature
    mujoco.mj_makeM(s.mj, s.data)
    return s.mass_matrix().copy()


def mass_times(model: SolidModel, q: Array, velocities: Array) -> Array:
    """(k, nv) the mass matrix at q (nq,), without storing it, times each velocity (k, nv)."""
    s = posed(model, q)
    mujoco.mj_tendon(s.mj, s.data)  # tendons may have armature
    mujoco.mj_makeM(s.mj, s.data)
    result = np.empty(velocities.shape)
    for row, velocity in zip(result, velocities, strict=True):
        mujoco.mj_mulM(s.mj, s.data, row, velocity)
    return result


def tendon_inertia(s: Scratch) -> csr_array | None:
    """(nv, nv) part of the mass matrix that is the armature of tendons and of actuators on them, at
    the pose in `s`; None without any. Call it after MuJoCo's forward pass."""
    mj = s.mj
    armature = np.array(mj.tendon_armature)
    for actuator in np.flatnonzero(mj.actuator_armature):
        if mj.actuator_trntype[actuator] == mujoco.mjtTrn.mjTRN_TENDON:
            gear = float(mj.actuator_gear[actuator, 0])
            armature[mj.actuator_trnid[actuator, 0]] += gear**2 * mj.actuator_armature[actuator]
    if not armature.any():
        return None
    J = tendon_jacobian(s)
    return csr_array(J.T @ diags_array(armature) @ J)


def tendon_jacobian(s: Scratch) -> csr_array:
    """(tendons, nv) derivative of the tendons' lengths by the dofs, at the pose in `s`."""
    mj = s.mj
    start = np.concatenate([[0], np.cumsum(mj.ten_J_rownnz, dtype=np.int64)])
    return csr_array((s.data.ten_J.copy(), mj.ten_J_colind, start), (mj.ntendon, mj.nv))


def kinetic_energy(model: SolidModel, state: SolidState) -> float:
    """Kinetic energy, J; joint armature included."""
    return float(0.5 * state.v @ mass_times(model, state.q, state.v[None])[0])


def potential_energy(model: SolidModel, state: SolidState) -> float:
    """Energy in gravity and in springs of joints and tendons, J."""
    s = posed(model, state.q)
    mujoco.mj_tendon(s.mj, s.data)
    mujoco.mj_energyPos(s.mj, s.data)
    return float(s.data.energy[0])


class Halfway:
    """Coriolis and centrifugal forces at the half-way velocity of a step.

    Positions move by dt v before v changes, as in leapfrog, so velocity-dependent forces are second
    order in time, and do no work, only at (v + v+)/2. Along dofs that carry a whole tree, the
    equation of motion is written as the change of momentum itself, which then holds to rounding.
    """

    def __init__(
        self,
        model: SolidModel,
        s: Scratch,
        before: SolidState,
        state: SolidState,
        dt: float,
        still: Array,
        mass: Array | csr_array,
        outer: Array,
    ) -> None:
        """Call it after MuJoCo's forward pass at `state`.

        before  state at the start of the motion
        state   at its end, with the velocity before the step
        dt      s
        still   (nv,) A v: impulse that keeps the velocity, A without constraint rows
        mass    (nv, nv) mass matrix, dense or sparse
        outer   (nv,) generalised forces other than gravity and Coriolis forces
        """
        self._model, self._state, self._dt = model, state.copy(), dt
        self._still, self._mass, self._outer = still, mass, outer
        self._tendons = tendon_inertia(s)
        self._twist = twists_about_origin(s.cdof, s.dof_centre())
        fall = dt * weight(model, s)
        self._given = subtree_halfway_momentum(model, s, before, dt) + fall
        self._last: tuple[bytes, Terms, tuple[Array, Array]] | None = None

    def impulse(self, v_plus: Array) -> tuple[Array, Array]:
        """(nv,) r of A v+ = r with the forces half-way to `v_plus` (nv,), and (nv,) a bound of its
        rounding errors. The last result is cached; do not write to it."""
        key = v_plus.tobytes()
        if self._last is None or self._last[0] != key:
            terms = self._terms(v_plus)
            self._last = key, terms, self._sum(terms)
        return self._last[2]

    def under(self, outer: Array) -> Halfway:
        """The same under other forces (nv,) than gravity and Coriolis forces."""
        other = copy(self)
        other._outer = outer
        if self._last is not None:
            key, terms, _ = self._last
            other._last = key, terms, other._sum(terms)
        return other

    def _terms(self, v_plus: Array) -> Terms:
        model, dt, q, v = self._model, self._dt, self._state.q, self._state.v
        s = scratch(model)
        later = subtree_halfway_momentum(model, s, SolidState(q, v_plus), dt)
        s.place(q, 0.5 * (v + v_plus))
        bias = np.empty(model.nv)
        mujoco.mj_rne(s.mj, s.data, 0, bias)
        gained = self._mass @ (v_plus - v) - model.armature * (v_plus - v)
        if self._tendons is not None:
            gained -= self._tendons @ (v_plus - v)
        return later, gained, bias

    def _sum(self, terms: Terms) -> tuple[Array, Array]:
        model, (later, gained, bias) = self._model, terms
        momenta, own = (self._given, later, model.dof_body), (gained, self._still, bias)
        return momentum_impulse(self._twist, momenta, model.conserved, *own, self._outer, self._dt)
