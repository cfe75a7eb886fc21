"""The force that holds joints, by the system of prescribed dofs."""

from __future__ import annotations

import numpy as np

from flowborne.kernels.arrays import Array, Integers
from flowborne.solids.dynamics import assemble
from flowborne.solids.model import SolidModel, SolidState
from flowborne.solids.prescribed import prescribe


def holding(
    model: SolidModel, state: SolidState, applied: Array, dt: float, dofs: Integers | None = None
) -> Array:
    """(nv,) generalised force that keeps the velocities of `dofs`, all when None, against every
    other force; `applied` (nv,) is one of them."""
    held = np.ones(model.nv, bool)
    if dofs is not None:
        held[:] = False
        held[dofs] = True
    none = np.zeros(model.nv)
    system = prescribe(assemble(model, state, applied, dt), held | model.locked, state.v)
    v_plus = system.after(none)
    assert system.updated(v_plus) is None, "neither contacts nor limits"
    return np.where(held, system.actuator(v_plus, none), 0.0)
