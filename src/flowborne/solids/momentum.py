"""Momentum and energy of the bodies, and Coriolis forces at the half-way velocity of a step."""

from __future__ import annotations

from dataclasses import dataclass, field

import mujoco
import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array

from flowborne.kernels.momentum import about_origin, momentum_impulse
from flowborne.solids.model import SolidModel
from flowborne.solids.scratch import Scratch, scratch
from flowborne.solids.state import SolidState

Array = NDArray[np.float64]

KEPT = 4
"""Half-way momenta that a thread remembers of a model."""


def weight(model: SolidModel, s: Scratch) -> Array:
    """(bodies, 6) force of gravity on each body's subtree and its torque about the world origin;
    points of flesh count as bodies."""
    force = model.subtree_mass[:, None] * model.gravity
    return about_origin(force, np.zeros(force.shape), s.subtree_com)


def subtree_momentum(model: SolidModel, s: Scratch, state: SolidState) -> Array:
    """(bodies, 6) momentum of each body's subtree, linear and about the world origin; points of
    flesh count as bodies."""
    s.place(state.q, state.v)
    mujoco.mj_subtreeVel(s.mj, s.data)
    linear = model.subtree_mass[:, None] * s.subtree_linvel
    return about_origin(linear, s.subtree_angmom, s.subtree_com)


def subtree_halfway_momentum(model: SolidModel, s: Scratch, state: SolidState, dt: float) -> Array:
    """As `subtree_momentum`, when the positions have moved on for half a step. Read only.

    The last few are remembered: all trials of a decision start from one state, and a step's report
    asks for what its solve has found.
    """
    key = state.q.tobytes(), state.v.tobytes(), dt
    known = s.momenta.get(key)
    if known is None:
        q = model.integrate(state.q, state.v, 0.5 * dt)
        known = subtree_momentum(model, s, SolidState(q, state.v))
        known.setflags(write=False)
        if len(s.momenta) >= KEPT:
            s.momenta.pop(next(iter(s.momenta)))
    else:
        del s.momenta[key]
    s.momenta[key] = known  # the last one used goes last, the first one is dropped first
    return known


def momentum(model: SolidModel, state: SolidState) -> Array:
    """(2, 3) linear momentum (N s) and angular momentum about the world origin (N m s)."""
    return subtree_momentum(model, scratch(model), state)[0].reshape(2, 3)


def halfway_momentum(model: SolidModel, state: SolidState, dt: float) -> Array:
    """(2, 3) momentum of the pose half a step after `state` at the state's velocity.

    The time scheme moves positions by dt v and then changes v, as leapfrog does: v belongs to the
    middle of the next step, and this is the momentum that a free creature keeps to rounding.
    `momentum` wavers about it by O(dt).
    """
    return subtree_halfway_momentum(model, scratch(model), state, dt)[0].reshape(2, 3)


def mass_matrix(model: SolidModel, q: Array) -> Array:
    """(nv, nv) joint space mass matrix, armature included."""
    s = scratch(model)
    s.place(q)
    mujoco.mj_makeM(s.mj, s.data)
    return s.mass_matrix().copy()


def kinetic_energy(model: SolidModel, state: SolidState) -> float:
    """Kinetic energy, J; joint armature included."""
    s, impulse = scratch(model), np.empty(model.nv)
    s.place(state.q)
    mujoco.mj_makeM(s.mj, s.data)
    mujoco.mj_mulM(s.mj, s.data, impulse, state.v)
    return float(0.5 * state.v @ impulse)


def potential_energy(model: SolidModel, state: SolidState) -> float:
    """Energy in gravity and in springs of joints and tendons, J."""
    s = scratch(model)
    s.place(state.q)
    mujoco.mj_tendon(s.mj, s.data)
    mujoco.mj_energyPos(s.mj, s.data)
    return float(s.data.energy[0])


@dataclass(frozen=True)
class Halfway:
    """What the half-way impulse of one step is made from.

    state  at the end of the motion, with the velocity before the step
    dt     s
    outer  (nv,) generalised forces other than gravity and those of Coriolis
    still  (nv,) A v: impulse that keeps the velocity, A without constraint rows
    mass   (nv, nv) mass matrix, dense or sparse
    given  (bodies, 6) momentum of each body's subtree when the positions were half-way, and what
           gravity adds to it during the step
    cdof   (nv, 6) angular velocity that unit velocity of each dof gives what it moves, and velocity
           of the point at its centre
    centre (nv, 3) m
    """

    model: SolidModel
    state: SolidState
    dt: float
    outer: Array
    still: Array
    mass: Array | csr_array
    given: Array
    cdof: Array
    centre: Array
    _found: dict[bytes, tuple[Array, Array]] = field(default_factory=dict, repr=False)

    def impulse(self, v_plus: Array) -> tuple[Array, Array]:
        """(nv,) r of A v+ = r with the forces half-way to `v_plus` (nv,), and (nv,) how much of it
        may be rounding errors; the last answer is kept, and is not to be written to."""
        key = v_plus.tobytes()
        if key not in self._found:
            self._found.clear()
            self._found[key] = self._impulse(v_plus)
        return self._found[key]

    def _impulse(self, v_plus: Array) -> tuple[Array, Array]:
        model, dt, v = self.model, self.dt, self.state.v
        s = scratch(model)
        later = subtree_halfway_momentum(model, s, SolidState(self.state.q, v_plus), dt)
        s.place(self.state.q, 0.5 * (v + v_plus))
        bias = np.empty(model.nv)
        mujoco.mj_rne(s.mj, s.data, 0, bias)
        gained = self.mass @ (v_plus - v) - model.armature * (v_plus - v)
        return momentum_impulse(
            self.cdof,
            self.centre,
            self.given,
            later,
            model.dof_body,
            model.conserved,
            gained,
            self.still,
            bias,
            self.outer,
            dt,
        )


def halfway(
    model: SolidModel,
    s: Scratch,
    before: SolidState,
    state: SolidState,
    dt: float,
    still: Array,
    mass: Array | csr_array,
    outer: Array,
) -> Halfway:
    """The forces of a step from `before`, after MuJoCo's forward pass at `state`; the rest as in
    `Halfway`."""
    cdof, centre, fall = s.cdof.copy(), s.subtree_com[model.dof_root], dt * weight(model, s)
    given = subtree_halfway_momentum(model, s, before, dt) + fall
    return Halfway(model, state.copy(), dt, outer, still, mass, given, cdof, centre)
