"""Kinematics, and the linear system A (v+ - v) = dt b of the bodies, assembled by MuJoCo.

Method: docs/method/bodies.md.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, replace
from functools import cache, cached_property
from typing import Self

import numpy as np
from scipy.sparse import csc_array, csr_array, vstack

from flowborne.kernels.arrays import Array, Integers, Mask
from flowborne.solids.constraints import Rows, rows_of
from flowborne.solids.engine import add_springs
from flowborne.solids.model import SolidModel, SolidState
from flowborne.solids.momentum import Halfway
from flowborne.solids.scratch import Scratch, posed, scratch, twists_about_origin

CORIOLIS_TOLERANCE = 1e-13
"""Impulses of Coriolis forces are converged to this share of the momentum."""

FULL_NEWTON_STEPS = 8
"""Full steps of Newton's method for the contacts, before it searches along its direction."""

HALVINGS = 40
"""Halvings of the interval in which such a search looks for the minimum of a convex function."""

REST_SPEED = 1e-12
"""Slower motion counts as rest, m/s and rad/s."""


@dataclass(frozen=True)
class Kinematics:
    """Poses of bodies, geometries and flesh, in world axes.

    body_position   (nbody, 3) m
    body_rotation   (nbody, 3, 3) body's frame to the world's
    geom_position   (ngeom, 3) m
    geom_rotation   (ngeom, 3, 3) geometry's frame to the world's
    own_centroid    (nbody, 3) centroid of the displaced volume in the body's frame, m
    mass_centre     (nbody, 3) centre of mass, m
    cdof            (nv, 6) for unit velocity of each dof: angular velocity of the bodies that it
                    moves, and velocity of the point at its `dof_centre`
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
    moves: Mask
    vertices: Array
    vertex_jacobian: csr_array

    @cached_property
    def centroid(self) -> Array:
        """(nbody, 3) centroid of the displaced volume, m."""
        rotated = np.matmul(self.body_rotation, self.own_centroid[:, :, None])
        return self.body_position + rotated[:, :, 0]

    @cached_property
    def twist_jacobian(self) -> Array:
        """(nbody, 6, nv) from v to the twist of each body: velocity of the point at the world
        origin, then angular velocity."""
        twists = np.ascontiguousarray(twists_about_origin(self.cdof, self.dof_centre).T)
        return np.where(self.moves[:, None, :], twists, 0.0)

    @cached_property
    def twist_rows(self) -> Array:
        """(6 nbody, nv) the same as a matrix, body after body."""
        bodies, components, dofs = self.twist_jacobian.shape
        return self.twist_jacobian.reshape(bodies * components, dofs)

    @cached_property
    def bone_jacobian(self) -> csr_array:
        """(6 nbody, nv) the same, sparse."""
        dofs = np.flatnonzero(self.moves.any(axis=0))
        twists = self.twist_rows[:, dofs]
        row, own = np.nonzero(twists)
        return csr_array((twists[row, own], (row, dofs[own])), shape=self.twist_rows.shape)

    @cached_property
    def transposed(self) -> tuple[csc_array, csc_array]:
        """(nv, 6 nbody) and (nv, 3n), from pushes on bodies and vertices to those on dofs."""
        return self.bone_jacobian.T, self.vertex_jacobian.T

    @cached_property
    def jacobian(self) -> csr_array:
        """(k, nv) T, from v to all twists, followed by the velocities of all vertices."""
        return csr_array(vstack([self.bone_jacobian, self.vertex_jacobian], format="csr"))


@dataclass(frozen=True)
class System(ABC):
    """The equations of motion of a step, A (v+ - v) = dt b, written A v+ = impulse.

    A        (nv, nv) symmetric positive definite
    impulse  (nv,) r = A v + dt b
    dt       s
    v        (nv,) velocity before the step
    rows     constraint rows, None without any; zones (k,), the zone of each
    halfway  forces at the half-way velocity of the step, None where they are those at v
    own      (nv,) impulse of these forces, contained in `impulse`
    """

    A: Array | csr_array
    impulse: Array
    dt: float
    v: Array
    rows: Rows | None
    zones: Integers
    halfway: Halfway | None
    own: Array

    @abstractmethod
    def updated(self, v_plus: Array) -> Self | None:
        """System with the contacts, limits and Coriolis forces at `v_plus` (nv,), or None if equal.

        Repeated solves are Newton's method on a piecewise quadratic function, and a fixed-point
        iteration for the Coriolis forces; the caller bounds the number of turns.
        """

    @abstractmethod
    def pushed(self, force: Array) -> Self:
        """System with an additional generalised force (nv,)."""

    @property
    def contacts(self) -> int:
        """Number of contacts with an active row."""
        return 0 if self.rows is None else self.rows.pushing(self.zones)

    def zones_at(self, v: Array) -> Integers:
        """(k,) zones of the rows for a velocity (nv,) after the step."""
        if self.rows is None:
            return self.zones
        return self.rows.zones((v - self.v) / self.dt, self.zones)

    def own_at(self, v_plus: Array) -> tuple[Array, bool]:
        """(nv,) `own` for a velocity (nv,) after the step, and whether it is unchanged."""
        if self.halfway is None:
            return self.own, True
        own, rounding = self.halfway.impulse(v_plus)
        if own is self.own:
            return own, True
        change = np.abs(own - self.own)
        larger = np.flatnonzero(~(change <= rounding))

        def settled(n: Integers) -> bool:
            scale = abs(self.A[n]) @ (np.abs(v_plus) + REST_SPEED)
            return bool((change[n] <= CORIOLIS_TOLERANCE * scale + rounding[n]).all())

        worst = larger[np.argsort(change[larger])[-1:]]  # mostly enough to see that it changes
        return own, settled(worst) and settled(larger)


@dataclass(frozen=True)
class SolidSystem(System):
    """The system of bones alone; A and impulse contain the constraint rows.

    smooth  (A, r) without the rows
    at      (nv,) velocity at which the zones were found
    turns   number of updates
    known   (nv,) of the first r: forces but the applied ones, those of gravity and Coriolis with
            the opposite sign, and the velocity for which these were made; None with constraint
            rows, which depend on what is applied
    """

    A: Array
    smooth: tuple[Array, Array]
    at: Array
    turns: int = 0
    known: tuple[Array, Array, Array] | None = None

    def under(self, applied: Array) -> SolidSystem | None:
        """The first system for another generalised force (nv,); None without `known`."""
        if self.known is None or self.halfway is None:
            return None
        force, outer, guess = self.known
        middle = self.halfway.under(force + applied + outer)
        own, _ = middle.impulse(guess)
        smooth = self.smooth[0], own
        return replace(self, impulse=own, own=own, halfway=middle, smooth=smooth)

    def updated(self, v_plus: Array) -> SolidSystem | None:
        """As `System.updated`; after FULL_NEWTON_STEPS the zones are those at the minimum of the
        function between the last point and `v_plus`, so that the iteration does not cycle."""
        zones, at = self.zones_at(v_plus), v_plus
        settled = self.rows is None or np.array_equal(zones, self.zones)
        if self.rows is not None and not settled and self.turns >= FULL_NEWTON_STEPS:
            at = self._least_towards(v_plus, self.rows)
            zones = self.zones_at(at)
        own, same = self.own_at(v_plus)
        if settled and same:
            return None
        A, impulse = self.smooth
        system = self._with(zones, A, impulse + own - self.own)
        return replace(system, own=own, at=at, turns=self.turns + 1)

    def _least_towards(self, v_plus: Array, rows: Rows) -> Array:
        """(nv,) velocity of least cost between `at` and the solution `v_plus` for its zones.

        The gradient of the cost is A v+ - impulse with the forces of the rows at v+. A lacks the
        mass of the fluid, which would move the minimum closer to `v_plus`.
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
        A, impulse = self.smooth
        return self._with(self.zones, A, impulse + self.dt * force)

    def _with(self, zones: Integers, A: Array, impulse: Array) -> SolidSystem:
        full = _with_rows(A, impulse, self.v, self.dt, self.rows, zones)
        return replace(self, A=full[0], impulse=full[1], smooth=(A, impulse), zones=zones)


@cache
def no_flesh(nv: int) -> csr_array:
    """(0, nv) Jacobian of the vertices of a model without flesh."""
    return csr_array((0, nv))


def kinematics(model: SolidModel, q: Array) -> Kinematics:
    """Poses and Jacobians at positions (nq,)."""
    s = posed(model, q)
    bodies, flesh = model.nbody, model.flesh
    return Kinematics(
        s.xpos[:bodies].copy(),
        s.xmat[:bodies].reshape(-1, 3, 3).copy(),
        s.geom_xpos[model.geom_id],
        s.geom_xmat[model.geom_id].reshape(-1, 3, 3),
        model.centroid,
        s.xipos[:bodies].copy(),
        s.cdof.copy(),
        s.dof_centre(),
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
    exact: Mask | None = None,
    added: csr_array | None = None,
) -> SolidSystem:
    """System of the bodies alone at `state`, with gravity, springs, limits and contact.

        A = M + dt/2 D + dt^2/4 K + Ja^T Da Ja      b = f + Ja^T Da aref + dry friction

    K and D are those of springs and dampers of joints and tendons; Ja are the active rows, first
    those of MuJoCo's solution under `applied`. Positions move by dt v before v changes, so the
    forces f at the new positions lie half-way between the velocities, and the scheme is Newmark's
    average acceleration: second order in dt, and springs lose no energy. MuJoCo's own step, with
    A = M + dt D + dt^2 K, damps an oscillation of frequency omega by omega dt / 2 per radian.

    applied  (nv,) generalised force, N or N m
    dt       s
    before   state before the positions moved. With it, `updated` evaluates the Coriolis forces at
             the half-way velocity of the step; without it, they are those at v, and MuJoCo's
             acceleration solves A a = b
    guess    (nv,) velocity after the step for the first Coriolis forces; v when None
    exact    (nv,) dofs with a drive of any force, see `Scratch.stiffen`
    added    (nv, nv) positive semidefinite matrix by which A is larger: that of applied forces that
             yield to the change of velocity
    raises   ValueError when the model has flesh
    """
    if model.flesh is not None:
        raise ValueError("bones alone were asked for, and the model has flesh. Use assemble_flesh.")
    s = scratch(model)
    s.set_time_step(dt)
    s.stiffen(state.v, exact)
    s.forward(state.q, state.v, applied)
    mass = s.mass_matrix().copy()
    A, force = _smooth(model, s, mass)
    if added is not None:
        A = A + added.toarray()
    rows, zones = rows_of(model, s)
    v, still = state.v.copy(), A @ state.v
    middle, impulse, known = None, still + dt * force, None
    if before is not None:
        guess = v if guess is None else guess
        if rows is None:
            known = s.data.qfrc_passive - s.bias, s.bias.copy(), guess
        middle = Halfway(model, s, before, state, dt, still, mass, force + s.bias)
        impulse, _ = middle.impulse(guess)
    full = _with_rows(A, impulse, v, dt, rows, zones)
    return SolidSystem(*full, dt, v, rows, zones, middle, impulse, (A, impulse), v, 0, known)


def _smooth(model: SolidModel, s: Scratch, mass: Array) -> tuple[Array, Array]:
    """A and b without constraint rows, from the mass matrix (nv, nv); call it after mj_forward."""
    data = s.data
    if not data.efm_active:
        return mass, s.smooth.copy()
    A = mass.copy()
    tendons = slice(data.nefmT)
    strength = centred(data.efm_ts[tendons], data.efm_tk[tendons], s.dt)
    add_springs(A, s.mj, data, centred(data.efm_diag, data.efm_ck, s.dt), strength)
    return A, s.smooth.copy()


def centred(implicit: Array, stiff: Array, dt: float) -> Array:
    """dt/2 D + dt^2/4 K, from MuJoCo's dt D + dt^2 K and dt K."""
    return 0.5 * implicit - 0.25 * dt * stiff


def _with_rows(
    A: Array, impulse: Array, v: Array, dt: float, rows: Rows | None, zones: Integers
) -> tuple[Array, Array]:
    """A and impulse with the rows in the given zones."""
    if rows is None:
        return A, impulse
    J, D, force = rows.acting(zones)
    added = J.T @ (D[:, None] * J)
    return A + added, impulse + added @ v + dt * force
