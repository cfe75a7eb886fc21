"""What pressure does to bodies and bodies do to the flow: transposes of each other."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from flowborne.coupling.fractions import Geometry
from flowborne.coupling.operators import add_flux, leak_proof, pressure_push
from flowborne.fluid.boundary import Boundaries
from flowborne.fluid.control_volumes import control_volumes, face_masses
from flowborne.fluid.grid import Grid
from flowborne.kernels.arrays import Array, Faces
from flowborne.kernels.projection import net_out

Cut = Callable[..., Geometry]

SLAB = Grid.slab(36, 30, 0.05, (-0.9, -0.75))
CUBE = Grid((18, 16, 17), 0.1, (-0.9, -0.8, -0.85))
GRIDS = {"slab": SLAB, "cube": CUBE}

CREATURE = """
<body name="trunk"><freejoint/><geom type="sphere" size="0.22"/>
  <body name="arm" pos="0.2 0 0"><joint type="hinge" axis="0 0 1"/>
    <geom type="box" size="0.15 0.08 0.12" pos="0.15 0 0"/>
  </body>
</body>"""
"""A sphere and an arm that overlaps it."""

LONE = '<body name="block"><freejoint/><geom type="box" size="0.3 0.12 0.2"/></body>'


def rigid(grid: Grid, twist: Array) -> Faces:
    """Velocity of a rigid motion at the centres of the faces."""
    faces = grid.zeros_faces()
    for axis in grid.axes:
        places = np.stack(np.meshgrid(*grid.face_coordinates(axis), indexing="ij"), axis=-1)
        if grid.is_slab:
            places[..., 2] = 0.0
        faces[axis][:] = (twist[:3] + np.cross(twist[3:], places))[..., axis]
    return faces


def net_outflow(velocity: Faces, cut: Geometry, twist: Array, grid: Grid) -> Array:
    """(nx, ny, nz) what flows out of the open parts of each cell, and what bodies displace."""
    net = np.empty(grid.shape)
    net_out(net, *(part * u for part, u in zip(cut.open, velocity, strict=True)))
    net *= grid.face_area
    add_flux(net, cut, twist.ravel())
    return net


def plane(grid: Grid, twist: Array) -> Array:
    """The part of a twist that a slab can have."""
    return twist * [1, 1, 0, 0, 0, 1] if grid.is_slab else twist


@pytest.mark.parametrize("name", GRIDS)
def test_flux_and_wrench_are_transposes(cut: Cut, name: str) -> None:
    grid, random = GRIDS[name], np.random.default_rng(1)
    found = cut(grid, CREATURE, q=np.array([0.03, -0.02, 0.01, 1.0, 0.2, 0.1, 0.3, 0.4]))
    for _ in range(5):
        pressure, twist = random.normal(size=grid.shape), random.normal(size=(3, 6))
        flux = np.zeros(grid.shape)
        add_flux(flux, found, twist.ravel())
        work = float((pressure * flux).sum())
        wrench = pressure_push(found, pressure, 18).reshape(3, 6)
        assert float((wrench * twist).sum()) == pytest.approx(work, rel=1e-12)
        assert not wrench[0].any()


@pytest.mark.parametrize("name", GRIDS)
@given(place=st.tuples(*[st.floats(-0.3, 0.3)] * 3), turn=st.tuples(*[st.floats(-1.0, 1.0)] * 3))
@settings(max_examples=25, deadline=None)
def test_uniform_pressure_pushes_a_whole_body_nowhere(
    cut: Cut, name: str, place: tuple[float, ...], turn: tuple[float, ...]
) -> None:
    """The closed area vectors around a body add up to nothing, and so do their moments."""
    grid = GRIDS[name]
    x, y, z = place if name == "cube" else (*place[:2], 0.0)
    a, b, c = turn if name == "cube" else (0.0, 0.0, turn[2])
    quaternion = np.array([1.0, a, b, c]) / np.sqrt(1.0 + a * a + b * b + c * c)
    found = cut(grid, LONE, q=np.array([x, y, z, *quaternion]))
    wrench = pressure_push(found, np.ones(grid.shape), 12)
    assert np.abs(wrench).max() < 1e-12 * np.abs(found.rows[3]).sum()


@pytest.mark.parametrize("name", GRIDS)
def test_uniform_pressure_pushes_parts_that_overlap_nowhere(cut: Cut, name: str) -> None:
    """Neither against each other: each feels it all around, see `overlaps`."""
    grid = GRIDS[name]
    found = cut(grid, CREATURE, q=np.array([0.03, -0.02, 0.0, 1.0, 0.0, 0.0, 0.3, 0.4]))
    wrench = pressure_push(found, np.ones(grid.shape), 18)
    assert np.abs(wrench).max() < 1e-12 * np.abs(found.rows[3]).sum()


@pytest.mark.parametrize("name", GRIDS)
def test_a_rigid_motion_of_body_and_fluid_is_seen_as_one(cut: Cut, name: str) -> None:
    """Fluid that moves as the body does, at the centres of the open parts of faces: the leak-proof
    field is that motion, without divergence, and no cell gains or loses."""
    grid = GRIDS[name]
    twist = plane(grid, np.array([0.3, -0.7, 0.4, 0.9, -0.5, 1.7]))
    found = cut(grid, CREATURE, q=np.array([0.03, -0.02, 0.0, 1.0, 0.0, 0.0, 0.3, 0.4]))
    whole, none = rigid(grid, twist), grid.zeros_faces()
    field = leak_proof(none, found, np.tile(twist, 3), grid)
    for axis in grid.axes:
        opened = found.open[axis]
        rest = whole[axis] - field[axis]
        field[axis][:] = np.divide(rest, opened, out=np.zeros(rest.shape), where=opened > 0.0)
    carried = leak_proof(field, found, np.tile(twist, 3), grid)
    for axis in grid.axes:
        np.testing.assert_allclose(carried[axis], whole[axis], atol=1e-13)
    clear = np.zeros(grid.shape, bool)
    clear.reshape(-1)[found.rows[0]] = True
    net = net_outflow(field, found, np.stack([twist] * 3), grid)[clear]
    assert np.abs(net).max() < 1e-14


def test_nothing_passes_a_face_that_is_closed(cut: Cut) -> None:
    """However fast the fluid, a wholly closed face carries the body's velocity alone."""
    found = cut(SLAB, LONE, q=np.array([0.01, 0.02, 0.0, 1.0, 0.0, 0.0, 0.3]))
    fast = tuple(np.full(SLAB.face_shape(axis), 1e6) for axis in range(3))
    twist = np.array([np.zeros(6), [0.3, -0.7, 0.0, 0.0, 0.0, 1.7]])
    carried = leak_proof(fast, found, twist.ravel(), SLAB)
    for axis in SLAB.axes:
        closed = found.open[axis] == 0.0
        assert closed.sum() > 20
        expected = rigid(SLAB, twist[1])[axis][closed]
        np.testing.assert_allclose(carried[axis][closed], expected, rtol=1e-12)


def test_growth_of_a_cell_is_what_moves_out_of_it(cut: Cut) -> None:
    """The flux of a moving disc is the rate at which its cross-section leaves a half-plane."""
    found = cut(SLAB, '<body><freejoint/><geom type="sphere" size="0.31"/></body>')
    flux = np.zeros(SLAB.shape)
    twist = np.array([np.zeros(6), [2.0, 0.0, 0.0, 0.0, 0.0, 0.0]])
    add_flux(flux, found, twist.ravel())
    x = SLAB.cell_coordinates()[0]
    # outward of the closed part is positive: the cells ahead of the disc are displaced
    assert flux[x < 0.0].sum() == pytest.approx(2.0 * 0.62, rel=0.01)
    assert flux[x > 0.0].sum() == pytest.approx(-2.0 * 0.62, rel=0.01)


TURNING = {
    "disc": '<geom type="sphere" size="0.31"/>',
    "box": '<geom type="box" size="0.3 0.12 0.2"/>',
}


@pytest.mark.parametrize("body", TURNING)
@pytest.mark.parametrize("place", [(0.0, 0.0), (0.013, -0.021)])
def test_growth_of_a_cell_is_what_a_turning_body_moves_out_of_it(
    cut: Cut, body: str, place: tuple[float, float]
) -> None:
    """The flux of a body that turns, against the volumes of cells a little before and after."""
    volumes, step = [], 1e-6
    for turn in (0.3 - step, 0.3, 0.3 + step):
        q = np.array([*place, 0.0, np.cos(0.5 * turn), 0.0, 0.0, np.sin(0.5 * turn)])
        found = cut(SLAB, f"<body><freejoint/>{TURNING[body]}</body>", q=q)
        volumes.append(found.volume)
        if turn == 0.3:
            flux = np.zeros(SLAB.shape)
            spin = np.array([*np.zeros(6), place[1], -place[0], 0.0, 0.0, 0.0, 1.0])
            add_flux(flux, found, spin)
            opened = found.volume > 0.0
    growth = (volumes[2] - volumes[0]) / (2.0 * step)
    np.testing.assert_allclose(flux[opened], growth[opened], atol=1e-5 * SLAB.face_area)


def test_fluid_mass_is_that_of_the_open_volume(cut: Cut) -> None:
    """Faces weigh density x control volume; on every axis the whole fluid."""
    density, closed = 3.0, np.pi * 0.31**2
    found = cut(SLAB, '<geom type="sphere" size="0.31" pos="0.01 -0.02 0"/>')
    mass = face_masses(control_volumes(found.volume, found.open, SLAB, Boundaries()), density)
    for axis in SLAB.axes:
        assert mass[axis].sum() == pytest.approx(density * (1.8 * 1.5 - closed), rel=2e-3)
