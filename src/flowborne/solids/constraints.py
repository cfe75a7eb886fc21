"""Constraint rows of a step: equalities, dry friction, limits and contacts.

Method: docs/method/contact.md.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import mujoco
import numpy as np
from scipy.sparse import csr_array

from flowborne.kernels.arrays import Array, Integers
from flowborne.solids.engine import row_jacobian
from flowborne.solids.model import SolidModel
from flowborne.solids.scratch import Scratch

OFF, ACTIVE, PUSHED_UP, PUSHED_DOWN = 0, 1, 2, 3
"""Zone of a row, numbered as mjtConstraintState: no force, a force linear in the acceleration, or
the full dry friction along or against the direction of the row."""

FRICTION_SIGN = np.array([0.0, 0.0, 1.0, -1.0])
"""Sign of the dry friction in each zone."""

TWO_SIDED, FRICTION, ONE_SIDED = 0, 1, 2
"""Kinds of rows: equalities; dry friction; limits and edges of contact pyramids."""

KIND_OF_ROW = np.array([TWO_SIDED, FRICTION, FRICTION, *[ONE_SIDED] * 5])
FIRST_CONTACT = int(mujoco.mjtConstraint.mjCNSTR_CONTACT_FRICTIONLESS)

TIE_TOLERANCE = 1e-11
"""A row keeps its zone within this distance from a change of zone, relative to its reference."""


@dataclass(frozen=True)
class Rows:
    """Constraint rows; the force of an active row on v is J^T D (aref - J a).

    J, D, aref  (k, nv), (k,), (k,) Jacobian, stiffness and reference acceleration
    friction    (k,) largest dry friction
    kind        (k,) TWO_SIDED, FRICTION or ONE_SIDED
    contact     (k,) number of the contact of a row, -1 for other rows
    """

    J: Array
    D: Array
    aref: Array
    friction: Array
    kind: Integers
    contact: Integers

    def zones(self, acceleration: Array, present: Integers) -> Integers:
        """(k,) zone of each row at an acceleration (nv,); a tie keeps the present zone."""
        motion = self.J @ acceleration
        slip = motion - self.aref
        margin = TIE_TOLERANCE * (1.0 + np.abs(motion) + np.abs(self.aref))
        sliding = self.kind == FRICTION
        edge = np.where(sliding, self.friction / self.D, 0.0)
        inside = np.where(sliding, np.abs(slip) < edge, slip < 0.0) | (self.kind == TWO_SIDED)
        beyond = np.where(slip < 0.0, PUSHED_UP, PUSHED_DOWN)
        zones = np.where(inside, ACTIVE, np.where(sliding, beyond, OFF))
        tie = (np.abs(np.abs(slip) - edge) <= margin) & (self.kind != TWO_SIDED)
        return np.where(tie, present, zones)

    def pushing(self, zones: Integers) -> int:
        """Number of contacts with an active row."""
        active = self.contact[zones == ACTIVE]
        return int(np.unique(active[active >= 0]).size)

    def force(self, acceleration: Array, zones: Integers) -> Array:
        """(k,) force along the direction of each row at an acceleration (nv,), for given zones."""
        spring = self.D * (self.aref - self.J @ acceleration)
        return np.where(zones == ACTIVE, spring, FRICTION_SIGN[zones] * self.friction)

    def acting(self, zones: Integers) -> tuple[Array, Array, Array]:
        """J and D of the active rows, and the force (nv,) of all rows at zero acceleration."""
        on = zones == ACTIVE
        J, D = self.J[on], self.D[on]
        slipping = FRICTION_SIGN[zones] * self.friction
        return J, D, J.T @ (D * self.aref[on]) + self.J.T @ slipping


def rows_of(model: SolidModel, s: Scratch) -> tuple[Rows | None, Integers]:
    """Constraint rows and their zones in MuJoCo's solution; call it after mj_forward.

    Contacts without friction have one row for any condim.
    """
    data, count = s.data, int(s.data.nefc)
    if count == 0:
        return None, np.zeros(0, np.int64)
    kind = data.efc_type
    rows = Rows(
        row_jacobian(s.mj, data),
        np.array(data.efc_D),
        np.array(data.efc_aref),
        np.array(data.efc_frictionloss),
        KIND_OF_ROW[kind],
        np.where(kind >= FIRST_CONTACT, data.efc_id, -1),
    )
    zones = data.efc_state.astype(np.int64)
    return merge_frictionless(*stop_in_time(rows, zones, model, s), s)


def stop_in_time(
    rows: Rows, zones: Integers, model: SolidModel, s: Scratch
) -> tuple[Rows, Integers]:
    """Let joints with a stiff stop just reach it in the next step, and not pass it.

    MuJoCo's row acts where the gap is less than `margin`, by the force of a spring and a damper at
    the end of the step: (1 + B dt + K dt^2) aref = -B v - K (gap - margin + dt v). With a time
    constant of two steps it stops a joint within the way of two steps. In its place

        aref = -(v + gap / dt) / dt ahead of the stop, so that v+ = -gap / dt
        aref = max(-v / dt, MuJoCo's without the margin) beyond it, so that it comes back
    """
    data = s.data
    at = np.flatnonzero(data.efc_type == mujoco.mjtConstraint.mjCNSTR_LIMIT_JOINT)
    at = at[s.stiff[data.efc_id[at]]]
    if not at.size:
        return rows, zones
    own, (k, B, impedance, _) = model.mj.jnt_margin[data.efc_id[at]], data.efc_KBIP[at].T
    gap, early, K = data.efc_pos[at] - own, data.efc_margin[at] - own, k * impedance
    back = rows.aref[at] - K * early / (1.0 + B * s.dt + K * s.dt**2)
    stop = -(data.efc_vel[at] + np.maximum(gap, 0.0) / s.dt) / s.dt
    aref = rows.aref.copy()
    aref[at] = np.where(gap > 0.0, stop, np.maximum(stop, back))
    rows = replace(rows, aref=aref)
    zones[at] = rows.zones(np.array(data.qacc_smooth), zones)[at]
    return rows, zones


def merge_frictionless(rows: Rows, zones: Integers, s: Scratch) -> tuple[Rows, Integers]:
    """Replace the pyramid of each frictionless contact by one row along its normal.

    MuJoCo gives such a contact the friction mjMINMU = 1e-5. The edges of its pyramid are then
    nearly the normal, and 1 / (2 mu^2) times as stiff: rounding decides which edges are active, and
    Newton's method does not converge. Their mean is the row of the normal, of stiffness 2 mu^2 D,
    which MuJoCo uses for condim 1.
    """
    contacts = s.data.contact
    used = np.arange(contacts.friction.shape[1]) < contacts.dim[:, None] - 1
    friction = np.where(used, contacts.friction, 0.0).max(axis=1)
    bare = (contacts.dim > 1) & (friction <= mujoco.mjMINMU)
    edge = (rows.contact >= 0) & np.isin(rows.contact, np.flatnonzero(bare))
    if not edge.any():
        return rows, zones
    # group: the number of the new row for each old row
    follows = edge & np.append(False, edge[:-1] & (rows.contact[1:] == rows.contact[:-1]))
    first = np.flatnonzero(~follows)
    group = np.cumsum(~follows) - 1
    count = np.bincount(group)
    mean = csr_array((1.0 / count[group], (group, np.arange(len(group)))))
    D = rows.D[first].copy()
    D[edge[first]] *= 2.0 * contacts.mu[rows.contact[first[edge[first]]]] ** 2
    active = np.zeros(len(first), bool)
    np.logical_or.at(active, group, zones == ACTIVE)
    same = rows.friction[first], rows.kind[first], rows.contact[first]
    merged = Rows(mean @ rows.J, D, mean @ rows.aref, *same)
    return merged, np.where(edge[first], np.where(active, ACTIVE, OFF), zones[first])
