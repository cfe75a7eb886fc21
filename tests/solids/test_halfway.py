"""The impulse of the forces half-way through a step."""

from __future__ import annotations

import numpy as np
from numpy.testing import assert_allclose, assert_array_equal

from flowborne.solids.dynamics import assemble
from flowborne.solids.model import SolidModel
from flowborne.solids.prescribed import prescribe
from flowborne.solids.state import SolidState

from .test_momentum import CHAIN, tumbled

MODEL = SolidModel.from_string(CHAIN)


def test_the_impulse_depends_on_the_velocity_alone() -> None:
    """What is remembered of the last one changes nothing."""
    before, dt = tumbled(3), 0.01
    moved = SolidState(MODEL.integrate(before.q, before.v, dt), before.v)
    halfway = assemble(MODEL, moved, np.zeros(MODEL.nv), dt, before).halfway
    assert halfway is not None
    one, other = tumbled(4).v, tumbled(5).v
    first = [part.copy() for part in halfway.impulse(one)]
    assert not np.array_equal(halfway.impulse(other)[0], first[0])
    for _ in range(2):
        for now, then in zip(halfway.impulse(one), first, strict=True):
            assert_array_equal(now, then)


def test_a_good_guess_settles_driven_joints_at_once() -> None:
    """With every joint driven the velocity after the step is known before it."""
    before, hold, dt = tumbled(6), tumbled(7).v, 0.01
    moved = SolidState(MODEL.integrate(before.q, before.v, dt), before.v)
    none, all_driven = np.zeros(MODEL.nv), np.ones(MODEL.nv, bool)
    guessed = prescribe(assemble(MODEL, moved, none, dt, before, hold), all_driven, hold)
    assert guessed.updated(hold) is None
    plain = prescribe(assemble(MODEL, moved, none, dt, before), all_driven, hold)
    settled = plain.updated(hold)
    assert settled is not None
    assert settled.updated(hold) is None
    expected = settled.actuator(hold, none)
    assert_allclose(
        guessed.actuator(hold, none), expected, rtol=0, atol=1e-12 * abs(expected).max()
    )
