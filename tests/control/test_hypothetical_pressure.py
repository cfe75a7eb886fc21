"""What hypothetical steps save on their pressure solve costs no gradient."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from flowborne.control.controller import Controller
from flowborne.coupling.step import step
from flowborne.coupling.world import World
from flowborne.scenes.load import load_scene
from flowborne.sim.simulation import Simulation

BLOCK = {"domain.resolution": "64"}
FLYER = {"domain.resolution": "20"}
SWIMMER = {
    "domain.lower": "[-8.0, -8.0, -10.0]",
    "domain.upper": "[8.0, 8.0, 6.0]",
    "domain.resolution": "32",
}


def gradient(controller: Controller, world: World) -> np.ndarray:
    """(n,) of the objectives in force, per rad."""
    parts = []
    for places, wanted in controller.objective.group_by_joints(controller.dofs):
        if wanted.active(world.time):
            trials = controller.trials(world, step, None, wanted, places)
            estimate = controller.gradient.of(places, np.ones(places.size)).estimate(trials)
            parts.append(estimate.gradient)
    return np.concatenate(parts)


@pytest.mark.parametrize(
    ("scene", "settings"),
    [
        ("ns-block-effort", BLOCK),
        ("ns-block-drag-min", BLOCK),
        ("ns-block-drag-max", BLOCK),
        ("ns-chain-4", BLOCK),
        ("flyer-twist", FLYER),
        ("flyer-flesh", FLYER),
        ("swimmer", SWIMMER),
    ],
)
def test_the_gradient_is_that_of_the_full_solve(
    scene: str, settings: dict[str, str], monkeypatch: pytest.MonkeyPatch
) -> None:
    with Simulation(load_scene(scene, settings), workers=1) as simulation:
        for _ in range(2):
            simulation.advance_frame()
        controller, world = simulation.controller, simulation.world
        assert controller is not None
        quick = gradient(controller, world)
        assert world.setup.hypothetical.fluid.tolerance > world.setup.fluid.tolerance
        monkeypatch.setattr("flowborne.coupling.world.TRIAL_TOLERANCE", 0.0)
        world.setup = replace(world.setup)
        full = gradient(controller, world)
    assert world.setup.hypothetical.fluid == world.setup.fluid
    assert np.abs(full).max() > 0.0
    np.testing.assert_allclose(quick, full, rtol=0.0, atol=0.05 * np.abs(full).max())
    assert not np.array_equal(quick, full)
