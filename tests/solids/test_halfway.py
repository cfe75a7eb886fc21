"""The compiled impulse of the forces half-way through a step, against NumPy's statement of it."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from flowborne.kernels.momentum import OF_THE_WHOLE, ROUNDING, momentum_impulse
from flowborne.solids.dynamics import assemble
from flowborne.solids.model import SolidModel
from flowborne.solids.momentum import twists_about_origin
from flowborne.solids.prescribed import prescribe
from flowborne.solids.state import SolidState

from .test_momentum import CHAIN, tumbled

MODEL = SolidModel.from_string(CHAIN)


@pytest.mark.parametrize("dofs", [0, 8])
def test_momentum_impulse(dofs: int) -> None:
    random, dt = np.random.default_rng(dofs), 0.2
    cdof, centre = random.normal(size=(dofs, 6)), random.normal(size=(dofs, 3))
    along = twists_about_origin(cdof, centre)
    given, later = random.normal(size=(2, 5, 6))
    body, conserved = random.integers(5, size=dofs), random.uniform(size=dofs) < 0.5
    gained, still, bias, outer = random.normal(size=(4, dofs))
    change = gained + (along * (given - later)[body]).sum(axis=1)
    expected = still + np.where(conserved, change, -dt * bias) + dt * outer
    scale = (np.abs(along) * (np.abs(given) + np.abs(later))[body]).sum(axis=1)
    room = ROUNDING * (scale + dt * np.abs(outer)) + OF_THE_WHOLE * scale.max(initial=0.0)
    impulse, rounding = momentum_impulse(
        cdof, centre, given, later, body, conserved, gained, still, bias, outer, dt
    )
    assert_allclose(impulse, expected, rtol=1e-13, atol=1e-13)
    assert_allclose(rounding, room, rtol=1e-13)


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
