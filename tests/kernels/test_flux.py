"""What flows out of control volumes and what is left in them, against NumPy."""

from __future__ import annotations

import numpy as np
import pytest

from flowborne.fluid.transport import neighbours
from flowborne.kernels.flux import (
    CLEAR,
    CUT,
    GHOSTS,
    UPSTREAM,
    Fluxes,
    Padded,
    Stage,
    largest_crossing,
    pad_field,
    stage,
)

from .cut_cells import face_shape
from .references.flux import largest_crossing_reference, side_fluxes_reference, stage_reference

Shape = tuple[int, ...]

CASES = [((5, 7, 6), c) for c in range(3)] + [((1, 9, 8), 1), ((1, 9, 8), 2), ((17, 4, 5), 0)]
COMPONENTS = pytest.mark.parametrize(("cells", "component"), CASES)
ENDS = pytest.mark.parametrize("periodic", [False, True])


def padded(shape: Shape) -> Shape:
    return tuple(n + 2 * GHOSTS * (n > 1) for n in shape)


def fluxes(cells: Shape, random: np.random.Generator) -> tuple[np.ndarray, ...]:
    """Random through all faces; none across the first axis of a slab."""
    return tuple(random.standard_normal(face_shape(cells, a)) * (cells[a] > 1) for a in range(3))


def net_of(field: np.ndarray, marks: np.ndarray, q: tuple, component: int) -> np.ndarray:
    """What leaves each control volume per time."""
    shape = face_shape((q[1].shape[0], q[0].shape[1], q[0].shape[2]), component)
    nothing, kept = np.zeros(shape), np.full(shape, np.nan)
    flux = Fluxes(q, component, *neighbours(shape[component], periodic=False))
    now = Stage(np.empty(shape), kept, nothing, 1.0, 2.0, 1e-9)
    stage(now, nothing, nothing, Padded(field, marks), flux)
    return -kept


@COMPONENTS
@ENDS
@pytest.mark.parametrize("marked", [(CLEAR,), (CUT,), (CUT, CLEAR, CLEAR, CLEAR, UPSTREAM)])
@pytest.mark.parametrize("weight", [1.0, 0.5])
def test_stage(
    cells: Shape, component: int, periodic: bool, marked: tuple[int, ...], weight: float
) -> None:
    """Some volumes hold nothing afterwards, and what is left of their amount is given."""
    random, shape = np.random.default_rng(1), face_shape(cells, component)
    field = random.standard_normal(padded(shape))
    marks = random.choice(np.array(marked, np.uint8), padded(shape))
    start, before, after, kept = random.standard_normal((4, *shape))
    after[after < 0.3] = 0.0
    flux = Fluxes(fluxes(cells, random), component, *neighbours(shape[component], periodic))
    rest = start, before, Padded(field, marks), flux
    out = np.full(shape, np.nan)
    now = Stage(out, kept, after, weight, 0.3, 1e-9)
    value, left = stage_reference(now, *rest)
    stage(now, *rest)
    np.testing.assert_allclose(kept, left, atol=1e-13)
    np.testing.assert_allclose(out, value, rtol=1e-12, atol=1e-12)
    again = np.full(shape, np.nan)
    stage.parallel(now._replace(later=again), *rest)
    np.testing.assert_array_equal(again, out)


@COMPONENTS
@ENDS
def test_sides_of_a_control_volume(cells: Shape, component: int, periodic: bool) -> None:
    """What flows into them is half of what flows into both their cells."""
    q = fluxes(cells, np.random.default_rng(2))
    if periodic:
        np.moveaxis(q[component], component, 0)[-1] = np.moveaxis(q[component], component, 0)[0]
    means = neighbours(cells[component] + 1, periodic)
    through = side_fluxes_reference(Fluxes(q, component, *means))
    inward = sum(np.diff(flux, axis=axis) for axis, flux in enumerate(q))
    ends = [(int(axis == component),) * 2 for axis in range(3)]
    wide = np.moveaxis(np.pad(inward, ends, mode="wrap" if periodic else "constant"), component, 0)
    found = sum(np.diff(flux, axis=axis) for axis, flux in enumerate(through))
    expected = np.moveaxis(0.5 * (wide[1:] + wide[:-1]), 0, component)
    np.testing.assert_allclose(found, expected, atol=1e-13)


@COMPONENTS
def test_a_uniform_field_leaves_with_the_volume(cells: Shape, component: int) -> None:
    random, shape = np.random.default_rng(2), face_shape(cells, component)
    marks = random.integers(0, 3, padded(shape)).astype(np.uint8)
    q = fluxes(cells, random)
    net = net_of(np.full(padded(shape), 0.7), marks, q, component)
    means = neighbours(shape[component], periodic=False)
    through = side_fluxes_reference(Fluxes(q, component, *means))
    volume = sum(np.diff(g, axis=axis) for axis, g in enumerate(through))
    np.testing.assert_allclose(net, 0.7 * volume, atol=1e-13)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_means_of_a_parabola_are_carried_exactly(sign: float) -> None:
    """Third order: where nothing limits it, the value at a side is that of the parabola."""
    edges = np.arange(-2.0, 15.0)
    whole = 1.3 + 4.0 * edges + 0.2 * edges**3 / 3.0
    field = np.broadcast_to(np.diff(whole), padded((1, 4, 12))).copy()
    q = np.zeros((2, 3, 12)), np.zeros((1, 4, 12)), np.full((1, 3, 13), sign)
    net = net_of(field, np.full(field.shape, CLEAR, np.uint8), q, 1)
    value = 4.0 + 0.2 * edges[2:-2] ** 2
    np.testing.assert_allclose(net[0, 1], sign * np.diff(value), atol=1e-12)


def test_a_value_between_two_never_leaves_them_at_a_jump() -> None:
    """A step of the field carried along stays within its two values."""
    q = np.zeros((2, 2, 20)), np.zeros((1, 3, 20)), np.ones((1, 2, 21))
    field = np.tile((np.arange(24) > 11).astype(float), (1, 7, 1))
    net = net_of(field, np.full(field.shape, CLEAR, np.uint8), q, 1)[0, 1]
    assert net.sum() == pytest.approx(1.0)
    assert net.min() > -1e-14


@pytest.mark.parametrize("shape", [(5, 7, 6), (1, 9, 8)])
def test_pad_field(shape: Shape) -> None:
    values, along = np.random.default_rng(3).standard_normal((2, *shape))
    out = np.full(padded(shape), np.nan)
    pad_field(out, values, along, 0.3)
    inside = np.isfinite(out)
    np.testing.assert_array_equal(out[inside].reshape(shape), values + 0.3 * along)
    assert not inside[:, :GHOSTS].any()


@pytest.mark.parametrize("cells", [(5, 7, 6), (9, 8, 1)])
def test_largest_crossing(cells: Shape) -> None:
    q = fluxes(cells, np.random.default_rng(4))
    assert largest_crossing.parallel(*q) == largest_crossing(*q)
    assert largest_crossing(*q) == pytest.approx(largest_crossing_reference(q), rel=1e-14)
