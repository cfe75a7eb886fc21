"""A flow that the grid does not resolve makes no energy."""

from __future__ import annotations

import numpy as np

from flowborne.coupling.step import step
from flowborne.coupling.world import Fluid, Setup, World
from flowborne.fluid.grid import Grid
from flowborne.solids.model import SolidModel


def test_noise_in_a_closed_box_gains_no_energy() -> None:
    """Values of third order damp what the grid does not resolve, and never feed it."""
    grid = Grid((12, 12, 12), 1.0 / 12.0)
    world = World.at_rest(Setup(SolidModel.empty(), Fluid(grid, 1.0)))
    state, random = world.flow()[1], np.random.default_rng(3)
    for axis in range(3):
        state.velocity[axis][:] = random.normal(size=grid.face_shape(axis))
    step(world, 1e-6)
    energies = []
    for axis in range(3):
        state.acceleration[axis][:] = 0.0
    for _ in range(80):
        assert step(world, 0.01).outcome.name == "DONE"
        energies.append(sum(float((u * u).sum()) for u in state.velocity))
    assert (np.diff(energies) < 0.0).all()
