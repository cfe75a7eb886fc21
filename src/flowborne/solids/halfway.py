"""Coriolis and centrifugal forces at the velocity that the bodies have half-way through a step.

Positions move by dt v before v changes, as in leapfrog, so forces that depend on the velocity are
second order in time and do no work only at (v + v+)/2. Along dofs that carry a whole tree, the
equation of motion is written as the change of momentum itself, which then holds to rounding.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import mujoco
import numpy as np
from numba import njit
from numpy.typing import NDArray
from scipy.sparse import csr_array

from flowborne.solids.model import SolidModel
from flowborne.solids.momentum import subtree_halfway_momentum, weight
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


@njit(nogil=True, cache=True)
def momentum_impulse(
    cdof: Array,
    centre: Array,
    given: Array,
    later: Array,
    body: NDArray[np.int64],
    conserved: NDArray[np.bool_],
    gained: Array,
    still: Array,
    bias: Array,
    outer: Array,
    dt: float,
) -> tuple[Array, Array]:
    """(nv,) r of A v+ = r, and (nv,) how much of it may be rounding errors.

        r = A v + (M - armature) (v+ - v) + S.(P - P+) + dt f      along conserved dofs
        r = A v - dt c + dt f                                      along the others

    cdof, centre                (nv, 6), (nv, 3) of the twists S about the world origin
    given, later, body          (bodies, 6) P and P+, and (nv,) their rows for each dof
    gained, still, bias, outer  (nv,) (M - armature) (v+ - v), A v, c, f
    """
    dofs = len(cdof)
    impulse, rounding, largest = np.empty(dofs), np.empty(dofs), 0.0
    twist = np.empty(6)
    for n in range(dofs):
        for i in range(3):
            j, k = (i + 1) % 3, (i + 2) % 3
            across = centre[n, j] * cdof[n, k] - centre[n, k] * cdof[n, j]
            twist[i], twist[3 + i] = cdof[n, 3 + i] + across, cdof[n, i]
        change, scale = 0.0, 0.0
        for i in range(6):
            before, after = given[body[n], i], later[body[n], i]
            change += twist[i] * (before - after)
            scale += abs(twist[i]) * (abs(before) + abs(after))
        moved = change + gained[n] if conserved[n] else -dt * bias[n]
        impulse[n] = still[n] + moved + dt * outer[n]
        rounding[n] = ROUNDING * (scale + dt * abs(outer[n]))
        largest = max(largest, scale)
    for n in range(dofs):
        rounding[n] += OF_THE_WHOLE * largest
    return impulse, rounding


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
