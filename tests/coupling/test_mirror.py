"""A flow and its mirror image stay mirror images."""

from __future__ import annotations

import numpy as np
import pytest

from flowborne.coupling.step import step
from flowborne.coupling.world import Fluid, Setup, World
from flowborne.fluid.grid import Grid
from flowborne.solids.model import SolidModel


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_a_mirrored_flow_is_carried_as_the_flow_itself(axis: int) -> None:
    grid = Grid((10, 10, 10), 0.1)
    fluid = Fluid(grid, 1.0, tolerance=1e-13)
    worlds = [World.at_rest(Setup(SolidModel.empty(), fluid)) for _ in range(2)]
    random = np.random.default_rng(4)
    for d in range(3):
        noise = random.normal(size=grid.face_shape(d))
        for world, values in zip(worlds, (noise, np.flip(noise, axis)), strict=True):
            world.flow()[1].velocity[d][:] = -values if d == axis and world is worlds[1] else values
    for world in worlds:
        step(world, 1e-6)  # frees the noise of divergence
        for d in range(3):
            world.flow()[1].acceleration[d][:] = 0.0
        for _ in range(3):
            step(world, 0.02)
    for d in range(3):
        first, second = (world.flow()[1].velocity[d] for world in worlds)
        turned = np.flip(second, axis) * (-1.0 if d == axis else 1.0)
        np.testing.assert_allclose(turned, first, atol=1e-9)
