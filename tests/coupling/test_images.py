"""Bodies across a periodic side: no place in the domain differs from another."""

from __future__ import annotations

import numpy as np
import pytest

from flowborne import Array, Grid, Outcome, World, step
from flowborne.worlds import cut_by_bodies, make_world
from flowborne_validation.worlds import PLANAR, RING, mjcf

from .test_far_swept import AROUND
from .test_flesh_in_flow import leg

SLAB = Grid.slab(32, 24, 1.0 / 24.0, (-0.3, -0.2))
ROOM = Grid((20, 16, 16), 1.0 / 16.0, (-0.3, -0.2, -0.5))
CHAIN = mjcf(
    f"<body pos='0.27 0.3 0'>{PLANAR}"
    "<geom type='capsule' fromto='0 0 0 .25 0 0' size='.06'/>"
    "<body pos='.25 0 0'><joint axis='0 0 1'/>"
    "<geom type='capsule' fromto='0 0 0 .2 0 0' size='.07'/></body></body>"
)
BALL = mjcf(
    "<body pos='0.27 0.31 0.1' euler='0.3 0.2 0.4'><freejoint/>"
    "<geom type='ellipsoid' size='.2 .25 .15'/></body>"
)
START = {"slab": (SLAB, CHAIN, 0.02), "room": (ROOM, BALL, 0.0), "flesh": (ROOM, leg(0.34), 0.0)}


def translation(world: World, velocity: tuple[float, float, float]) -> Array:
    """(nv,) generalised velocity of bodies and flesh that move alike."""
    model, axes = world.setup.solid, list(world.flow()[0].grid.axes)
    v = np.zeros(model.nv)
    v[axes] = np.array(velocity)[axes]
    if model.flesh is not None:
        v[model.flesh.dofs] = np.tile(velocity, np.count_nonzero(model.flesh.dofs) // 3)
    return v


def distinct(world: World) -> list[Array]:
    """Velocities on open faces, without the last ones along an axis, which are the first ones."""
    opened, velocity = cut_by_bodies(world).open, world.flow()[1].velocity
    axes = world.flow()[0].grid.axes
    return [np.delete(velocity[axis] * (opened[axis] > 0.0), -1, axis) for axis in axes]


@pytest.mark.parametrize("case", START)
@pytest.mark.parametrize("cells", [(14, 0, 0), (61, -37, 0)])
def test_no_place_differs_from_another(case: str, cells: tuple[int, int, int]) -> None:
    """Bodies that drift and turn, in the middle and across the sides, one and more rounds away."""
    grid, model, viscosity = START[case]
    sides = RING if grid.is_slab else AROUND
    given = {} if case == "flesh" else {"solid_density": 0.7}
    one = make_world(model, grid, boundaries=sides, viscosity=viscosity, **given)
    if grid.is_slab:
        one.solid.q[2] = 0.3
    other = one.copy()
    x, y, z = (n * grid.spacing for n in cells)
    solid, model = other.solid, other.setup.solid
    solid.q[:] = model.integrate(solid.q, translation(other, (x, y, z)), 1.0)
    for world in (one, other):
        world.solid.v[:] = translation(world, (0.8, -0.6, 0.4))
        world.solid.v[3] += 1.5  # a hinge, or the turn of what is free
        reports = [step(world, 0.02) for _ in range(4)]
        assert all(report.outcome is Outcome.DONE for report in reports)
        assert max(report.momentum_budget_error for report in reports) < 1e-10
    assert np.abs(one.solid.v - other.solid.v).max() < 1e-8
    for u, v in zip(distinct(one), distinct(other), strict=True):
        assert np.abs(np.roll(u, cells, (0, 1, 2)) - v).max() < 1e-8
