"""Velocity changes of bones, and the flesh and the rigid clusters of bodies that follow them."""

from __future__ import annotations

import numpy as np

from flowborne.kernels.arrays import Array, Integers, Mask
from flowborne.solids.dynamics import Kinematics, kinematics
from flowborne.solids.model import SolidModel, SolidState
from flowborne.solids.momentum import mass_matrix, mass_times
from flowborne.solids.prescribed import symmetric_inverse
from flowborne.solids.scratch import cross


def follow(model: SolidModel, q: Array, change: Array) -> Array:
    """(nv,) change of velocity of bones (nv,), and of the flesh that they carry, at pose q (nq,).

    Each point of flesh moves with its shares of the motion of the bones (`Flesh.carried`). Without
    this, flesh would lag one step behind bones that start or stop suddenly, and tear.
    """
    if model.flesh is None or not change.any():
        return change
    return followed(model, kinematics(model, q), change)


def posed_flesh(model: SolidModel, q: Array) -> Array:
    """(nq,) the pose q with flesh moved from rest to its bones.

    Each point moves to the mean, weighted by its shares, of its positions relative to the bones.
    """
    flesh = model.flesh
    if flesh is None:
        return q
    rest, now = kinematics(model, model.rest().q), kinematics(model, q)
    rotation = now.body_rotation @ np.swapaxes(rest.body_rotation, 1, 2)
    carried = np.einsum("bij,bnj->bni", rotation, flesh.rest - rest.body_position[:, None])
    carried += now.body_position[:, None]
    return model.integrate(
        np.where(flesh.positions, model.rest().q, q),
        flesh.of_vertices(np.einsum("nb,bni->ni", flesh.carried, carried) - flesh.rest),
        1.0,
    )


def follow_each(model: SolidModel, q: Array) -> tuple[Integers, Array]:
    """The dofs (k,) of bones, and (nv, k) the velocities of all dofs for unit velocity of each."""
    if model.flesh is None:
        return np.arange(model.nv), np.eye(model.nv)
    bones = np.flatnonzero(~model.flesh.dofs)
    pose, unit = kinematics(model, q), np.zeros((bones.size, model.nv))
    unit[np.arange(bones.size), bones] = 1.0
    return bones, np.stack([followed(model, pose, row) for row in unit], axis=1)


def followed(model: SolidModel, pose: Kinematics, change: Array) -> Array:
    """As `follow`, of a model with flesh in a pose."""
    assert model.flesh is not None
    twist = model.flesh.carried @ (pose.twist_jacobian @ change)
    moving = twist[:, :3] + cross(twist[:, 3:], pose.vertices)
    return np.where(model.flesh.dofs, model.flesh.of_vertices(moving), change)


def outboard_dofs(model: SolidModel, dofs: int | Integers) -> Integers:
    """Dofs of all joints on the descendants of the bodies that `dofs` move."""
    return model.outboard[np.atleast_1d(dofs)].any(axis=0).nonzero()[0]


def rigidify(
    model: SolidModel, state: SolidState, dofs: Integers, fixed: Mask | None = None
) -> SolidState:
    """State in which the joints `dofs` do not move, by impulses at these joints only.

    With c the joints and f the other dofs, the impulse changes v_f by M_ff^-1 M_fc v_c. Linear and
    angular momentum of a floating creature do not change; setting v_c to zero alone would change
    them. Flesh moves with the bones.

    dofs     (k,) joints that lose their relative velocity
    fixed    (nv,) dofs that keep their velocity (driven or locked ones)
    returns  new state with the same positions
    source   Lentine et al. 2011, sections 3.3 and 5
    """
    velocity = state.v.copy()
    velocity[dofs] = 0.0
    free = np.ones(model.nv, bool)
    free[dofs] = False
    free &= ~model.locked
    if fixed is not None:
        free &= ~fixed
    if model.flesh is not None:
        free &= ~model.flesh.dofs
    others = free.nonzero()[0]
    if others.size:
        M = carried_mass(model, state.q)
        lost = M[np.ix_(others, dofs)] @ state.v[dofs]
        velocity[others] += symmetric_inverse(M[np.ix_(others, others)]) @ lost
    if model.flesh is None:
        return SolidState(state.q.copy(), velocity)
    return SolidState(state.q.copy(), state.v + follow(model, state.q, velocity - state.v))


def carried_mass(model: SolidModel, q: Array) -> Array:
    """(nbones, nbones) mass matrix of the bones' dofs with flesh moving along: F^T M F."""
    if model.flesh is None:
        return mass_matrix(model, q)
    _, following = follow_each(model, q)
    moved = mass_times(model, q, np.ascontiguousarray(following.T))
    return np.stack([following.T @ column for column in moved], axis=1)
