"""The projection leaves no divergence, whatever the sides and sources."""

from __future__ import annotations

import numpy as np
import pytest

from flowborne.coupling.cut import source_rate
from flowborne.coupling.step import step
from flowborne.coupling.world import Fluid, Setup, World
from flowborne.fluid.boundary import Boundaries, Source
from flowborne.fluid.ghosts import edge, impose_sides
from flowborne.fluid.grid import Grid, faces_of
from flowborne.fluid.projection import face_weights, pressure_gradient
from flowborne.fluid.sides.kinds import (
    BoundaryClosed,
    BoundaryInflow,
    BoundaryNoSlip,
    BoundaryOpen,
    BoundaryPeriodic,
)
from flowborne.kernels.arrays import Array, Faces
from flowborne.kernels.projection import net_out
from flowborne.solids.model import SolidModel
from flowborne.solvers.pressure import PressureSystem

SLAB = Grid.slab(24, 20, 0.1, (0.0, 0.0))
CUBE = Grid((12, 10, 8), 0.1, (0.0, 0.0, 0.0))
DENSITY, TOLERANCE = 3.0, 1e-10


def parabola(x: Array, y: Array, z: Array, time: float) -> tuple[Array, Array, Array]:
    return 1.5 + y * (2.0 - y) + 0 * x, 0.3 + 0 * (x + y), 0 * (x + y)


INFLOW, OPEN, RING = BoundaryInflow(parabola), BoundaryOpen(), BoundaryPeriodic()
CLOSED, WALL = BoundaryClosed(), BoundaryNoSlip()

SIDES = {
    "closed": Boundaries(),
    "inflow and open": Boundaries(INFLOW, OPEN),
    "all open": Boundaries(OPEN, OPEN, OPEN, OPEN),
    "no-slip and open": Boundaries(WALL, OPEN, WALL, WALL),
    "ring": Boundaries(RING, RING, RING, RING),
    "ring in y, inflow and open in x": Boundaries(INFLOW, OPEN, RING, RING),
}


def random_faces(grid: Grid) -> Faces:
    random = np.random.default_rng(8)
    u, v, w = (random.normal(size=grid.face_shape(axis)) for axis in range(3))
    if grid.is_slab:
        w[:] = 0.0
    return u, v, w


def all_open(grid: Grid) -> Faces:
    """Open parts of the faces without bodies."""
    u, v, w = (np.ones(grid.face_shape(axis)) for axis in range(3))
    return u, v, 0.0 * w if grid.is_slab else w


def net_outflow(velocity: Faces, opened: Faces, grid: Grid) -> Array:
    """(nx, ny, nz) m^3/s."""
    net = np.empty(grid.shape)
    net_out(net, *(part * u for part, u in zip(opened, velocity, strict=True)))
    return net * grid.face_area


def volumes_of(opened: Faces, grid: Grid, sides: Boundaries) -> Faces:
    """a V of every face, half of it on the sides of the domain."""
    volumes = faces_of([grid.cell_volume * o for o in opened])
    for axis, volume in enumerate(volumes):
        for end in () if sides.periodic()[axis] else (0, -1):
            volume[edge(axis, end)] *= 0.5
    return volumes


def project(velocity: Faces, opened: Faces, grid: Grid, sides: Boundaries, rate: Array) -> Array:
    """Make `velocity` free of divergence but for the sources, in place; gives p^."""
    gradient = pressure_gradient(opened, volumes_of(opened, grid, sides), DENSITY, grid, sides)
    system = PressureSystem(face_weights(opened, gradient.rate, grid), sides.periodic())
    need = rate - net_outflow(velocity, opened, grid)
    solution = system.solve(need, tolerance=TOLERANCE)
    assert solution.converged
    assert solution.residual < TOLERANCE
    gradient.subtract(velocity, solution.pressure, 1.0)
    return solution.pressure


@pytest.mark.parametrize("grid", [SLAB, CUBE], ids=["slab", "cube"])
@pytest.mark.parametrize("name", SIDES)
def test_projected_flow_is_free_of_divergence(name: str, grid: Grid) -> None:
    sides, velocity, opened = SIDES[name], random_faces(grid), all_open(grid)
    impose_sides(velocity, grid, sides, 0.0)
    none = np.zeros(grid.shape)
    start = np.linalg.norm(net_outflow(velocity, opened, grid))
    kept = [velocity[0][0].copy(), velocity[1][:, 0].copy()]
    project(velocity, opened, grid, sides, none)
    assert np.linalg.norm(net_outflow(velocity, opened, grid)) < 1.01 * TOLERANCE * start
    if sides.x_min.kind not in ("open", "periodic"):
        np.testing.assert_array_equal(velocity[0][0], kept[0])
    if sides.y_min.kind not in ("open", "periodic"):
        np.testing.assert_array_equal(velocity[1][:, 0], kept[1])


@pytest.mark.parametrize("grid", [SLAB, CUBE], ids=["slab", "cube"])
def test_what_is_taken_away_is_orthogonal_to_what_is_left(grid: Grid) -> None:
    """Helmholtz: a gradient and a field without divergence, weighed by the faces' mass."""
    sides, velocity, opened = Boundaries(x_max=OPEN), random_faces(grid), all_open(grid)
    impose_sides(velocity, grid, sides, 0.0)
    before = [values.copy() for values in velocity]
    project(velocity, opened, grid, sides, np.zeros(grid.shape))
    taken = [a - b for a, b in zip(before, velocity, strict=True)]
    taken[0][-1] *= 0.5  # the face on the open side has half a cell
    work = sum(float(np.vdot(a, b)) for a, b in zip(taken, velocity, strict=True))
    assert abs(work) < 1e-8 * sum(float(np.vdot(a, a)) for a in taken)


def test_sources_and_cut_faces_are_balanced_by_the_open_side() -> None:
    """What a source makes leaves through the open side, around faces that are partly closed."""
    sides, velocity = Boundaries(x_max=OPEN), SLAB.zeros_faces()
    opened = all_open(SLAB)
    opened[0][10, 5:15] = 0.0
    opened[1][14, 3:9] = 0.35
    fluid = Fluid(
        SLAB, DENSITY, boundaries=sides, sources=(Source((0.3, 0.5, -1), (0.7, 0.9, 1), 0.8),)
    )
    rate = source_rate(fluid, 0.0, opened)
    assert rate.sum() == pytest.approx(0.8, rel=1e-12)
    assert np.count_nonzero(rate) == 16
    project(velocity, opened, SLAB, sides, rate)
    np.testing.assert_allclose(net_outflow(velocity, opened, SLAB), rate, atol=1e-9)
    leaves = SLAB.face_area * (opened[0][-1] * velocity[0][-1]).sum()
    assert leaves == pytest.approx(0.8, rel=1e-8)
    assert not velocity[0][10, 5:15].any()


def test_hydrostatic_force_becomes_pressure_and_nothing_moves() -> None:
    """A uniform push in a closed box: the pressure's gradient, exactly."""
    velocity, opened = SLAB.zeros_faces(), all_open(SLAB)
    velocity[1][:] = -2.0
    impose_sides(velocity, SLAB, Boundaries(), 0.0)
    pressure = project(velocity, opened, SLAB, Boundaries(), np.zeros(SLAB.shape))
    assert max(float(np.abs(u).max()) for u in velocity) < 1e-8
    np.testing.assert_allclose(np.diff(pressure[:, :, 0], axis=1), -2.0 * DENSITY * 0.1, rtol=1e-7)


@pytest.mark.parametrize("grid", [SLAB, CUBE], ids=["slab", "cube"])
def test_a_stepped_flow_with_inflow_source_and_driven_region_has_no_divergence(grid: Grid) -> None:
    """Whole steps, with a jet that is switched off on the way: the report's own largest value."""
    jet = Source((0.5, 0.4, -1.0), (0.7, 0.6, 1.0), volume_rate=0.4, times=(0.0, 0.1))
    fan = Source((0.9, 0.5, -1.0), (1.1, 0.8, 1.0), velocity=(0.0, 2.0, 0.0))
    fluid = Fluid(grid, DENSITY, boundaries=Boundaries(INFLOW, OPEN), sources=(jet, fan))
    world = World.at_rest(Setup(SolidModel.empty(), fluid))
    for n in range(8):
        report = step(world, 0.025)
        assert report.outcome.name == "DONE"
        _, state = world.flow()
        net = net_outflow(state.velocity, all_open(grid), grid)
        rate = source_rate(fluid, world.time, all_open(grid))
        assert rate.sum() == pytest.approx(0.4 if n < 3 else 0.0, abs=1e-12)
        largest = np.abs(net - rate).max() / grid.cell_volume
        assert largest < 1e-6
        assert report.divergence == pytest.approx(largest, abs=1e-12)
        through = (state.velocity[0][-1].sum() - state.velocity[0][0].sum()) * grid.face_area
        assert through == pytest.approx(rate.sum(), abs=1e-8)
