"""Coriolis and centrifugal forces at the velocity that the bodies have half-way through a step.

Positions move by dt v before v changes, as in leapfrog, so forces that depend on the velocity are
second order in time and do no work only at (v + v+)/2. Along dofs that carry a whole tree, the
equation of motion is written as the change of momentum itself, which then holds to rounding.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import mujoco
import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array

from flowborne.kernels.momentum import momentum_impulse
from flowborne.solids.model import SolidModel
from flowborne.solids.momentum import subtree_halfway_momentum, weight
from flowborne.solids.scratch import Scratch, scratch
from flowborne.solids.state import SolidState

Array = NDArray[np.float64]


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
