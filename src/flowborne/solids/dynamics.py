"""Kinematics and the solid's own linear system A (v+ - v) = dt b, assembled by MuJoCo."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cache, cached_property

import mujoco
import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array, vstack

from flowborne.solids.model import SolidModel
from flowborne.solids.momentum import Halfway, halfway
from flowborne.solids.scratch import Scratch, scratch, twists_about_origin
from flowborne.solids.state import SolidState

Array = NDArray[np.float64]
Zones = NDArray[np.int64]

OFF, ACTIVE, PUSHED_UP, PUSHED_DOWN = 0, 1, 2, 3
"""State of a constraint row, numbered as mjtConstraintState: no force, a force linear in the
acceleration, or the whole of the dry friction along or against the row's direction."""

FRICTION_SIGN = np.array([0.0, 0.0, 1.0, -1.0])
"""Of the dry friction in each zone."""

TWO_SIDED, FRICTION, ONE_SIDED = 0, 1, 2
"""Kinds of rows: equalities; dry friction; limits and the edges of contact pyramids."""

KIND_OF_ROW = np.array([TWO_SIDED, FRICTION, FRICTION, *[ONE_SIDED] * 5])
FIRST_CONTACT = int(mujoco.mjtConstraint.mjCNSTR_CONTACT_FRICTIONLESS)

NEAR = 1e-11
"""A row within this share of its reference of a change of zone stays where it is."""

SETTLED = 1e-13
"""Forces of Coriolis are found to this share of the momentum."""

UNDAMPED = 8
"""Turns of Newton's method for the contacts after which it searches along its direction."""

HALVINGS = 40
"""Of the interval in which such a search looks for the least of a convex function."""

AT_REST = 1e-12
"""What is slower than this is at rest, m/s and rad/s."""


@dataclass(frozen=True)
class Kinematics:
    """Poses of everything, in world axes.

    body_position   (nbody, 3) m
    body_rotation   (nbody, 3, 3) body's frame to the world's
    geom_position   (ngeom, 3) m
    geom_rotation   (ngeom, 3, 3) geometry's frame to the world's
    own_centroid    (nbody, 3) centroid of the displaced volume in the body's frame, m
    mass_centre     (nbody, 3) centre of mass, m
    cdof            (nv, 6) angular velocity that unit velocity of each dof gives what it moves,
                    and velocity of the point at its `dof_centre`
    dof_centre      (nv, 3) m
    moves           (nbody, nv) whether a dof moves a body
    vertices        (n, 3) of flesh, m
    vertex_jacobian (3n, nv) from v to their velocities, sparse
    """

    body_position: Array
    body_rotation: Array
    geom_position: Array
    geom_rotation: Array
    own_centroid: Array
    mass_centre: Array
    cdof: Array
    dof_centre: Array
    moves: NDArray[np.bool_]
    vertices: Array
    vertex_jacobian: csr_array

    @cached_property
    def centroid(self) -> Array:
        """(nbody, 3) centroid of the displaced volume, m."""
        turned = np.matmul(self.body_rotation, self.own_centroid[:, :, None])
        return self.body_position + turned[:, :, 0]

    @cached_property
    def twist_jacobian(self) -> Array:
        """(nbody, 6, nv) from v to each body's twist: velocity of the point at the world origin,
        then angular velocity."""
        twists = np.ascontiguousarray(twists_about_origin(self.cdof, self.dof_centre).T)
        return np.where(self.moves[:, None, :], twists, 0.0)

    @cached_property
    def twist_rows(self) -> Array:
        """(6 nbody, nv) the same, the twists of all bodies in turn."""
        bodies, components, dofs = self.twist_jacobian.shape
        return self.twist_jacobian.reshape(bodies * components, dofs)

    @cached_property
    def jacobian(self) -> csr_array:
        """(k, nv) T, from v to the motion of everything: all twists, then the velocities of all
        vertices."""
        both = [csr_array(self.twist_rows), self.vertex_jacobian]
        return csr_array(vstack(both, format="csr"))


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

    def pushing(self, zones: Zones) -> int:
        """Number of contacts with an active row."""
        active = self.contact[zones == ACTIVE]
        return int(np.unique(active[active >= 0]).size)

    def force(self, acceleration: Array, zones: Zones) -> Array:
        """(k,) force along each row's direction at an acceleration (nv,), if in these zones."""
        spring = self.D * (self.aref - self.J @ acceleration)
        return np.where(zones == ACTIVE, spring, FRICTION_SIGN[zones] * self.friction)

    def acting(self, zones: Zones) -> tuple[Array, Array, Array]:
        """J and D of the active rows, and the force (nv,) of all rows at no acceleration."""
        on = zones == ACTIVE
        J, D = self.J[on], self.D[on]
        slipping = FRICTION_SIGN[zones] * self.friction
        return J, D, J.T @ (D * self.aref[on]) + self.J.T @ slipping


@dataclass(frozen=True)
class SolidSystem:
    """A (v+ - v) = dt b, written A v+ = impulse.

    A        (nv, nv) symmetric positive definite
    impulse  (nv,) r = A v + dt b
    dt       s
    v        (nv,) velocity before the step
    smooth   (A, r) without the constraint rows
    rows     constraint rows, and zones (k,), the state of each that A and impulse are made for
    halfway  the forces half-way through the step, and own (nv,), the impulse that they give here
    at       (nv,) velocity whose zones these are, found in as many turns
    """

    A: Array
    impulse: Array
    dt: float
    v: Array
    smooth: tuple[Array, Array]
    rows: Rows | None
    zones: Zones
    halfway: Halfway | None
    own: Array
    at: Array
    turns: int = 0

    @property
    def contacts(self) -> int:
        """Number of contacts that push."""
        return 0 if self.rows is None else self.rows.pushing(self.zones)

    def updated(self, v_plus: Array) -> SolidSystem | None:
        """System with the contacts, limits and Coriolis forces that `v_plus` (nv,) implies.

        None when it has them. The repeated solve is Newton's method on a piecewise quadratic
        function, and a fixed point for the forces of Coriolis. It ends after few turns as a rule;
        when it has not, contacts are those where the function is least on the way from where they
        were found before, so that it does not go in circles. The caller bounds the number of turns.
        """
        zones, own, at, settled = self.zones, self.own, v_plus, True
        if self.rows is not None:
            zones = self.rows.zones((v_plus - self.v) / self.dt, self.zones)
            settled = np.array_equal(zones, self.zones)
            if not settled and self.turns >= UNDAMPED:
                at = self._least_towards(v_plus, self.rows)
                zones = self.rows.zones((at - self.v) / self.dt, self.zones)
        if self.halfway is not None:
            own, rounding = self.halfway.impulse(v_plus)
            room = SETTLED * (np.abs(self.A) @ (np.abs(v_plus) + AT_REST)) + rounding
            settled = settled and bool((np.abs(own - self.own) <= room).all())
        if settled:
            return None
        A, impulse = self.smooth
        system = self._with(zones, A, impulse + own - self.own)
        return replace(system, own=own, at=at, turns=self.turns + 1)

    def _least_towards(self, v_plus: Array, rows: Rows) -> Array:
        """(nv,) velocity of least cost between `at` and the solution `v_plus` for its zones.

        The cost is the one whose gradient is A v+ - impulse with the rows' forces as they are at
        v+. A lacks the fluid's mass, with which the least would lie nearer to `v_plus`.
        """
        along = v_plus - self.at
        curvature, pull = along @ self.A @ along, self.dt * (rows.J @ along)
        low, high = 0.0, 1.0
        for _ in range(HALVINGS):
            share = 0.5 * (low + high)
            a = (self.at + share * along - self.v) / self.dt
            more = rows.force(a, rows.zones(a, self.zones)) - rows.force(a, self.zones)
            if (share - 1.0) * curvature < pull @ more:
                low = share
            else:
                high = share
        return self.at + high * along

    def pushed(self, force: Array) -> SolidSystem:
        """System with an additional generalised force (nv,)."""
        A, impulse = self.smooth
        return self._with(self.zones, A, impulse + self.dt * force)

    def _with(self, zones: Zones, A: Array, impulse: Array) -> SolidSystem:
        full = _with_rows(A, impulse, self.v, self.dt, self.rows, zones)
        return replace(self, A=full[0], impulse=full[1], smooth=(A, impulse), zones=zones)


@cache
def no_flesh(nv: int) -> csr_array:
    """(0, nv) the Jacobian of the vertices of a model that has none."""
    return csr_array((0, nv))


def kinematics(model: SolidModel, q: Array) -> Kinematics:
    """Poses and Jacobians at positions (nq,)."""
    s = scratch(model)
    s.place(q)
    bodies, flesh = model.nbody, model.flesh
    return Kinematics(
        s.xpos[:bodies].copy(),
        s.xmat[:bodies].reshape(-1, 3, 3).copy(),
        s.geom_xpos[model.geom_id],
        s.geom_xmat[model.geom_id].reshape(-1, 3, 3),
        model.centroid,
        s.xipos[:bodies].copy(),
        s.cdof.copy(),
        s.subtree_com[model.dof_root],
        model.moves,
        np.zeros((0, 3)) if flesh is None else flesh.placed(s),
        no_flesh(model.nv) if flesh is None else flesh.moving(s),
    )


def assemble(
    model: SolidModel,
    state: SolidState,
    applied: Array,
    dt: float,
    before: SolidState | None = None,
    guess: Array | None = None,
) -> SolidSystem:
    """System of the bodies alone at `state`, with gravity, springs, limits and contact.

        A = M + dt/2 D + dt^2/4 K + Ja^T Da Ja      b = f + Ja^T Da aref + dry friction

    K and D are those of springs and dampers of joints and tendons; Ja are the active rows, first
    those of MuJoCo's own solution under `applied`. Positions move by dt v before v changes, so that
    f, the forces there, are half-way between the velocities, and this is Newmark's average
    acceleration: second order in dt, and springs lose no energy. MuJoCo's own step, with
    A = M + dt D + dt^2 K, damps an oscillation of frequency omega by omega dt / 2 in each radian.

    applied  (nv,) generalised force, N or N m
    dt       s
    before   state before the positions moved. With it, `updated` brings the forces of Coriolis to
             the velocity half-way through the step; without, they are those at v, and A a = b is
             solved by MuJoCo's acceleration
    guess    (nv,) velocity after the step for which the forces of Coriolis are found at first; v
             when None
    raises   ValueError when the model has flesh
    """
    if model.flesh is not None:
        raise ValueError("bones alone were asked for, and the model has flesh. Use assemble_flesh.")
    s = scratch(model)
    s.set_time_step(dt)
    s.forward(state.q, state.v, applied)
    mass = s.mass_matrix().copy()
    A, force = _smooth(model, s, mass)
    rows, zones = rows_of(model, s)
    v, still = state.v.copy(), A @ state.v
    middle, impulse = None, still + dt * force
    if before is not None:
        middle = halfway(model, s, before, state, dt, still, mass, force + s.bias)
        impulse, _ = middle.impulse(v if guess is None else guess)
    full = _with_rows(A, impulse, v, dt, rows, zones)
    return SolidSystem(full[0], full[1], dt, v, (A, impulse), rows, zones, middle, impulse, v)


def _smooth(model: SolidModel, s: Scratch, mass: Array) -> tuple[Array, Array]:
    """A and b without constraint rows; after mj_forward, with its mass matrix (nv, nv)."""
    data = s.data
    if not data.efm_active:
        return mass, s.smooth.copy()
    A = mass.copy()
    A.flat[:: model.nv + 1] += centred(data.efm_diag, data.efm_ck, s.dt)
    for n, t in enumerate(data.efm_tid[: data.nefmT]):
        first, count = s.mj.ten_J_rowadr[t], s.mj.ten_J_rownnz[t]
        row = np.zeros(model.nv)
        row[s.mj.ten_J_colind[first : first + count]] = data.ten_J[first : first + count]
        A += centred(data.efm_ts[n], data.efm_tk[n], s.dt) * np.outer(row, row)
    return A, s.smooth.copy()


def centred(implicit: Array, stiff: Array, dt: float) -> Array:
    """dt/2 D + dt^2/4 K of MuJoCo's dt D + dt^2 K and dt K."""
    return 0.5 * implicit - 0.25 * dt * stiff


def rows_of(model: SolidModel, s: Scratch) -> tuple[Rows | None, Zones]:
    """Constraint rows and their zones in MuJoCo's own solution; after mj_forward.

    Contacts without friction have one row, whatever their condim.
    """
    data, count = s.data, int(s.data.nefc)
    if count == 0:
        return None, np.zeros(0, np.int64)
    kind = data.efc_type
    if mujoco.mj_isSparse(s.mj):
        J = np.zeros((count, model.nv))
        row = np.repeat(np.arange(count), data.efc_J_rownnz)
        J[row, data.efc_J_colind[: len(row)]] = data.efc_J[: len(row)]
    else:
        J = np.array(data.efc_J).reshape(count, model.nv)
    rows = Rows(
        J,
        np.array(data.efc_D),
        np.array(data.efc_aref),
        np.array(data.efc_frictionloss),
        KIND_OF_ROW[kind],
        np.where(kind >= FIRST_CONTACT, data.efc_id, -1),
    )
    return merge_frictionless(rows, data.efc_state.astype(np.int64), s)


def merge_frictionless(rows: Rows, zones: Zones, s: Scratch) -> tuple[Rows, Zones]:
    """One row along the normal in place of the pyramid of every contact without friction.

    The edges of such a pyramid are the normal, but for a friction of mjMINMU = 1e-5 that MuJoCo
    leaves, and 1 / (2 mu^2) times as stiff: rounding decides which of them are active, and they
    take turns without end. Their mean is the normal's row, of stiffness 2 mu^2 D, as MuJoCo makes
    it for condim 1.
    """
    contacts = s.data.contact
    used = np.arange(contacts.friction.shape[1]) < contacts.dim[:, None] - 1
    friction = np.where(used, contacts.friction, 0.0).max(axis=1)
    bare = (contacts.dim > 1) & (friction <= mujoco.mjMINMU)
    edge = (rows.contact >= 0) & np.isin(rows.contact, np.flatnonzero(bare))
    if not edge.any():
        return rows, zones
    # the number of its new row for every old one
    follows = edge & np.append(False, edge[:-1] & (rows.contact[1:] == rows.contact[:-1]))
    first = np.flatnonzero(~follows)
    group = np.cumsum(~follows) - 1
    count = np.bincount(group)
    mean = csr_array((1.0 / count[group], (group, np.arange(len(group)))))
    D = rows.D[first].copy()
    D[edge[first]] *= 2.0 * contacts.mu[rows.contact[first[edge[first]]]] ** 2
    active = np.zeros(len(first), bool)
    np.logical_or.at(active, group, zones == ACTIVE)
    merged = Rows(
        mean @ rows.J,
        D,
        mean @ rows.aref,
        rows.friction[first],
        rows.kind[first],
        rows.contact[first],
    )
    return merged, np.where(edge[first], np.where(active, ACTIVE, OFF), zones[first])


def _with_rows(
    A: Array, impulse: Array, v: Array, dt: float, rows: Rows | None, zones: Zones
) -> tuple[Array, Array]:
    """A and impulse with the rows in the given zones."""
    if rows is None:
        return A, impulse
    J, D, force = rows.acting(zones)
    added = J.T @ (D[:, None] * J)
    return A + added, impulse + added @ v + dt * force
