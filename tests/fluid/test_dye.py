"""Dye: what enters, what stays, what never happens."""

from __future__ import annotations

import numpy as np
import pytest

from flowborne.fluid.boundary import Boundaries, Source, cells_in
from flowborne.fluid.control_volumes import ControlVolumes, control_volumes
from flowborne.fluid.dye import Passage, carry_dye, nothing_brought
from flowborne.fluid.grid import Grid, faces_of
from flowborne.fluid.sides.kinds import BoundaryInflow, BoundaryOpen, BoundaryPeriodic
from flowborne.fluid.transport import Transport
from flowborne.kernels.arrays import Array, Faces

RING, OPEN = BoundaryPeriodic(), BoundaryOpen()
INFLOW = BoundaryInflow(
    lambda x, y, z, time: (-0.9 + 0.0 * x, 0.4 + 0.0 * x, 0.0 * x),
    {"dye": lambda x, y, z, time: 1.0 * (y > 0.5) + 0.0 * x},
)


def whole(grid: Grid, sides: Boundaries) -> ControlVolumes:
    """Nothing in the way."""
    opened = faces_of([np.ones(grid.face_shape(axis)) for axis in range(3)])
    return control_volumes(np.full(grid.shape, grid.cell_volume), opened, grid, sides)


def carried(
    dye: Array,
    velocity: Faces,
    dt: float,
    grid: Grid,
    sides: Boundaries,
    count: int = 1,
    sources: tuple[Source, ...] = (),
) -> Array:
    """A dye carried by a steady velocity for so many steps, with nothing in the way."""
    uncut = whole(grid, sides)
    flux = faces_of([grid.face_area * u for u in velocity])
    for n in range(count):
        transport = Transport(flux, uncut, uncut, dt, n * dt)
        passage = Passage(transport, nothing_brought(grid), grid, sides, n % 2 == 1)
        done = carry_dye({"dye": dye}, passage, sources)
        assert done.error < 1e-13
        dye = done.scalars["dye"]
    return dye


def uniform(grid: Grid, *velocity: float) -> Faces:
    u, v, w = (np.full(grid.face_shape(axis), velocity[axis]) for axis in range(3))
    return u, v, w


def vortex(grid: Grid) -> Faces:
    """One vortex in a closed unit box, whose faces let nothing through in sum."""
    x, y, _ = (np.arange(n + 1) / n for n in grid.shape)
    psi = np.sin(np.pi * x)[:, None, None] * np.sin(np.pi * y)[None, :, None] / np.pi
    u, v = np.diff(psi, axis=1) / grid.spacing, -np.diff(psi, axis=0) / grid.spacing
    return u, v, grid.zeros_faces()[2]


def swirls(grid: Grid) -> Faces:
    """Random vortices between closed sides."""
    random = np.random.default_rng(5)
    faces = grid.zeros_faces()
    for axis in grid.axes[1:]:
        shape = [n + (a in (axis - 1, axis)) for a, n in enumerate(grid.shape)]
        psi = np.zeros(shape)
        inner = [slice(1, -1) if a in (axis - 1, axis) else slice(None) for a in range(3)]
        psi[tuple(inner)] = grid.spacing * random.normal(size=psi[tuple(inner)].shape)
        faces[axis - 1][:] += np.diff(psi, axis=axis) / grid.spacing
        faces[axis][:] -= np.diff(psi, axis=axis - 1) / grid.spacing
    return faces


@pytest.mark.parametrize("shape", [(12, 9, 1), (8, 7, 6)])
def test_dye_that_is_everywhere_stays_so_to_the_last_bit(shape: tuple[int, int, int]) -> None:
    grid = Grid(shape, 0.1)
    dye = np.full(shape, 0.3)
    np.testing.assert_array_equal(carried(dye, swirls(grid), 0.2, grid, Boundaries(), 4), dye)


@pytest.mark.parametrize("shape", [(12, 9, 1), (8, 7, 6)])
def test_dye_keeps_its_amount_and_its_bounds_in_whatever_flow(shape: tuple[int, int, int]) -> None:
    grid = Grid(shape, 0.1)
    dye = np.random.default_rng(6).integers(0, 2, shape).astype(float)
    for _ in range(10):
        later = carried(dye, swirls(grid), 0.2, grid, Boundaries())
        assert later.sum() == pytest.approx(dye.sum(), rel=1e-14)
        assert dye.min() <= later.min() < later.max() <= dye.max()
        dye = later


@pytest.mark.parametrize("shape", [(20, 17, 1), (16, 14, 12)])
@pytest.mark.parametrize("sides", [Boundaries(), Boundaries(RING, RING), Boundaries(OPEN, INFLOW)])
def test_cells_that_dye_does_not_reach_need_no_look(
    shape: tuple[int, int, int], sides: Boundaries, monkeypatch: pytest.MonkeyPatch
) -> None:
    grid, patch, counts = Grid(shape, 0.1), np.zeros(shape), []
    patch[3:5, 6:9, :5] = np.random.default_rng(7).random((2, 3, min(shape[2], 5)))
    reached = Passage.reached

    def counted(*given):  # type: ignore[no-untyped-def]
        counts.append(np.zeros(shape)[reached(*given)].size)
        return reached(*given)

    def everywhere(*given):  # type: ignore[no-untyped-def]
        return tuple(slice(0, n) for n in shape)

    flow = swirls(grid)
    for u, speed in zip(flow, (-0.9, 0.4, 0.0), strict=True):
        u += speed * (sides != Boundaries())
    monkeypatch.setattr(Passage, "reached", counted)
    found = carried(patch, flow, 0.05, grid, sides, 4)
    monkeypatch.setattr(Passage, "reached", everywhere)
    np.testing.assert_allclose(found, carried(patch, flow, 0.05, grid, sides, 4), atol=1e-15)
    assert min(counts) < 0.8 * patch.size


def test_dye_goes_around_a_ring_and_comes_back() -> None:
    grid = Grid.slab(64, 32, 1.0 / 32, (0.0, 0.0))
    sides = Boundaries(RING, RING, RING, RING)
    x, y, _ = np.meshgrid(*grid.cell_coordinates(), indexing="ij")
    dye = 2.0 + np.sin(np.pi * x) * np.cos(2 * np.pi * y)
    after = carried(dye, uniform(grid, 2.0, 1.0, 0.0), 1.0 / 80, grid, sides, 80)
    np.testing.assert_allclose(after, dye, atol=0.04)
    assert after.sum() == pytest.approx(dye.sum(), rel=1e-9)
    for along in ((1.0, 0.0, 0.0), (0.0, -1.0, 0.0)):
        shifted = carried(dye, uniform(grid, *along), 1.0 / 32, grid, sides, 64)
        np.testing.assert_allclose(shifted, dye, atol=1e-12)


def test_second_order_in_time_in_a_vortex_with_one_step_after_the_other() -> None:
    """The order of the axes turns about from step to step."""
    errors = []
    for n in (32, 64):
        grid = Grid.slab(n, n, 1.0 / n, (0.0, 0.0))
        x, y, _ = np.meshgrid(*grid.cell_coordinates(), indexing="ij")
        dye = np.exp(-((x - 0.5) ** 2 + (y - 0.35) ** 2) / 0.02)
        there = carried(dye, vortex(grid), 0.5 / n, grid, Boundaries(), n)
        back = faces_of([-u for u in vortex(grid)])
        errors.append(np.abs(carried(there, back, 0.5 / n, grid, Boundaries(), n) - dye).mean())
    assert errors[0] > 3.5 * errors[1], errors


def test_nothing_is_lost_by_a_translation_inside_the_box() -> None:
    grid = Grid.slab(64, 32, 1.0 / 32, (0.0, 0.0))
    x, y, _ = np.meshgrid(*grid.cell_coordinates(), indexing="ij")
    dye = np.exp(-((x - 0.5) ** 2 + (y - 0.5) ** 2) / 0.01)
    after = carried(dye, uniform(grid, 1.0, 0.1, 0.0), 0.02, grid, Boundaries(), 40)
    assert after.sum() == pytest.approx(dye.sum(), rel=5e-3)
    assert (x * after).sum() / after.sum() == pytest.approx(0.5 + 0.8, abs=2e-3)
    assert (y * after).sum() / after.sum() == pytest.approx(0.5 + 0.08, abs=2e-3)


def test_bands_in_a_vortex_never_leave_their_values() -> None:
    grid = Grid.slab(64, 64, 1.0 / 64, (0.0, 0.0))
    _, y, _ = np.meshgrid(*grid.cell_coordinates(), indexing="ij")
    dye = (np.floor(16 * y) % 2.0).astype(float)
    faces, total = vortex(grid), dye.sum()
    for _ in range(8):
        dye = carried(dye, faces, 0.5 / 64, grid, Boundaries(), 50)
        assert 0.0 <= dye.min() < dye.max() <= 1.0
        assert dye.sum() == pytest.approx(total, rel=1e-12)


def test_dye_enters_with_an_inflow_and_leaves_through_an_open_side() -> None:
    """A band that is switched on: after a time t as much is there as fills the first u t of the
    channel, until all of it leaves again."""

    def band(x: Array, y: Array, z: Array, time: float) -> Array:
        return np.where((y > 0.25) & (y < 0.75), 1.0, 0.0) + 0 * x

    def stream(x: Array, y: Array, z: Array, time: float) -> tuple[Array, Array, Array]:
        return 1.0 + 0 * x, 0 * x, 0 * x

    grid = Grid.slab(64, 32, 1.0 / 32, (0.0, 0.0))
    sides = Boundaries(x_min=BoundaryInflow(stream, {"dye": band}), x_max=BoundaryOpen())
    dye, there = np.zeros(grid.shape), []
    for _ in range(6):
        dye = carried(dye, uniform(grid, 1.0, 0.0, 0.0), 0.02, grid, sides, 25)
        there.append(dye.sum() * grid.cell_volume)
        assert not dye[:, :7].any()
    np.testing.assert_allclose(there[:3], 0.25 * np.arange(1, 4), rtol=1e-12)
    np.testing.assert_allclose(there[-1], 0.5 * 2.0, rtol=1e-5)
    np.testing.assert_allclose(dye[:, 8:24], 1.0, atol=1e-3)


def test_a_source_keeps_its_dye_for_its_time() -> None:
    grid = Grid.slab(10, 10, 0.1, (0.0, 0.0))
    source = Source((0.2, 0.2, -1), (0.4, 0.5, 1), scalars={"dye": 0.8}, times=(0.0, 0.25))
    box = cells_in(source, grid)
    assert [(s.start, s.stop) for s in box[:2]] == [(2, 4), (2, 5)]
    still = uniform(grid, 0.0, 0.0, 0.0)
    dye = carried(np.zeros(grid.shape), still, 0.1, grid, Boundaries(), 2, (source,))
    assert dye.sum() == pytest.approx(6 * 0.8)
    assert (dye[box] == 0.8).all()
    away = uniform(grid, 1.0, 0.0, 0.0)
    # at 0.3 s the source is over, and the dye has moved on by a cell
    dye = carried(np.where(dye > 0, 0.8, 0.0), away, 0.1, grid, Boundaries(), 3, (source,))
    assert dye[4:7, 2:5].min() > 0.7
