"""A mouth lets out what it is told to, and its jet pushes the body back."""

from __future__ import annotations

from dataclasses import replace

import mujoco
import numpy as np
import pytest

from flowborne import Array, Fluid, Grid, Setup, SolidModel, Tissue, World, step
from flowborne.coupling.cut import jets_at, volumes_of
from flowborne.coupling.mouths import Mouth, share_of
from flowborne.fluid.control_volumes import face_masses, fluid_momentum
from flowborne.motion.formula import Formula
from flowborne.motion.inflow import FactorFormula, FactorSteady
from flowborne.solids.tissue.growth import Law, add_flesh
from flowborne.worlds import Boundaries, BoundaryOpen, advance, cut_by_bodies, make_world
from flowborne_validation.flesh_bars import bar_mesh
from flowborne_validation.worlds import mjcf

OPEN = BoundaryOpen()
RADIUS, HALF, RATE = 0.2, 0.1, 0.1
"""m: of the disc or ball, and of its mouth; m^2/s or m^3/s."""


def slab(cells: int, size: float = 2.0) -> Grid:
    return Grid.slab(cells, cells, size / cells, (-0.5 * size, -0.5 * size))


def cube(cells: int) -> Grid:
    return Grid((cells, cells, cells), 2.0 / cells, (-1.0, -1.0, -1.0))


def mouthed(
    grid: Grid,
    *,
    rate: float = RATE,
    angle: float = 0.0,
    free: bool = False,
    density: float = 3.0,
    viscosity: float = 0.0,
    half: float = HALF,
    dye: bool = False,
) -> World:
    """A disc or ball off the middle of an open box, with a mouth at `angle` to x in its plane."""
    joint = "<freejoint/>" if free else ""
    ball = f'<body pos="0.013 0.007 0">{joint}<geom type="sphere" size="{RADIUS}"/></body>'
    ends = (OPEN,) * (4 if grid.is_slab else 6)
    scalars = ("dye",) if dye else ()
    world = make_world(
        mjcf(ball),
        grid,
        solid_density=density,
        viscosity=viscosity,
        boundaries=Boundaries(*ends),
        scalars=scalars,
    )
    x, y = np.cos(angle), np.sin(angle)
    place = (RADIUS * x, RADIUS * y, 0.0)
    mouth = Mouth("the mouth", 1, place, (x, y, 0.0), half, rate, FactorSteady(), {"dye": 1.0})
    return World.at_rest(replace(world.setup, mouths=(mouth,)))


def outflow_of_box(world: World, cells: int) -> float:
    """Volume rate out of the box that leaves this many cells to every side."""
    fluid, state = world.flow()
    total = 0.0
    for axis in fluid.grid.axes:
        inner = [slice(cells, -cells) if a in fluid.grid.axes else slice(None) for a in range(3)]
        for end, sign in ((cells, -1.0), (-cells - 1, 1.0)):
            inner[axis] = slice(end, end + 1)
            total += sign * fluid.grid.face_area * float(state.velocity[axis][tuple(inner)].sum())
    return total


@pytest.mark.parametrize("rate", [RATE, -RATE])
@pytest.mark.parametrize("free", [False, True])
@pytest.mark.parametrize(("grid", "angle"), [(slab(32), 0.7), (cube(16), 0.7), (slab(20), -2.0)])
def test_what_leaves_around_the_body_is_what_the_mouth_expels(
    grid: Grid, angle: float, free: bool, rate: float
) -> None:
    world = mouthed(grid, rate=rate, angle=angle, free=free)
    for _ in range(4):
        report = advance(world, 0.05)
        assert outflow_of_box(world, 3) == pytest.approx(rate, rel=1e-7)
        assert report.expelled == pytest.approx(rate * 0.05, rel=1e-14)


def momentum_of(world: World) -> Array:
    fluid, state = world.flow()
    mass = face_masses(volumes_of(world, cut_by_bodies(world)), fluid.density)
    return fluid_momentum(state.velocity, mass, fluid.grid, fluid.boundaries)


@pytest.mark.parametrize("viscosity", [0.0, 0.01])
@pytest.mark.parametrize("rate", [RATE, -RATE])
@pytest.mark.parametrize("grid", [slab(40), cube(16)], ids=["slab", "cube"])
def test_body_fluid_and_what_fills_the_body_keep_their_momentum(
    grid: Grid, rate: float, viscosity: float
) -> None:
    """The fluid gains rho Q (v_b + w), the body loses rho Q w, and rho Q v_b came from nowhere.

    What a mouth drinks comes with the velocity that it had.
    """
    world = mouthed(grid, rate=rate, angle=0.7, free=True, viscosity=viscosity)
    fluid, _ = world.flow()
    area = 2.0 * HALF if grid.is_slab else np.pi * HALF**2
    mass, dt = float(world.setup.solid.body_mass.sum()), 0.02
    for _ in range(8):
        was, velocity = momentum_of(world), world.solid.v[:3].copy()
        (jet,) = jets_at(world, world.time)
        report = step(world, dt)
        assert report.outcome.name == "DONE"
        thrust = dt * report.jet_wrench[1, :3]
        scale = fluid.density * rate**2 / area * dt
        if rate > 0.0:
            np.testing.assert_allclose(thrust, -scale * jet.along, atol=1e-12 * scale)
        filled = fluid.density * rate * dt * jet.skin
        np.testing.assert_allclose(report.momentum_jet + thrust, filled, atol=1e-12 * scale)
        friction = dt * report.viscous_wrench[1, :3]
        gained = mass * (world.solid.v[:3] - velocity)
        given = report.momentum_exchanged + friction + thrust
        np.testing.assert_allclose(gained, given, atol=1e-10 * scale)
        outside = report.momentum_boundary + report.momentum_crossed + report.momentum_advection
        whole = gained + momentum_of(world) - was
        np.testing.assert_allclose(whole, filled + outside, atol=1e-10 * scale)
        assert report.momentum_exchange_error < 1e-10


def test_a_jet_that_starts_pushes_as_the_bodys_own_potential_flow_says() -> None:
    """By Green's identity the impulse of a source on the skin is that of a moving body's potential
    there: rho Q a cos(theta), here averaged over the mouth, for a disc in unbounded fluid."""
    world = mouthed(slab(128, 4.0))
    report = advance(world, 0.001)
    inside = np.sqrt(RADIUS**2 - HALF**2)
    mean = 0.5 * (inside + RADIUS**2 / HALF * np.arcsin(HALF / RADIUS)) / RADIUS
    impulse = -RATE * RADIUS * mean
    given = 0.001 * report.pressure_wrench[1, :2]
    np.testing.assert_allclose(given, [impulse, 0.0], atol=0.02 * abs(impulse))


def test_thrust_on_a_held_disc_is_the_momentum_of_its_jet() -> None:
    """Control volume around disc and jet, in fluid at rest under equal pressure: the body is pushed
    back by rho Q w from when the jet has formed until it leaves. What is left to the pressure on
    the skin, by entrainment and by the jet's waver, is within a tenth of that."""
    world = mouthed(slab(96, 4.0))
    speed = RATE / (2.0 * HALF)
    dt = 0.5 * world.flow()[0].grid.spacing / speed
    advance(world, dt, 48)
    total, lost = np.zeros(3), np.zeros(3)
    for _ in range(60):
        report = advance(world, dt)
        total += report.fluid_wrench()[1, :3] / 60
        lost += report.momentum_advection / 60
    force = RATE * speed
    np.testing.assert_allclose(total[:2], [-force, 0.0], atol=0.1 * force)
    assert np.abs(lost).max() < 0.2 * force * dt


def test_a_free_disc_is_driven_away_from_its_jet() -> None:
    """(m + m_a) v = -rho Q w t, with the added mass m_a of a disc in unbounded fluid. The suction
    of the vortices that the start sheds takes some, the impulse of the start gives some."""
    world = mouthed(slab(64, 4.0), free=True)
    speed = RATE / (2.0 * HALF)
    dt = 0.5 * world.flow()[0].grid.spacing / speed
    advance(world, dt, 48)
    area = np.pi * RADIUS**2
    expected = -RATE * speed * world.time / (3.0 * area + area)
    assert world.solid.v[0] == pytest.approx(expected, rel=0.12)
    assert abs(world.solid.v[1]) < 0.03 * abs(expected)
    assert world.solid.q[0] < -0.3


@pytest.mark.parametrize("grid", [slab(64), cube(28), cube(32)], ids=["slab", "cube", "fine"])
def test_dye_leaves_from_the_mouth(grid: Grid) -> None:
    world = mouthed(grid, dye=True, half=0.12)
    area = 0.24 if grid.is_slab else np.pi * 0.12**2
    dt = 0.5 * grid.spacing * area / RATE
    advance(world, dt, 12)
    _, state = world.flow()
    dye = state.scalars["dye"]
    x, y, _ = np.meshgrid(*grid.cell_coordinates(), indexing="ij")
    assert np.vdot(state.cell_volume, dye) == pytest.approx(RATE * world.time, rel=1e-12)
    assert np.abs(dye[x < 0.013]).max() < 1e-4
    assert (dye * y).sum() / dye.sum() == pytest.approx(0.007, abs=0.5 * grid.spacing)


@pytest.mark.parametrize("grid", [slab(64), cube(24)], ids=["slab", "cube"])
def test_a_mouth_that_drinks_takes_the_dye_that_is_there(grid: Grid) -> None:
    """Where it is everywhere it stays so, within what the open sides let in."""
    world = mouthed(grid, dye=True, rate=-RATE, half=0.12)
    _, state = world.flow()
    state.scalars["dye"][:] = 1.0
    area = 0.24 if grid.is_slab else np.pi * 0.12**2
    for _ in range(12):
        report = advance(world, 0.5 * grid.spacing * area / RATE)
        assert report.dye_budget_error < 1e-13
        outside = state.cell_volume > 0.0
        np.testing.assert_allclose(state.scalars["dye"][outside], 1.0, rtol=1e-12)


@pytest.mark.parametrize("grid", [slab(64), cube(24)], ids=["slab", "cube"])
def test_a_mouth_drinks_again_the_dye_that_it_blew(grid: Grid) -> None:
    """None while clear water comes in, and never more than comes in."""
    swing = FactorFormula(Formula("-sin(2*pi*t / period)", {"period": 0.5}))
    world = mouthed(grid, dye=True, half=0.12)
    world.setup = replace(world.setup, mouths=(replace(world.setup.mouths[0], strength=swing),))
    _, state = world.flow()
    dt = 0.5 / 24.0
    amount = [0.0]
    for _ in range(36):
        report = advance(world, dt)
        assert report.dye_budget_error < 1e-13
        dye = state.scalars["dye"]
        assert 0.0 <= dye.min() <= dye.max() <= 1.0
        amount.append(float(np.vdot(state.cell_volume, dye)))
    gained = np.diff(amount)
    blown = RATE * dt * np.array([swing.at(n * dt) for n in range(36)])
    assert np.abs(gained[:12]).max() == 0.0
    np.testing.assert_allclose(gained[12:24], blown[12:24], atol=1e-12)
    assert np.all(gained[25:36] >= blown[25:36])
    assert gained[25:28].sum() < 0.2 * blown[25:28].sum() < 0.0


def test_nothing_is_blown_out_of_the_far_side_of_a_thin_plate() -> None:
    plate = '<body><geom type="box" size="0.05 0.4 1"/></body>'
    world = make_world(mjcf(plate), slab(32), boundaries=Boundaries(OPEN, OPEN, OPEN, OPEN))
    mouth = Mouth("the mouth", 1, (0.05, 0.0, 0.0), (1.0, 0.0, 0.0), 0.1, RATE, FactorSteady())
    world = World.at_rest(replace(world.setup, mouths=(mouth,)))
    cut, grid = cut_by_bodies(world), world.flow()[0].grid
    (jet,) = jets_at(world, 0.0)
    cells = np.stack(np.unravel_index(jet.cells, grid.shape), axis=1)
    assert (grid.cell_coordinates()[0][cells[:, 0]] > 0.0).all()
    blown = share_of(cut.closed.place, mouth, jet.centre, jet.along, cut, grid) > 0.0
    assert blown.any()
    assert (cut.closed.place[blown, 0] >= 0.0).all()


@pytest.mark.parametrize("position", [(5.0, 0.0, 0.0), (-0.2, 0.0, 0.0)])
def test_a_mouth_that_covers_no_cell_is_told(position: tuple[float, float, float]) -> None:
    """Beside its body, or with its direction into the body."""
    world = mouthed(slab(32))
    lost = replace(world.setup.mouths[0], position=position)
    world = World.at_rest(replace(world.setup, mouths=(lost,)))
    with pytest.raises(ValueError, match="the mouth covers no cell at"):
        step(world, 0.01)


def fleshy(grid: Grid, angle: float) -> World:
    """A held ball, as large as the others, of flesh around a bone with a mouth at `angle` to x."""
    points, elements = bar_mesh((6, 6, 6), (2.0, 2.0, 2.0))
    points -= points.mean(axis=0)
    outer = np.abs(points).max(axis=1)
    points *= (RADIUS * outer / np.maximum(np.linalg.norm(points, axis=1), 1e-9))[:, None]
    spec = mujoco.MjSpec.from_string(mjcf('<body name="bone"><geom size="0.1"/></body>'))
    tissue = Tissue(1e10, 0.3, 1000.0, law=Law.STABLE_NEO_HOOKEAN)
    held = ["bone" if inside else "" for inside in outer < 0.5]
    grown = add_flesh(spec, "ball", points, elements, tissue, held)
    x, y = np.cos(angle), np.sin(angle)
    mouth = Mouth(
        "the mouth", 1, (RADIUS * x, RADIUS * y, 0.0), (x, y, 0.0), HALF, RATE, FactorSteady()
    )
    fluid = Fluid(grid, 1000.0, boundaries=Boundaries(*(OPEN,) * 6))
    model = SolidModel.with_flesh(spec, [grown], gravity=(0.0, 0.0, 0.0))
    return World.at_rest(Setup(model, fluid, mouths=(mouth,)))


@pytest.mark.parametrize("angle", [0.0, 0.3, 0.7])
def test_a_mouth_in_flesh_lets_out_all_of_it_and_nowhere_faster_than_the_jet(angle: float) -> None:
    """So no cell at its rim gets more than leaves by its open faces."""
    world = fleshy(cube(24), angle)
    advance(world, 0.02)
    assert outflow_of_box(world, 3) == pytest.approx(RATE, rel=1e-4)
    opened, state = cut_by_bodies(world).open, world.flow()[1]
    for u, o in zip(state.velocity, opened, strict=True):
        assert np.abs(u[o > 0.0]).max() < RATE / (np.pi * HALF**2)
