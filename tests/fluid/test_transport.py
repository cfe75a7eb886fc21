"""Flux form on moving control volumes: second order, uniform flow and momentum kept."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pytest

from flowborne.coupling.mouths import at_faces
from flowborne.fluid.boundary import Boundaries
from flowborne.fluid.control_volumes import control_volumes
from flowborne.fluid.ghosts import edge
from flowborne.fluid.grid import Grid, faces_of
from flowborne.fluid.sides.kinds import (
    BoundaryClosed,
    BoundaryInflow,
    BoundaryNoSlip,
    BoundaryOpen,
    BoundaryPeriodic,
)
from flowborne.fluid.transport import COURANT, NO_INLETS, Transport, carry_component
from flowborne.kernels.arrays import Array, Faces
from flowborne.kernels.carry import Inlets

from ..kernels.references.faces import face_means

SLAB = Grid.slab(13, 11, 0.1, (0.0, 0.0))
ROOM = Grid((8, 7, 9), 0.1)
GRIDS = pytest.mark.parametrize("grid", [SLAB, ROOM], ids=["slab", "room"])
DT, SPEED = 0.02, 0.7

CLOSED, OPEN, RING = BoundaryClosed(), BoundaryOpen(), BoundaryPeriodic()
WALL = BoundaryNoSlip()


def blow(x: Array, y: Array, z: Array, time: float) -> tuple[Array, Array, Array]:
    return SPEED + 0 * x, SPEED + 0 * x, SPEED + 0 * x


INFLOW = BoundaryInflow(blow)
KEPT = {
    "closed": Boundaries(),
    "walls": Boundaries(WALL, WALL, CLOSED, CLOSED),
    "ring": Boundaries(RING, RING, RING, RING),
    "ring in y": Boundaries(CLOSED, CLOSED, RING, RING),
}
CROSSED = {
    "inflow and open": Boundaries(INFLOW, OPEN),
    "all open": Boundaries(OPEN, OPEN, OPEN, OPEN),
    "inflow and open in a ring": Boundaries(RING, RING, INFLOW, OPEN),
}


@dataclass
class Case:
    """A step of random control volumes: cut, small, closed ones and such that hold nothing.

    transport  what carries momentum, with V' - V = dt (rate - div q)
    rate       (nx, ny, nz) what comes into each cell from within, m^3/s
    """

    grid: Grid
    sides: Boundaries
    transport: Transport
    rate: Array

    def inlets(self, axis: int) -> Inlets:
        """Fluid of SPEED comes in where the rate is positive; what leaves has the fluid's own."""
        cells = np.flatnonzero(self.rate)
        ways = tuple(np.maximum(sign * self.rate.reshape(-1)[cells], 0.0) for sign in (1.0, -1.0))
        index, (gain, loss) = at_faces(cells, ways, axis, self.grid, self.sides)
        return Inlets(index, gain, np.full(index.size, SPEED), loss)

    def amount(self, velocity: Array, volume: Array, axis: int) -> tuple[float, float]:
        """Sum of V u over distinct faces, m^4/s, and the sum of its parts' sizes."""
        last = -1 if self.sides.periodic()[axis] else None
        own = (volume * velocity)[edge(axis, slice(None, last))]
        return float(own.sum()), float(np.abs(own).sum())


def case_of(grid: Grid, sides: Boundaries, seed: int = 0, inlets: bool = False) -> Case:
    random, periodic = np.random.default_rng(seed), sides.periodic()
    cell = grid.cell_volume
    dead = random.random(grid.shape) < 0.15
    cells = np.where(dead, 0.0, cell * random.uniform(0.35, 1.0, grid.shape))
    cells[random.random(grid.shape) < 0.3] = cell
    cells[dead] = 0.0
    opened, flux = [], []
    for axis in range(3):
        ends = [(int(a == axis),) * 2 for a in range(3)]
        wide = np.pad(dead, ends, mode="wrap" if periodic[axis] else "edge")
        beside = wide[edge(axis, slice(1, None))] | wide[edge(axis, slice(None, -1))]
        o = random.random(grid.face_shape(axis)) * (random.random(beside.shape) > 0.1)
        o[beside] = 0.0
        if axis not in grid.axes:
            o[:] = 0.0
        if periodic[axis]:
            o[edge(axis, -1)] = o[edge(axis, 0)]
        q = 0.05 * cell / DT * random.uniform(-1.0, 1.0, o.shape) * (o > 0.0)
        for end, side in zip((0, -1), sides.pair(axis), strict=True):
            if side.kind in ("closed", "no-slip"):
                q[edge(axis, end)] = 0.0
        if periodic[axis]:
            q[edge(axis, -1)] = q[edge(axis, 0)]
        opened.append(o)
        flux.append(q)
    rate = np.zeros(grid.shape)
    if inlets:
        rate = 0.03 * cell / DT * random.uniform(-1.0, 1.0, grid.shape)
        rate *= ~dead & (random.random(grid.shape) < 0.3)
    net = sum(np.diff(q, axis=axis) for axis, q in enumerate(flux))
    before, after = (
        control_volumes(volumes, faces_of(opened), grid, sides)
        for volumes in (cells, cells + DT * (rate - net))
    )
    return Case(grid, sides, Transport(faces_of(flux), before, after, DT, 0.0), rate)


@GRIDS
@pytest.mark.parametrize("name", KEPT | CROSSED)
@pytest.mark.parametrize("inlets", [False, True])
def test_a_uniform_flow_stays_uniform(grid: Grid, name: str, inlets: bool) -> None:
    """However the volumes change; but at no-slip sides, which are at rest."""
    sides = (KEPT | CROSSED)[name]
    empty = 0
    for seed in range(5):
        case = case_of(grid, sides, seed, inlets)
        for axis in grid.axes:
            if name == "walls" and axis != 0:
                continue
            brought = case.inlets(axis) if inlets else NO_INLETS
            u = np.full(grid.face_shape(axis), SPEED)
            done = carry_component(u, None, axis, case.transport, brought, grid, sides)
            volume = face_means(case.transport.after.cells, axis, sides.periodic()[axis])
            holds = volume > 1e-6 * grid.cell_volume
            assert np.abs(done.velocity[holds] - SPEED).max() < 1e-12
            empty += np.count_nonzero(~holds)
    assert empty > 0


@GRIDS
@pytest.mark.parametrize("name", KEPT)
def test_the_sum_of_momentum_is_kept(grid: Grid, name: str) -> None:
    """With a random field, in closed and periodic domains."""
    for seed in range(5):
        case = case_of(grid, KEPT[name], seed)
        for axis in grid.axes:
            u = np.random.default_rng(seed).standard_normal(grid.face_shape(axis))
            done = carry_component(u, None, axis, case.transport, NO_INLETS, grid, case.sides)
            before, size = case.amount(u, case.transport.before.moving[axis], axis)
            after, _ = case.amount(done.velocity, case.transport.after.moving[axis], axis)
            assert abs(after - before) < 1e-12 * size
            assert done.crossed == 0.0


@GRIDS
@pytest.mark.parametrize("name", KEPT | CROSSED)
def test_what_crosses_sides_and_inlets_is_told(grid: Grid, name: str) -> None:
    """The sum of V u changes by what comes in, with what pressure did on the way or without."""
    sides, crossed = (KEPT | CROSSED)[name], False
    for seed in range(5):
        case = case_of(grid, sides, seed, inlets=True)
        for axis in grid.axes:
            u, along = np.random.default_rng(seed).standard_normal((2, *grid.face_shape(axis)))
            if sides.periodic()[axis]:
                along[edge(axis, -1)] = along[edge(axis, 0)]
            inlets = case.inlets(axis)
            assert inlets.faces.size > 0
            done = carry_component(
                u, along if seed % 2 else None, axis, case.transport, inlets, grid, sides
            )
            before, size = case.amount(u, case.transport.before.moving[axis], axis)
            after, _ = case.amount(done.velocity, case.transport.after.moving[axis], axis)
            brought = DT * float(inlets.gain @ inlets.velocity) - float(done.drained.sum())
            assert abs(after - before - done.crossed - brought) < 1e-12 * size
            assert np.abs(done.drained).max() > 0.0
            crossed = crossed or done.crossed != 0.0
    assert crossed == (name in CROSSED)


def whole(grid: Grid, sides: Boundaries, flux: Faces, dt: float) -> Transport:
    """Transport by fluxes without divergence in a domain that no body cuts."""
    cells = np.full(grid.shape, grid.cell_volume)
    opened = faces_of([np.ones(grid.face_shape(axis)) for axis in range(3)])
    volumes = control_volumes(cells, opened, grid, sides)
    return Transport(flux, volumes, volumes, dt, 0.0)


@pytest.mark.parametrize("component", [0, 1])
def test_a_smooth_field_is_carried_at_second_order(component: int) -> None:
    """In a steady sheared stream through a periodic square."""
    cells, errors, duration = (64, 128, 256), [], 0.5
    sides = KEPT["ring"]
    for n in cells:
        grid = Grid.slab(n, n, 1.0 / n, (0.0, 0.0))
        x, y, _ = np.meshgrid(*grid.face_coordinates(component), indexing="ij")
        flux, steps = grid.zeros_faces(), 3 * n // 4
        flux[0][:] = stream(grid.face_coordinates(0)[1])[:, None] * grid.face_area

        def exact(time: float, x: Array = x, y: Array = y) -> Array:
            along, across = 2.0 * np.pi * (x - time * stream(y)), 2.0 * np.pi * y
            return np.asarray(np.sin(along) + 0.5 * np.cos(along) * np.sin(across))

        transport = whole(grid, sides, flux, duration / steps)
        u = exact(0.0)
        for _ in range(steps):
            u = carry_component(u, None, component, transport, NO_INLETS, grid, sides).velocity
        errors.append(float(np.abs(u - exact(duration)).mean()))
    slope = -np.polyfit(np.log(cells), np.log(errors), 1)[0]
    assert abs(slope - 2.0) < 0.2, f"measured order {slope:.3f}, errors {errors}"
    assert errors[-1] < 1e-3


def stream(y: Array) -> Array:
    """Speed along x, m/s."""
    return np.asarray(0.8 + 0.3 * np.sin(2.0 * np.pi * y))


@GRIDS
@pytest.mark.parametrize("number", [0.5, 0.75, 1.0])
def test_what_flows_aslant_does_not_grow(grid: Grid, number: float) -> None:
    """Across all axes at once, each with this Courant number."""
    sides = Boundaries(RING, RING, RING, RING, *(CLOSED if grid.is_slab else RING,) * 2)
    flux = grid.zeros_faces()
    for axis in grid.axes:
        flux[axis][:] = grid.face_area
    transport = whole(grid, sides, flux, number * grid.spacing)
    u = np.random.default_rng(6).standard_normal(grid.face_shape(0))
    u[-1] = u[0]
    for _ in range(100):
        was = (u[1:] ** 2).sum()
        u = carry_component(u, None, 0, transport, NO_INLETS, grid, sides).velocity
        assert (u[1:] ** 2).sum() <= was


@GRIDS
def test_a_long_step_is_so_many_short_ones(grid: Grid) -> None:
    """Three of the longest that are not split, with an inflow that changes on the way: its faces
    have its velocity after each."""

    def gust(x: Array, y: Array, z: Array, time: float) -> tuple[Array, Array, Array]:
        return 0 * x, time + 0 * x, time + 0 * x

    sides = Boundaries(BoundaryInflow(gust), OPEN)
    flux = grid.zeros_faces()
    flux[0][:] = np.random.default_rng(4).uniform(0.5, 1.0, (1, *grid.shape[1:]))
    dt = (1.0 - 1e-12) * COURANT / whole(grid, sides, flux, 1.0).courant(grid)
    for axis in grid.axes:
        u = np.random.default_rng(axis).standard_normal(grid.face_shape(axis))
        long = whole(grid, sides, flux, 3.0 * dt)
        assert long.courant(grid) == pytest.approx(3.0 * COURANT)
        once = carry_component(u, None, axis, long, NO_INLETS, grid, sides)
        crossed = 0.0
        for n in range(3):
            short = replace(long, dt=dt, time=n * dt)
            done = carry_component(u, None, axis, short, NO_INLETS, grid, sides)
            u, crossed = done.velocity.copy(), crossed + done.crossed
            if axis == 0 and n < 2:
                u[0] = 0.0
        np.testing.assert_allclose(once.velocity, u, atol=1e-13)
        assert once.crossed == pytest.approx(crossed, rel=1e-12, abs=1e-15)


@pytest.mark.parametrize(("crossed", "part"), [(0.0, 1.0), (1.9, 1.0), (8.0, 0.25)])
def test_what_the_last_step_gave_goes_along_for_two_cells(crossed: float, part: float) -> None:
    grid, sides = Grid.slab(8, 8, 0.1, (0.0, 0.0)), KEPT["ring"]
    flux = grid.zeros_faces()
    flux[0][:] = flux[1][:] = 0.5 * grid.face_area
    transport = whole(grid, sides, flux, crossed * grid.spacing)
    assert transport.extrapolated(grid) == pytest.approx(part)


def test_what_an_inflow_holds_does_not_grow() -> None:
    """Noise in the stream behind it, which crosses 40 cells in a step of 200 parts."""
    grid, sides = Grid.slab(16, 12, 0.1, (0.0, 0.0)), Boundaries(INFLOW, OPEN)
    flux = grid.zeros_faces()
    flux[0][:] = grid.face_area * SPEED
    flux[0][:, -1] *= 4.0
    transport = whole(grid, sides, flux, 4.0 / SPEED)
    assert transport.substeps(grid) == 200
    u = SPEED + 1e-3 * np.random.default_rng(3).standard_normal(grid.face_shape(0))
    done = carry_component(u, None, 0, transport, NO_INLETS, grid, sides)
    np.testing.assert_allclose(done.velocity, SPEED, atol=1e-9)
    gained = (transport.after.moving[0] * (done.velocity - u)).sum()
    assert gained == pytest.approx(done.crossed + done.held, abs=1e-12)
