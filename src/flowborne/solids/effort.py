"""Effort: what the actuators need to hold the present velocities."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from flowborne.solids.dynamics import assemble
from flowborne.solids.model import SolidModel
from flowborne.solids.prescribed import prescribe
from flowborne.solids.state import SolidState

Array = NDArray[np.float64]

ROUNDS = 50
"""Most changes of the set of active contacts and limits."""


def holding(
    model: SolidModel,
    state: SolidState,
    applied: Array,
    dt: float,
    dofs: NDArray[np.int64] | None = None,
) -> Array:
    """Generalised force that keeps the present velocities of `dofs` against every other force.

    The dofs accelerate by nothing, the others fall freely (a slab's locked dofs stay locked). The
    effort of eq. (1) is this force times dt, an impulse.

    applied  (nv,) generalised force besides gravity, springs and contact: the fluid's, the wind's
    dt       s, for the implicit springs and the contacts
    dofs     (k,) held dofs; every dof when None
    returns  (nv,) N or N m, zero on the dofs that are not held
    raises   ValueError when contacts and limits find no consistent set
    source   Lentine et al. 2011, section 2.3
    """
    held = np.ones(model.nv, bool)
    if dofs is not None:
        held[:] = False
        held[dofs] = True
    none = np.zeros(model.nv)
    system = prescribe(assemble(model, state, applied, dt), held | model.locked, state.v)
    for _ in range(ROUNDS):
        v_plus = system.after(none)
        changed = system.updated(v_plus)
        if changed is None:
            return np.where(held, system.actuator(v_plus, none), 0.0)
        system = changed
    raise ValueError(
        f"contacts and limits still change after {ROUNDS} rounds of the held pose. "
        "Use a shorter time step or softer contacts."
    )
