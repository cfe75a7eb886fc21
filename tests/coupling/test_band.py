"""The leak-proof field in a band around the bodies, in grids that are much larger."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from flowborne import Grid, World
from flowborne.bodies import JointCommand
from flowborne.coupling import leak_proof
from flowborne.coupling.band import EVEN, LARGEST, LAYERS, Band, band_around
from flowborne.coupling.bodies_step import move_bodies
from flowborne.coupling.cut import departure
from flowborne.coupling.flow import advect, leak_proof_transport
from flowborne.worlds import (
    Boundaries,
    BoundaryInflow,
    BoundaryOpen,
    advance,
    cut_by_bodies,
    make_world,
    set_velocity,
)
from flowborne_validation.worlds import RING, mjcf

SLAB = Grid.slab(56, 48, 1.0 / 32, (0.0, 0.0))
ROOM = Grid((36, 32, 32), 1.0 / 32, (0.0, 0.0, 0.0))
GRIDS = pytest.mark.parametrize("grid", [SLAB, ROOM], ids=["slab", "room"])
SPEED = 0.7
DT = 1.0 / 64


def block(grid: Grid, sides: Boundaries | None = None) -> World:
    middle = [0.5 * n * grid.spacing for n in grid.shape]
    middle[2] *= not grid.is_slab
    place = " ".join(map(str, middle))
    body = f'<body pos="{place}"><freejoint/><geom type="box" size=".11 .07 .09"/></body>'
    world = make_world(mjcf(body), grid, boundaries=sides or Boundaries(), solid_density=0.5)
    world.solid.v[3:] = [0.0, 0.0, 2.0] if grid.is_slab else [1.1, -0.8, 1.7]
    return world


@pytest.fixture
def solves(monkeypatch: pytest.MonkeyPatch) -> list[tuple[int, ...]]:
    """The shapes that fluxes are corrected in."""
    shapes: list[tuple[int, ...]] = []
    corrected = leak_proof.corrected

    def counted(*given):  # type: ignore[no-untyped-def]
        shapes.append(given[1].shape)
        return corrected(*given)

    monkeypatch.setattr(leak_proof, "corrected", counted)
    return shapes


def is_band(shapes: list[tuple[int, ...]], grid: Grid) -> bool:
    return len(shapes) > 0 and all(np.prod(s) < LARGEST * np.prod(grid.shape) for s in shapes)


@GRIDS
def test_a_uniform_flow_stays_uniform(grid: Grid, solves: list[tuple[int, ...]]) -> None:
    def along(x, y, z, time=0.0):  # type: ignore[no-untyped-def]
        return SPEED + 0 * x, 0 * x, 0 * x

    world = block(grid, Boundaries(BoundaryInflow(along), BoundaryOpen()))
    world.solid.v[0] = SPEED
    _, state = world.flow()
    for _ in range(8):
        set_velocity(world, along)
        start = departure(world)
        move_bodies(world, JointCommand.none(6), DT)
        transport = leak_proof_transport(world, start, cut_by_bodies(world), DT)
        advected, _ = advect(world, start, state.velocity, transport)
        for axis in grid.axes:
            holds = transport.after.moving[axis] > 1e-9 * grid.cell_volume
            expected = SPEED if axis == 0 else 0.0
            assert np.abs(advected.velocity[axis][holds] - expected).max() < 1e-12
        state.cell_volume, state.pose = advected.volumes.cells, world.solid.q.copy()
    assert is_band(solves, grid)


@GRIDS
def test_whole_cells_stay_whole_and_cut_ones_as_they_are_cut(
    grid: Grid, solves: list[tuple[int, ...]]
) -> None:
    """The band's volume is that of the cut to a part of it; and the budget of momentum closes."""
    world = block(grid)
    advance(world, DT)
    solves.clear()
    for _ in range(30):
        assert advance(world, DT).momentum_budget_error < 1e-10
        cells, cut, whole = world.flow()[1].cell_volume, cut_by_bodies(world), grid.cell_volume
        plain = cut.volume == whole
        assert np.abs(cells - whole)[plain].max() < 1e-11 * whole
        holds = ~plain & (cut.volume > 0.01 * whole)
        assert np.abs(cells[holds] / cut.volume[holds] - 1.0).max() < 0.02
    assert is_band(solves, grid)


@GRIDS
def test_dye_keeps_its_amount_and_bounds_whatever_pressures_leave(
    grid: Grid, solves: list[tuple[int, ...]]
) -> None:
    rough = block(grid)
    fluid = replace(rough.flow()[0], tolerance=1e-5, scalars=("dye",))
    world = World.at_rest(rough.setup.but(fluid=fluid))
    world.solid.v[:] = rough.solid.v
    dye = np.random.default_rng(0).integers(0, 2, grid.shape).astype(float)
    world.flow()[1].scalars["dye"][:] = dye
    for _ in range(30):
        assert advance(world, DT).dye_budget_error < 1e-14
        dye = world.flow()[1].scalars["dye"]
        assert 0.0 <= dye.min() < dye.max() <= 1.0
    assert is_band(solves[1:], grid)


def test_a_flow_that_was_put_in_is_corrected_everywhere(solves: list[tuple[int, ...]]) -> None:
    world = block(SLAB)
    set_velocity(world, lambda x, y, z: (np.sin(3 * x), 0 * x, 0 * x))
    advance(world, DT)
    assert SLAB.shape in solves


@pytest.mark.parametrize(("factor", "whole"), [(0.8, False), (1.6, True)])
def test_volumes_off_by_what_the_pressure_leaves_are_left(
    factor: float, whole: bool, solves: list[tuple[int, ...]]
) -> None:
    world = block(SLAB)
    advance(world, DT)
    solves.clear()
    state = world.flow()[1]
    world.volumes = None
    state.cell_volume[1, 1] += factor * 1e-8 * SLAB.cell_volume
    advance(world, DT)
    assert (SLAB.shape in solves) == whole


@pytest.mark.parametrize(("part", "whole"), [(0.016, False), (0.024, True)])
def test_a_band_that_lacks_more_than_its_cut_cells_may_give_becomes_the_grid(
    part: float, whole: bool, solves: list[tuple[int, ...]]
) -> None:
    world = block(SLAB)
    advance(world, DT)
    solves.clear()
    state, cut = world.flow()[1], cut_by_bodies(world)
    partly = (cut.volume > 0.0) & (cut.volume < SLAB.cell_volume)
    world.volumes = None
    state.cell_volume[partly] += part * (cut.volume * (1.0 - cut.volume / SLAB.cell_volume))[partly]
    advance(world, DT)
    assert (SLAB.shape in solves) == whole


def around(first: list[int], last: list[int], sides: Boundaries | None = None) -> Band | None:
    cells = np.zeros(SLAB.shape, np.uint8)
    cells[tuple(first)] = cells[tuple(last)] = 1
    return band_around(cells, SLAB, sides or Boundaries())


def test_a_band_has_layers_around_the_cells_and_whole_eights_of_them() -> None:
    band = around([30, 10, 0], [41, 14, 0])
    assert band is not None
    assert band.grid.shape == (24, 16, 1)
    assert band.cells == (slice(24, 48), slice(5, 21), slice(0, 1))
    assert (EVEN, LAYERS) == (8, 3)
    again = around([40, 10, 0], [51, 14, 0])
    assert again is not None
    assert again.cells[0] == slice(32, 56)


def test_the_band_is_the_grid_where_it_is_half_of_it_or_reaches_a_side() -> None:
    assert around([6, 6, 0], [29, 33, 0]) is not None  # 32 x 40 of 56 x 48
    assert around([6, 6, 0], [40, 33, 0]) is None  # 48 x 40
    assert around([2, 10, 0], [9, 14, 0]) is None
    assert around([3, 10, 0], [9, 14, 0]) is not None
    assert around([30, 10, 0], [41, 45, 0]) is None
    assert around([30, 10, 0], [41, 14, 0], RING) is None
    assert band_around(np.zeros(SLAB.shape, np.uint8), SLAB, Boundaries()) is None
