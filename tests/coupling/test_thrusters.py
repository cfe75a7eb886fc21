"""Thrusters push a body and the water apart, whatever the grid."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from flowborne import Array, Grid, World, step
from flowborne.base.errors import BreakdownError
from flowborne.coupling.cut import cut_by_bodies, discs_at, volumes_of
from flowborne.coupling.thrusters import Thruster
from flowborne.motion.formula import Formula
from flowborne.motion.inflow import FactorFormula
from flowborne.solids.dynamics import kinematics
from flowborne.worlds import Boundaries, BoundaryOpen, BoundaryPeriodic, make_world
from flowborne_validation.worlds import mjcf

DENSITY, THRUST = 1000.0, 3.0
SQUARE = Grid.slab(24, 24, 1.0 / 24.0, (-0.5, -0.5))
CUBE = Grid((16, 16, 16), 1.0 / 16.0, (-0.5, -0.5, -0.5))
PERIODIC = Boundaries(*(BoundaryPeriodic(),) * 6)


def constant(value: float) -> FactorFormula:
    return FactorFormula(Formula(f"{value}"))


def thruster(place: tuple[float, float, float], **more: object) -> Thruster:
    """It pushes along x with THRUST, from a disc of 0.06 m."""
    given: dict[str, object] = {"axis": (1.0, 0.0, 0.0), "setting": constant(THRUST)} | more
    return Thruster("jet", 1, place, radius=0.06, **given)  # type: ignore[arg-type]


def vehicle(
    grid: Grid, sides: Boundaries, *thrusters: Thruster, joint: str = "<freejoint/>"
) -> World:
    """A ball that floats, with thrusters."""
    ball = (
        f'<body pos="0.013 0.007 0">{joint}<geom type="sphere" size="0.15" density="1000"/></body>'
    )
    world = make_world(mjcf(ball), grid, boundaries=sides, density=DENSITY)
    return World.at_rest(replace(world.setup, thrusters=thrusters))


def water_at_the_ball(world: World) -> float:
    """Which part of the first disc is water."""
    volumes = volumes_of(world, cut_by_bodies(world))
    return discs_at(world, kinematics(world.setup.solid, world.solid.q), volumes, 0.0)[0].water


@pytest.mark.parametrize("axis", [(1.0, 0.0, 0.0), (0.6, -0.8, 0.0)], ids=["along", "askew"])
@pytest.mark.parametrize("place", [-0.27, -0.16], ids=["clear", "half-in-the-body"])
@pytest.mark.parametrize("grid", [SQUARE, CUBE], ids=["slab", "room"])
def test_momentum_of_body_and_water_stays(
    grid: Grid, place: float, axis: tuple[float, float, float]
) -> None:
    """Across periodic sides nothing else gives or takes any."""
    world = vehicle(grid, PERIODIC, thruster((place, 0.031, 0.0), axis=axis))
    part = water_at_the_ball(world)
    assert part > 0.95 if place == -0.27 else part < 0.9
    dt, given = 0.01, np.zeros(3)
    for _ in range(12):
        report = step(world, dt)
        given += dt * report.applied_wrench[1, :3]
        assert report.momentum_budget_error < 1e-10
        assert report.momentum_exchange_error < 1e-10
    both = report.momentum_solid + report.momentum_fluid
    expected = 12 * dt * THRUST
    turned = np.linalg.norm(given)
    assert turned == pytest.approx(expected, rel=0.05)
    assert np.abs(both).max() < 1e-10 * expected


@pytest.mark.parametrize("grid", [SQUARE, CUBE], ids=["slab", "room"])
def test_the_water_has_what_a_held_body_is_given(grid: Grid) -> None:
    """In open surroundings the fluid gains what sides, held body and disc give it."""
    sides = Boundaries(*(BoundaryOpen(),) * (4 if grid.is_slab else 6))
    world = vehicle(grid, sides, thruster((-0.3, 0.03, 0.01)), joint="")
    dt, lost = 0.01, np.zeros(3)
    for _ in range(8):
        report = step(world, dt)
        lost += report.momentum_forces
        assert report.momentum_budget_error < 1e-10
        assert report.applied_wrench[1, :3] == pytest.approx([THRUST, 0.0, 0.0], abs=1e-14)
        assert report.thrust == [THRUST]
    assert lost == pytest.approx([-8 * dt * THRUST, 0.0, 0.0], abs=1e-12 * THRUST)


@pytest.mark.parametrize("shift", np.linspace(0.0, 1.0, 5))
@pytest.mark.parametrize("grid", [SQUARE, CUBE], ids=["slab", "room"])
def test_the_total_is_exact_wherever_the_disc_is_in_its_cell(grid: Grid, shift: float) -> None:
    place = (-0.3 + shift * grid.spacing, 0.05 - shift * grid.spacing, 0.0)
    world = vehicle(grid, PERIODIC, thruster(place, axis=(0.8, 0.6, 0.0)))
    volumes = volumes_of(world, cut_by_bodies(world))
    (disc,) = discs_at(world, kinematics(world.setup.solid, world.solid.q), volumes, 0.0)
    for axis, (faces, shares) in enumerate(zip(disc.faces, disc.shares, strict=True)):
        assert shares.sum() == pytest.approx(1.0, abs=1e-14)
        x = np.stack(
            [c.ravel() for c in np.meshgrid(*grid.face_coordinates(axis), indexing="ij")], axis=1
        )
        middle = (shares[:, None] * x[faces]).sum(axis=0)
        assert np.abs(middle - disc.centre)[: len(grid.axes)].max() < 0.15 * grid.spacing


def test_a_disc_across_a_periodic_side_is_whole() -> None:
    near, far = (vehicle(CUBE, PERIODIC, thruster((-0.3, y, 0.0))) for y in (0.1, 0.495))
    shares = []
    for world in (near, far):
        volumes = volumes_of(world, cut_by_bodies(world))
        pose = kinematics(world.setup.solid, world.solid.q)
        (disc,) = discs_at(world, pose, volumes, 0.0)
        assert disc.water == pytest.approx(1.0, abs=0.01)
        shares.append(disc.shares[0].size)
    assert np.ptp(shares) <= 6


def test_without_water_there_is_no_thrust() -> None:
    for place in ((0.0, 0.0, 0.0), (-0.7, 0.0, 0.0)):
        sides = Boundaries(*(BoundaryOpen(),) * 6)
        world = vehicle(CUBE, sides, thruster(place))
        with pytest.raises(BreakdownError, match=r"thruster 'jet' has no water in its disc at"):
            step(world, 0.01)


def test_a_coefficient_gives_the_thrust_of_a_speed() -> None:
    """T = C rho n |n| D^4, and D^3 a metre of depth."""
    propeller = thruster((-0.3, 0.0, 0.0), coefficient=0.4, limits=(-10.0, 20.0))
    assert propeller.thrust(5.0, DENSITY, False) == pytest.approx(0.4 * 1000.0 * 25.0 * 0.12**4)
    assert propeller.thrust(5.0, DENSITY, True) == pytest.approx(0.4 * 1000.0 * 25.0 * 0.12**3)
    assert propeller.thrust(-90.0, DENSITY, False) == -propeller.thrust(10.0, DENSITY, False)


def in_the_open(more: str = "") -> tuple[World, Array, Array]:
    """A held thruster of radius 1 m, 3 cells, in open water of 1 kg/m^3, whose thrust makes 1 m/s
    through the disc by actuator-disc theory; in each step the speed there, and the force of the
    pressure on the last body."""
    radius, area = 1.0, np.pi
    grid = Grid((48, 32, 32), radius / 3.0, (-6.4, -16.0 / 3.0, -16.0 / 3.0))
    speck = '<body pos="-6 -5 -5"><geom type="sphere" size="0.3"/></body>'
    world = make_world(
        mjcf(speck + more), grid, boundaries=Boundaries(*(BoundaryOpen(),) * 6), density=1.0
    )
    jet = Thruster("jet", 1, (6.0, 5.0, 5.0), (-1.0, 0.0, 0.0), radius, constant(2.0 * area))
    world = World.at_rest(replace(world.setup, thrusters=(jet,)))
    speeds, pushed = list[float](), list[Array]()
    for _ in range(90):
        report = step(world, 1.0 / 6.0)
        speeds.append(report.jet_power[0] / report.thrust[0])
        pushed.append(report.pressure_wrench[-1, :3])
    return world, np.array(speeds), np.array(pushed)


def test_the_slipstream_is_that_of_actuator_disc_theory() -> None:
    """u = sqrt(T / 2 rho A) through a disc at rest, and twice that far behind it: the soft edge of
    the disc, a cell wide, is a hundredth of its area."""
    world, speeds, _ = in_the_open()
    assert np.mean(speeds[-12:]) == pytest.approx(1.0, rel=0.03)
    u = world.flow()[1].velocity[0]
    assert u[33:36, 16, 16].mean() == pytest.approx(2.0, rel=0.05)  # 4.6 radii behind
    assert abs(u[10, 16, 16]) < 0.2  # drawn in from all around


def test_what_lies_in_the_jet_stops_it() -> None:
    """A wide plate turns the jet aside. The momentum of a jet is its thrust, of which the plate has
    two thirds in the mean, as vortex rings of ideal fluid go over it and pull."""
    plate = '<body pos="3 0 0"><geom type="box" size="0.4 4 4"/></body>'
    _, _, pushed = in_the_open(plate)
    assert 0.55 < pushed[:, 0].mean() / (2.0 * np.pi) < 0.8
    assert np.abs(pushed[:, 1:].mean(axis=0)).max() < 0.05 * 2.0 * np.pi
