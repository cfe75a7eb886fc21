"""A step of bodies alone, in the package's time scheme, for the tests of this folder."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from flowborne.kernels.arrays import Array
from flowborne.solids.dynamics import assemble
from flowborne.solids.model import SolidModel, SolidState
from flowborne.solids.prescribed import PrescribedSystem, prescribe


def advance_by(
    model: SolidModel,
    state: SolidState,
    dt: float,
    applied: Array | None = None,
    prescribed: Array | None = None,
    hold: Array | None = None,
) -> tuple[SolidState, PrescribedSystem]:
    """q+ = integrate(q, dt v), then v+ = v + dt a(q+), contacts and Coriolis forces settled."""
    none = np.zeros(model.nv)
    driven = model.locked if prescribed is None else prescribed | model.locked
    moved = SolidState(model.integrate(state.q, state.v, dt), state.v)
    force = none if applied is None else applied
    targets = none if hold is None else hold
    system = prescribe(assemble(model, moved, force, dt, state), driven, targets)
    for _ in range(50):
        changed = system.updated(system.velocity)
        if changed is None:
            return SolidState(moved.q, system.velocity), system
        system = changed
    raise AssertionError("contacts and Coriolis forces do not settle")


@pytest.fixture
def advance() -> Callable[..., tuple[SolidState, PrescribedSystem]]:
    return advance_by
