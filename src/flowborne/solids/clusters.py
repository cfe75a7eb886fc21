"""Rigid clusters: bodies outboard of a joint that move as one while the joint is tried out."""

from __future__ import annotations

import mujoco
import numpy as np
from numpy.typing import NDArray

from flowborne.solids.following import follow, follow_each
from flowborne.solids.model import SolidModel
from flowborne.solids.momentum import mass_matrix
from flowborne.solids.prescribed import symmetric_inverse
from flowborne.solids.scratch import scratch
from flowborne.solids.state import SolidState

Array = NDArray[np.float64]


def outboard_dofs(model: SolidModel, dofs: int | NDArray[np.int64]) -> NDArray[np.int64]:
    """Dofs of all joints on the bodies below one that any of `dofs` moves, none of its own."""
    return model.outboard[np.atleast_1d(dofs)].any(axis=0).nonzero()[0]


def rigidify(
    model: SolidModel,
    state: SolidState,
    dofs: NDArray[np.int64],
    fixed: NDArray[np.bool_] | None = None,
) -> SolidState:
    """State whose joints `dofs` do not move, by impulses at these joints alone.

    With c the joints and f the other dofs, the impulse changes v_f by M_ff^-1 M_fc v_c: linear and
    angular momentum of a floating creature stay as they are, which they would not if v_c were just
    set to zero. Flesh rides on the bones.

    dofs     (k,) joints whose relative velocity is removed
    fixed    (nv,) dofs that keep their velocity whatever it takes (driven or locked ones)
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
    """(nbones, nbones) mass matrix of the bones' dofs when flesh rides on them: F^T M F."""
    if model.flesh is None:
        return mass_matrix(model, q)
    _, following = follow_each(model, q)
    s = scratch(model)
    s.place(q)
    mujoco.mj_makeM(s.mj, s.data)
    moved = np.empty(model.nv)
    columns = []
    for column in np.ascontiguousarray(following.T):
        mujoco.mj_mulM(s.mj, s.data, moved, column)
        columns.append(following.T @ moved)
    return np.stack(columns, axis=1)
