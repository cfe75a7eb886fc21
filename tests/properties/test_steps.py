"""What every step keeps, whatever the bodies, their joints, the sides and the grid."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from flowborne import Array, World, step
from flowborne.worlds import kinetic_energy
from flowborne_validation.worlds import start_at_once

from .worlds import DT, UNSHRUNK, WALLS, H, cases

TOLERANCE = 1e-10
ROUNDING = 1e-12
"""Of an impulse, relative to all impulses given to faces and bodies."""

STEPS = 3


def state_of(world: World) -> Array:
    """All numbers of the fluid and of the bodies."""
    _, flow = world.flow()
    parts = (*flow.velocity, *flow.acceleration, flow.pressure, world.solid.q, world.solid.v)
    return np.concatenate([np.ravel(part) for part in parts])


@pytest.mark.parametrize("slab", [True, False], ids=["slab", "room"])
@settings(max_examples=40, phases=UNSHRUNK)
@given(data=st.data())
def test_steps_end_finite_without_divergence_and_with_a_closed_budget(
    slab: bool, data: st.DataObject
) -> None:
    world = data.draw(cases(slab)).world(tolerance=TOLERANCE)
    for number in range(STEPS + 1):
        report = step(world, DT) if number else start_at_once(world, 1e-6)
        assert report.outcome.name == "DONE"
        assert np.isfinite(state_of(world)).all()
        assert report.residual <= TOLERANCE
        assert report.divergence <= 10.0 * TOLERANCE * report.fastest / H
        assert report.momentum_exchange_error <= ROUNDING
        assert report.momentum_budget_error <= ROUNDING


@pytest.mark.parametrize("slab", [True, False], ids=["slab", "room"])
@settings(max_examples=20, phases=UNSHRUNK)
@given(data=st.data())
def test_without_walls_momentum_changes_by_weight_alone(slab: bool, data: st.DataObject) -> None:
    """Less Archimedes' force: what drives the whole is the weight of the difference in density."""
    case = data.draw(cases(slab, ("periodic",), joints=("free",)))
    gravity = np.array(data.draw(st.tuples(*[st.floats(-1.0, 1.0)] * (2 if slab else 3))))
    gravity = np.append(gravity, np.zeros(3 - gravity.size))
    world = case.world(tolerance=TOLERANCE, gravity=tuple(gravity))
    solid, density = world.setup.solid, world.flow()[0].density
    weight = gravity * (solid.body_mass.sum() - density * solid.volume.sum())
    start_at_once(world, 1e-6)
    wholes = []
    for _ in range(STEPS):
        report = step(world, DT)
        wholes.append(report.momentum_fluid + report.momentum_solid)
    gained = np.diff(wholes, axis=0)
    bound = 1e-10 * np.abs(wholes).max()
    np.testing.assert_allclose(gained, np.tile(DT * weight, (STEPS - 1, 1)), atol=bound)


@pytest.mark.parametrize("slab", [True, False], ids=["slab", "room"])
@settings(max_examples=20, phases=UNSHRUNK)
@given(data=st.data())
def test_without_forcing_energy_falls(slab: bool, data: st.DataObject) -> None:
    """Of fluid and bodies together, in flows that the grid does not resolve."""
    world = data.draw(cases(slab, WALLS)).world(tolerance=TOLERANCE)
    start_at_once(world, 1e-6)
    energies = [kinetic_energy(world)]
    for _ in range(STEPS):
        step(world, DT)
        energies.append(kinetic_energy(world))
    assert (np.diff(energies) < 0.0).all()
