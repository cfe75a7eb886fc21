"""A step of bodies alone, in the package's time scheme, for the tests of this folder."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pytest
from numpy.typing import NDArray

from flowborne.solids.dynamics import assemble
from flowborne.solids.model import SolidModel
from flowborne.solids.prescribed import PrescribedSystem, prescribe
from flowborne.solids.state import SolidState

Array = NDArray[np.float64]


@dataclass
class Advance:
    """q+ = integrate(q, dt v), then v+ = v + dt a(q+).

    The forces of inertia are centred by `passes` solves.
    """

    passes: int = 2

    def __call__(
        self,
        model: SolidModel,
        state: SolidState,
        dt: float,
        applied: Array | None = None,
        prescribed: Array | None = None,
        hold: Array | None = None,
    ) -> tuple[SolidState, PrescribedSystem]:
        none = np.zeros(model.nv)
        driven = model.locked if prescribed is None else prescribed | model.locked
        moved = SolidState(model.integrate(state.q, state.v, dt), state.v)
        bias_velocity = None
        for _ in range(self.passes):
            system = prescribe(
                assemble(
                    model,
                    moved,
                    none if applied is None else applied,
                    dt,
                    before=state,
                    bias_velocity=bias_velocity,
                ),
                driven,
                none if hold is None else hold,
            )
            for _ in range(50):
                v_plus = system.after(none)
                changed = system.updated(v_plus)
                if changed is None:
                    break
                system = changed
            bias_velocity = 0.5 * (state.v + v_plus)
        return SolidState(moved.q, v_plus), system


@pytest.fixture
def advance() -> Callable[..., tuple[SolidState, PrescribedSystem]]:
    return Advance()
