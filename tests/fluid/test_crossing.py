"""What crosses the sides of the domain."""

from __future__ import annotations

import numpy as np
import pytest

from flowborne.coupling.step import step
from flowborne.coupling.world import Fluid, Setup, World
from flowborne.fluid.boundary import Boundaries
from flowborne.fluid.ghosts import packed_sides
from flowborne.fluid.grid import Grid, faces_of
from flowborne.fluid.sides.kinds import BoundaryOpen
from flowborne.fluid.transport import neighbours, planes
from flowborne.kernels.carry import cross_sides, draw_in, fill_ghosts, mark_volumes
from flowborne.kernels.flux import GHOSTS, Fluxes, Padded
from flowborne.solids.model import SolidModel

from ..kernels.references.faces import face_means

OPEN = BoundaryOpen()


@pytest.mark.parametrize("component", [0, 1])
@pytest.mark.parametrize("end", [0, 1])
def test_what_comes_in_has_the_mean_velocity_and_what_leaves_its_own(
    component: int, end: int
) -> None:
    """Of a side that is open, with control volumes of all sizes; nothing crosses the others."""
    grid, random = Grid.slab(7, 6, 0.1, (0.0, 0.0)), np.random.default_rng(5)
    sides = Boundaries(x_max=OPEN) if end else Boundaries(x_min=OPEN)
    flux = grid.zeros_faces()
    flux[0][-end] = random.normal(size=flux[0][-end].shape)
    u, cells = random.normal(size=grid.face_shape(component)), random.random(grid.shape)
    faces = sides.faces(component, grid)
    field = np.pad(u.reshape(faces.shape), [(GHOSTS * (n > 0),) * 2 for n in range(3)])
    table = packed_sides(component, grid, sides, [0.0], faces_of(flux))
    means = neighbours(u.shape[component], False)
    through = Fluxes(planes(faces_of(flux), grid), faces.component, *means)
    padded = Padded(field, np.empty(field.shape, np.uint8))
    mark_volumes(padded.marks, np.zeros(0, np.int64), table, faces)
    cross_sides(table, through, cells.reshape(1, 7, 6), faces)
    fill_ghosts(padded.values, table, 0, faces)
    came = draw_in(padded, table, faces.shape)
    mean = float(np.average(u[-end], weights=face_means(cells, component, False)[-end]))
    rate = (-flux[0] if end else flux[0])[[-end]]
    if component == 1:
        rate = face_means(rate, 1, False)
    expected = float((rate * np.where(rate > 0.0, mean, u[[-end]])).sum())
    assert came == pytest.approx(expected, rel=1e-12)


def test_a_jet_that_comes_in_through_an_open_side_dies_away() -> None:
    """Nothing outside drives it. Of 3 m/s, 0.2 are left; with its own velocity it would have
    1.1 and keep them."""
    grid = Grid.slab(32, 32, 1.0 / 32, (0.0, 0.0))
    fluid = Fluid(grid, 1.0, boundaries=Boundaries(x_max=OPEN))
    world = World.at_rest(Setup(SolidModel.empty(), fluid))
    u = world.flow()[1].velocity[0]
    x, y, _ = np.meshgrid(*grid.face_coordinates(0), indexing="ij")
    u[:] = x * np.where(np.abs(y - 0.5) < 0.15, -3.0, 9.0 / 7.0)
    for _ in range(400):
        assert step(world, 1.0 / 128).outcome.name == "DONE"
    assert world.flow()[1].velocity[0][-1].min() > -0.3
