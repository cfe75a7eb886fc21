"""Kinematics and the solid's own linear system A (v+ - v) = dt b, assembled by MuJoCo."""

from __future__ import annotations

from dataclasses import dataclass, replace

import mujoco
import numpy as np
from numpy.typing import NDArray

from flowborne.solids.model import SolidModel
from flowborne.solids.scratch import Scratch, scratch
from flowborne.solids.state import SolidState

Array = NDArray[np.float64]
Zones = NDArray[np.int64]

OFF, ACTIVE, PUSHED_UP, PUSHED_DOWN = 0, 1, 2, 3
"""State of a constraint row, numbered as mjtConstraintState: no force, a force linear in the
acceleration, or the whole of the dry friction along or against the row's direction."""

TWO_SIDED, FRICTION, ONE_SIDED = 0, 1, 2
"""Kinds of rows: equalities; dry friction; limits and the edges of contact pyramids."""

KIND_OF_ROW = np.array([TWO_SIDED, FRICTION, FRICTION, *[ONE_SIDED] * 5])
FIRST_CONTACT = int(mujoco.mjtConstraint.mjCNSTR_CONTACT_FRICTIONLESS)

NEAR = 1e-11
"""A row within this share of its reference of a change of zone stays where it is."""


@dataclass(frozen=True)
class Kinematics:
    """Poses of everything, in world axes.

    body_position   (nbody, 3) m
    body_rotation   (nbody, 3, 3) body's frame to the world's
    geom_position   (ngeom, 3) m
    geom_rotation   (ngeom, 3, 3) geometry's frame to the world's
    centroid        (nbody, 3) centroid of the displaced volume, m
    mass_centre     (nbody, 3) centre of mass, m
    twist_jacobian  (nbody, 6, nv) from v to each body's twist: velocity of the point at the world
                    origin, then angular velocity
    """

    body_position: Array
    body_rotation: Array
    geom_position: Array
    geom_rotation: Array
    centroid: Array
    mass_centre: Array
    twist_jacobian: Array


@dataclass(frozen=True)
class Rows:
    """Constraint rows; the row's force on v is J^T D (aref - J a) while active.

    J, D, aref  (k, nv), (k,), (k,) Jacobian, stiffness and reference acceleration
    friction    (k,) largest dry friction
    kind        (k,) TWO_SIDED, FRICTION or ONE_SIDED
    contact     (k,) number of the contact that a row belongs to, -1 for others
    """

    J: Array
    D: Array
    aref: Array
    friction: Array
    kind: NDArray[np.int64]
    contact: NDArray[np.int64]

    def zones(self, acceleration: Array, present: Zones) -> Zones:
        """(k,) state of each row at an acceleration (nv,); a tie keeps the present state."""
        motion = self.J @ acceleration
        slip = motion - self.aref
        margin = NEAR * (1.0 + np.abs(motion) + np.abs(self.aref))
        sliding = self.kind == FRICTION
        edge = np.where(sliding, self.friction / self.D, 0.0)
        inside = np.where(sliding, np.abs(slip) < edge, slip < 0.0) | (self.kind == TWO_SIDED)
        beyond = np.where(slip < 0.0, PUSHED_UP, PUSHED_DOWN)
        zones = np.where(inside, ACTIVE, np.where(sliding, beyond, OFF))
        tie = (np.abs(np.abs(slip) - edge) <= margin) & (self.kind != TWO_SIDED)
        return np.where(tie, present, zones)


@dataclass(frozen=True)
class SolidSystem:
    """A (v+ - v) = dt b, written A v+ = impulse.

    A        (nv, nv) symmetric positive definite
    impulse  (nv,) r = A v + dt b
    dt       s
    v        (nv,) velocity before the step
    smooth   (A, r) without the constraint rows
    rows     constraint rows, and zones (k,), the state of each that A and impulse are made for
    """

    A: Array
    impulse: Array
    dt: float
    v: Array
    smooth: tuple[Array, Array]
    rows: Rows | None
    zones: Zones

    @property
    def contacts(self) -> int:
        """Number of contacts that push."""
        if self.rows is None:
            return 0
        pushing = self.rows.contact[self.zones == ACTIVE]
        return int(np.unique(pushing[pushing >= 0]).size)

    def updated(self, v_plus: Array) -> SolidSystem | None:
        """System with the contacts and limits that `v_plus` (nv,) implies; None when it has them.

        The repeated solve is Newton's method on a piecewise quadratic function. It ends after few
        turns as a rule; the caller bounds their number.
        """
        if self.rows is None:
            return None
        zones = self.rows.zones((v_plus - self.v) / self.dt, self.zones)
        if np.array_equal(zones, self.zones):
            return None
        return self._with(zones, *self.smooth)

    def pushed(self, force: Array) -> SolidSystem:
        """System with an additional generalised force (nv,)."""
        A, impulse = self.smooth
        return self._with(self.zones, A, impulse + self.dt * force)

    def _with(self, zones: Zones, A: Array, impulse: Array) -> SolidSystem:
        full = _with_rows(A, impulse, self.v, self.dt, self.rows, zones)
        return replace(self, A=full[0], impulse=full[1], smooth=(A, impulse), zones=zones)


def kinematics(model: SolidModel, q: Array) -> Kinematics:
    """Poses and Jacobians at positions (nq,)."""
    s = scratch(model)
    s.place(q)
    body_position = s.xpos.copy()
    body_rotation = s.xmat.reshape(-1, 3, 3).copy()
    centroid = body_position + np.matmul(body_rotation, model.centroid[:, :, None])[:, :, 0]
    return Kinematics(
        body_position,
        body_rotation,
        s.geom_xpos[model.geom_id],
        s.geom_xmat[model.geom_id].reshape(-1, 3, 3),
        centroid,
        s.data.xipos.copy(),
        np.where(model.moves[:, None, :], _dof_twists(model, s).T, 0.0),
    )


def _dof_twists(model: SolidModel, s: Scratch) -> Array:
    """(nv, 6) twist about the world origin that unit velocity of each dof gives what it moves."""
    turn, at = s.cdof[:, :3], s.subtree_com[model.dof_root]
    return np.concatenate([s.cdof[:, 3:] + cross(at, turn), turn], axis=1)


def cross(a: Array, b: Array) -> Array:
    """(k, 3) vector products of rows; np.cross takes ten times as long for few rows."""
    product = np.empty((len(b), 3))
    product[:, 0] = a[:, 1] * b[:, 2] - a[:, 2] * b[:, 1]
    product[:, 1] = a[:, 2] * b[:, 0] - a[:, 0] * b[:, 2]
    product[:, 2] = a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
    return product


def assemble(
    model: SolidModel,
    state: SolidState,
    applied: Array,
    dt: float,
    *,
    before: SolidState | None = None,
    bias_velocity: Array | None = None,
) -> SolidSystem:
    """System of the bodies alone at `state`, with gravity, springs, limits and contact.

        A = M + E + Ja^T Da Ja      b = smooth - shift + Ja^T Da aref + dry friction

    E and the shift are the implicit part of springs and dampers of joints and tendons (MuJoCo's
    integrator "discrete"); Ja are the active rows, first those of MuJoCo's own solution under
    `applied`. Without the optional arguments A a = b is solved by MuJoCo's acceleration.

    applied        (nv,) generalised force, N or N m
    dt             s
    bias_velocity  (nv,) velocity of the Coriolis and centrifugal forces; v when None, and the step
                   is first order. With (v + v+)/2, found by repeating the solve, it is second
                   order and its energy does not creep
    before         state before the positions moved. Used with bias_velocity: the rows of
                   model.conserved then say that the momentum half a step on, see
                   `halfway_momentum`, changes by dt (outer force) and nothing else
    """
    s = scratch(model)
    s.set_time_step(dt)
    exchanged = np.zeros(0)
    if before is not None and bias_velocity is not None:
        guess = 2.0 * bias_velocity - state.v
        exchanged = _halfway(model, s, before, dt) - _halfway(
            model, s, SolidState(state.q, guess), dt
        )
    s.forward(state.q, state.v, applied)
    A, force = _smooth(model, s, state.v)
    rows, zones = _rows(model, s)
    outer = force + s.bias
    if bias_velocity is not None:
        s.v[:] = bias_velocity
        mujoco.mj_comVel(s.mj, s.data)
        bias = np.empty(model.nv)
        mujoco.mj_rne(s.mj, s.data, 0, bias)
        force = outer - bias
    impulse = A @ state.v + dt * force
    if exchanged.size:
        kept = _along_dofs(model, s, exchanged + dt * _weight(model, s)) + dt * outer
        kept += s.mass @ guess - model.armature * (guess - state.v) + (A - s.mass) @ state.v
        impulse = np.where(model.conserved, kept, impulse)
    full = _with_rows(A, impulse, state.v, dt, rows, zones)
    return SolidSystem(full[0], full[1], dt, state.v.copy(), (A, impulse), rows, zones)


def _smooth(model: SolidModel, s: Scratch, v: Array) -> tuple[Array, Array]:
    """A and b without constraint rows; after mj_forward."""
    data = s.data
    A, force = s.mass_matrix().copy(), s.smooth.copy()
    if data.efm_active:
        A.flat[:: model.nv + 1] += data.efm_diag
        force -= data.efm_ck * v
        for t in data.efm_tid[: data.nefmT]:
            first, count = s.mj.ten_J_rowadr[t], s.mj.ten_J_rownnz[t]
            row = np.zeros(model.nv)
            row[s.mj.ten_J_colind[first : first + count]] = data.ten_J[first : first + count]
            A += data.efm_ts[t] * np.outer(row, row)
            force -= data.efm_tk[t] * data.ten_velocity[t] * row
    return A, force


def _rows(model: SolidModel, s: Scratch) -> tuple[Rows | None, Zones]:
    data, count = s.data, int(s.data.nefc)
    if count == 0:
        return None, np.zeros(0, np.int64)
    kind = data.efc_type
    rows = Rows(
        np.array(data.efc_J).reshape(count, model.nv),
        np.array(data.efc_D),
        np.array(data.efc_aref),
        np.array(data.efc_frictionloss),
        KIND_OF_ROW[kind],
        np.where(kind >= FIRST_CONTACT, data.efc_id, -1),
    )
    return rows, data.efc_state.astype(np.int64)


def _with_rows(
    A: Array, impulse: Array, v: Array, dt: float, rows: Rows | None, zones: Zones
) -> tuple[Array, Array]:
    """A and impulse with the rows in the given zones."""
    if rows is None:
        return A, impulse
    on = zones == ACTIVE
    J, D = rows.J[on], rows.D[on]
    added = J.T @ (D[:, None] * J)
    push = np.where(zones == PUSHED_UP, 1.0, np.where(zones == PUSHED_DOWN, -1.0, 0.0))
    force = J.T @ (D * rows.aref[on]) + rows.J.T @ (push * rows.friction)
    return A + added, impulse + added @ v + dt * force


def _along_dofs(model: SolidModel, s: Scratch, wrench: Array) -> Array:
    """(nv,) component of the wrench (nbody, 6) of each dof's body along the dof's twist."""
    return np.asarray((_dof_twists(model, s) * wrench[model.dof_body]).sum(axis=1))


def _weight(model: SolidModel, s: Scratch) -> Array:
    """(nbody, 6) force of gravity on each body's subtree and its torque about the world origin."""
    wrench = np.empty((model.nbody, 6))
    wrench[:, :3] = model.subtree_mass[:, None] * model.gravity
    wrench[:, 3:] = cross(s.subtree_com, wrench[:, :3])
    return wrench


def _momentum(model: SolidModel, s: Scratch, state: SolidState) -> Array:
    """(nbody, 6) momentum of each body's subtree, linear and about the world origin."""
    s.place(state.q, state.v)
    mujoco.mj_subtreeVel(s.mj, s.data)
    momentum = np.empty((model.nbody, 6))
    momentum[:, :3] = model.subtree_mass[:, None] * s.subtree_linvel
    momentum[:, 3:] = s.subtree_angmom + cross(s.subtree_com, momentum[:, :3])
    return momentum


def _halfway(model: SolidModel, s: Scratch, state: SolidState, dt: float) -> Array:
    """As `_momentum`, when the positions have moved on for half a step."""
    q = model.integrate(state.q, state.v, 0.5 * dt)
    return _momentum(model, s, SolidState(q, state.v))


def momentum(model: SolidModel, state: SolidState) -> Array:
    """(2, 3) linear momentum (N s) and angular momentum about the world origin (N m s)."""
    return _momentum(model, scratch(model), state)[0].reshape(2, 3)


def halfway_momentum(model: SolidModel, state: SolidState, dt: float) -> Array:
    """(2, 3) momentum of the pose half a step after `state` at the state's velocity.

    The time scheme moves positions by dt v and then changes v, as leapfrog does: v belongs to the
    middle of the next step, and this is the momentum that a free creature keeps to rounding.
    `momentum` wavers about it by O(dt).
    """
    return _halfway(model, scratch(model), state, dt)[0].reshape(2, 3)


def mass_matrix(model: SolidModel, q: Array) -> Array:
    """(nv, nv) joint space mass matrix, armature included."""
    s = scratch(model)
    s.place(q)
    mujoco.mj_makeM(s.mj, s.data)
    return s.mass_matrix().copy()


def kinetic_energy(model: SolidModel, state: SolidState) -> float:
    """Kinetic energy, J; joint armature included."""
    return float(0.5 * state.v @ mass_matrix(model, state.q) @ state.v)


def potential_energy(model: SolidModel, state: SolidState) -> float:
    """Energy in gravity and in springs of joints and tendons, J."""
    s = scratch(model)
    s.place(state.q)
    mujoco.mj_tendon(s.mj, s.data)
    mujoco.mj_energyPos(s.mj, s.data)
    return float(s.data.energy[0])
