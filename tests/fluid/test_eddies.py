"""Eddies beside bodies go, and momentum and flow without circulation stay."""

from __future__ import annotations

import numpy as np
import pytest

from flowborne import Array, Faces, Grid
from flowborne.fluid.control_volumes import fluid_momentum, kinetic_energy
from flowborne.fluid.transport import Transport, damp_eddies
from flowborne.worlds import Boundaries
from flowborne_validation.worlds import RING

from ..kernels.test_face_masses import BODIES, GRIDS, volumes_at


def transport_past(body: str, grid: Grid, sides: Boundaries, dt: float) -> Transport:
    volumes, _ = volumes_at(body, grid, sides)
    return Transport(grid.zeros_faces(), volumes, volumes, dt, 0.0)


def random_flow(grid: Grid, sides: Boundaries) -> Faces:
    random, velocity = np.random.default_rng(5), grid.zeros_faces()
    for axis in grid.axes:
        velocity[axis][:] = random.normal(size=velocity[axis].shape)
        if sides.periodic()[axis]:
            ends = np.moveaxis(velocity[axis], axis, 0)
            ends[-1] = ends[0]
    return velocity


@pytest.mark.parametrize("sides", [Boundaries(), RING], ids=["closed", "ring"])
@pytest.mark.parametrize("body", BODIES)
@pytest.mark.parametrize("name", GRIDS)
def test_momentum_stays_and_energy_falls(name: str, body: str, sides: Boundaries) -> None:
    grid = GRIDS[name]
    for courant in (0.1, 1.0, 100.0):
        transport = transport_past(body, grid, sides, courant * grid.spacing)
        mass, velocity = transport.after.moving, random_flow(grid, sides)
        before = [u.copy() for u in velocity]
        damp_eddies(velocity, transport, grid, sides)
        changed = sum(float(np.abs(u - b).sum()) for u, b in zip(velocity, before, strict=True))
        was, now = (fluid_momentum(u, mass, grid, sides) for u in (tuple(before), velocity))
        np.testing.assert_allclose(now, was, atol=1e-13 * grid.cell_volume * changed)
        had, has = (kinetic_energy(u, mass, grid, sides) for u in (tuple(before), velocity))
        assert 0.2 * had < has < had


def potential(x: Array, y: Array, z: Array) -> Array:
    return x * y + np.sin(3.0 * x) * np.cosh(2.0 * y) + y * z**2


@pytest.mark.parametrize("body", BODIES)
@pytest.mark.parametrize("name", GRIDS)
def test_flow_without_circulation_stays(name: str, body: str) -> None:
    """Uniform flow among it."""
    grid, sides = GRIDS[name], Boundaries()
    transport = transport_past(body, grid, sides, grid.spacing)
    x, y, z = np.meshgrid(*grid.cell_coordinates(), indexing="ij")
    velocity = grid.zeros_faces()
    for axis in grid.axes:
        inner = tuple(slice(1, -1) if a == axis else slice(None) for a in range(3))
        velocity[axis][inner] = 1.5 + np.diff(potential(x, y, z), axis=axis) / grid.spacing
    before = [u.copy() for u in velocity]
    damp_eddies(velocity, transport, grid, sides)
    for u, b in zip(velocity, before, strict=True):
        np.testing.assert_allclose(u, b, atol=1e-12)
