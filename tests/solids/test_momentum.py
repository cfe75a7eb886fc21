"""The compiled sums of momenta and twists, against NumPy's statement of the same."""

from __future__ import annotations

import numpy as np
from numpy.testing import assert_allclose, assert_array_equal

from flowborne.solids.dynamics import assemble
from flowborne.solids.model import SolidModel, SolidState
from flowborne.solids.momentum import (
    MOST_MOMENTA,
    subtree_halfway_momentum,
    subtree_momentum,
    weight,
)
from flowborne.solids.prescribed import prescribe
from flowborne.solids.scratch import scratch, twists_about_origin

CHAIN = """
<mujoco>
  <worldbody>
    <body name="trunk" pos=".1 .2 .3">
      <freejoint/>
      <geom type="box" size=".5 .2 .1" density="1000"/>
      <body name="arm" pos=".5 0 0">
        <joint type="ball"/>
        <geom type="capsule" fromto="0 0 0 .4 .1 0" size=".05" density="1000"/>
        <body name="hand" pos=".4 .1 0">
          <joint type="hinge" axis="0 1 0"/>
          <geom type="sphere" size=".1" density="1000"/>
        </body>
      </body>
    </body>
  </worldbody>
</mujoco>
"""

MODEL = SolidModel.from_string(CHAIN)


def tumbled(seed: int) -> SolidState:
    random, rest = np.random.default_rng(seed), MODEL.rest()
    q = MODEL.integrate(rest.q, random.normal(size=MODEL.nv), 1.0)
    return SolidState(q, random.normal(size=MODEL.nv))


def test_twists_about_origin() -> None:
    random = np.random.default_rng(0)
    cdof, centre = random.normal(size=(9, 6)), random.normal(size=(9, 3))
    turn = cdof[:, :3]
    expected = np.concatenate([cdof[:, 3:] + np.cross(centre, turn), turn], axis=1)
    assert_allclose(twists_about_origin(cdof, centre), expected, rtol=1e-13, atol=1e-14)


def test_weight_acts_at_the_centre_of_each_subtree() -> None:
    s = scratch(MODEL)
    s.place(tumbled(2).q)
    force = MODEL.subtree_mass[:, None] * MODEL.gravity
    expected = np.concatenate([force, np.cross(s.subtree_com, force)], axis=1)
    assert_allclose(weight(MODEL, s), expected, rtol=1e-13, atol=1e-13)


def test_halfway_momenta_are_remembered_by_state_and_step() -> None:
    s, dt = scratch(MODEL), 0.01
    for seed in (*range(2 * MOST_MOMENTA), 0, 1):
        state = tumbled(seed)
        for step in (dt, 2.0 * dt, dt):
            found = subtree_halfway_momentum(MODEL, s, state, step)
            q = MODEL.integrate(state.q, state.v, 0.5 * step)
            assert_array_equal(found, subtree_momentum(MODEL, s, SolidState(q, state.v)))
            assert not found.flags.writeable
        assert len(s.momenta) <= MOST_MOMENTA
    assert subtree_halfway_momentum(MODEL, s, state, dt) is found


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
