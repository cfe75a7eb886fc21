"""Coriolis and centrifugal forces at the velocity that the bodies have half-way through a step.

Positions move by dt v before v changes, as in leapfrog, so forces that depend on the velocity are
second order in time and do no work only at (v + v+)/2. Along dofs that carry a whole tree, the
equation of motion is written as the change of momentum itself, which then holds to rounding.
"""

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array

from flowborne.solids.model import SolidModel
from flowborne.solids.momentum import dof_twists, subtree_halfway_momentum, weight
from flowborne.solids.scratch import Scratch, scratch
from flowborne.solids.state import SolidState

Array = NDArray[np.float64]

ROUNDING, OF_THE_WHOLE = 1e-14, 1e-15
"""Shares of the terms of an impulse, and of the largest impulse of all, that rounding may change: a
hand's forces are sums in which those of the whole creature cancel."""


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
    along  (nv, 6) twist that unit velocity of each dof gives what it moves
    """

    model: SolidModel
    state: SolidState
    dt: float
    outer: Array
    still: Array
    mass: Array | csr_array
    given: Array
    along: Array

    def impulse(self, v_plus: Array) -> tuple[Array, Array]:
        """(nv,) r of A v+ = r with the forces half-way to `v_plus` (nv,), and (nv,) how much of it
        may be rounding errors."""
        model, dt, v = self.model, self.dt, self.state.v
        s = scratch(model)
        later = subtree_halfway_momentum(model, s, SolidState(self.state.q, v_plus), dt)
        s.place(self.state.q, 0.5 * (v + v_plus))
        bias = np.empty(model.nv)
        mujoco.mj_rne(s.mj, s.data, 0, bias)
        change = (self.along * (self.given - later)[model.dof_body]).sum(axis=1)
        change += self.mass @ (v_plus - v) - model.armature * (v_plus - v) + self.still
        moved = np.where(model.conserved, change, self.still - dt * bias)
        scale = (np.abs(self.along) * (np.abs(self.given) + np.abs(later))[model.dof_body]).sum(
            axis=1
        )
        own = ROUNDING * (scale + dt * np.abs(self.outer))
        return moved + dt * self.outer, own + OF_THE_WHOLE * float(scale.max(initial=0.0))


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
    along, fall = dof_twists(model, s), dt * weight(model, s)
    given = subtree_halfway_momentum(model, s, before, dt) + fall
    return Halfway(model, state.copy(), dt, outer, still, mass, given, along)
