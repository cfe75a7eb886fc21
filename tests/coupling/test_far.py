"""Far sides: bodies in a small box are accelerated as in endless fluid."""

from __future__ import annotations

import math

import numpy as np
import pytest

import flowborne as fb
from flowborne.coupling.world import World
from flowborne.fluid.grid import Grid
from flowborne.sim.frame import Snapshot
from flowborne.solids.trajectories import JointCommand
from flowborne.solvers.pressure import PressureSolution, PressureSystem
from flowborne.worlds import (
    Boundaries,
    Boundary,
    BoundaryClosed,
    BoundaryFar,
    BoundaryInflow,
    BoundaryOpen,
    BoundaryPeriodic,
    advance,
    kinetic_energy,
    make_world,
    start,
)
from flowborne_validation.far_sides import box
from flowborne_validation.worlds import Uniform, mjcf, start_at_once

FAR, OPEN, CLOSED, RING = BoundaryFar(), BoundaryOpen(), BoundaryClosed(), BoundaryPeriodic()
AROUND = Boundaries(*(FAR,) * 6)
FLAT = Boundaries(*(FAR,) * 4)
DT = 1e-9

CIRCLE = '<geom type="cylinder" size="1 5"/>'
SPHERE = '<geom type="sphere" size="1"/>'
SLENDER = '<geom type="ellipsoid" size="1 0.1 1"/>'


def started(geom: str, grid: Grid, sides: Boundaries, axis: int = 0) -> float:
    """Added mass of a body that is set going along an axis, in fluid of 1 kg/m^3."""
    direction = " ".join("1" if a == axis else "0" for a in range(3))
    body = f'<body><joint name="x" type="slide" axis="{direction}"/>{geom}</body>'
    world = make_world(mjcf(body), grid, boundaries=sides, solid_density=1.0)
    command = JointCommand.none(1)
    command.set(np.array([0]), 0.0, 1.0)
    report = advance(world, DT, command=command)
    assert report.momentum_budget_error < 1e-12
    return -float(report.pressure_wrench[1, axis]) * DT


@pytest.mark.parametrize(
    ("half", "off", "within"),
    [(1.5, 0.0, 0.015), (2.0, 0.0, 0.01), (3.0, 0.0, 0.01), (2.0, 0.3, 0.02), (3.0, 0.3, 0.01)],
)
def test_added_mass_of_a_circle(half: float, off: float, within: float) -> None:
    """The same in a box that lies aside by `off` along both axes."""
    grid = box(16, (off - half, off - half), (off + half, off + half))
    assert started(CIRCLE, grid, FLAT) / math.pi == pytest.approx(1.0, abs=within)


def test_added_mass_in_an_oblong_box() -> None:
    """One length of column cannot be right for both directions: alone it is 1.073 and 0.963."""
    grid = box(16, (-4.0, -2.0), (4.0, 2.0))
    along, across = (started(CIRCLE, grid, FLAT, axis) / math.pi for axis in (0, 1))
    assert [along, across] == pytest.approx([1.0, 1.0], abs=2e-3)
    room = box(10, (-3.0, -2.0, -1.5), (3.0, 2.0, 1.5))
    three = [started(SPHERE, room, AROUND, axis) * 1.5 / math.pi for axis in range(3)]
    assert three == pytest.approx([1.0, 1.0, 1.0], abs=5e-3)


def test_added_mass_of_a_slender_ellipse() -> None:
    grid = box(32, (-2.0, -2.0), (2.0, 2.0))
    along, across = (started(SLENDER, grid, FLAT, axis) / math.pi for axis in (0, 1))
    assert across == pytest.approx(1.0, rel=0.02)
    assert along == pytest.approx(0.01, rel=0.1)


@pytest.mark.parametrize("half", [1.5, 2.0])
def test_added_mass_of_a_sphere(half: float) -> None:
    grid = box(6, (-half,) * 3, (half,) * 3)
    assert started(SPHERE, grid, AROUND) == pytest.approx(2.0 / 3.0 * math.pi, rel=0.01)


def test_beside_a_wall_it_is_that_of_the_mirrored_domain() -> None:
    whole = started(CIRCLE, box(8, (-2.0, -2.0), (2.0, 2.0)), FLAT)
    half = started(CIRCLE, box(8, (-2.0, 0.0), (2.0, 2.0)), Boundaries(FAR, FAR, CLOSED, FAR))
    assert 2.0 * half == pytest.approx(whole, rel=1e-4)


def test_beside_an_open_side_it_is_that_of_the_domain_mirrored_with_the_sign_changed() -> None:
    whole = started(CIRCLE, box(8, (-2.0, -2.0), (2.0, 2.0)), FLAT)
    half = started(CIRCLE, box(8, (0.0, -2.0), (2.0, 2.0)), Boundaries(OPEN, FAR, FAR, FAR))
    assert 2.0 * half == pytest.approx(whole, rel=1e-4)


@pytest.mark.parametrize("ends", [RING, CLOSED], ids=lambda side: side.kind)
def test_between_periodic_or_closed_sides_it_is_that_of_the_plane(ends: Boundary) -> None:
    flat = started(CIRCLE, box(8, (-2.0, -2.0), (2.0, 2.0)), FLAT)
    room = box(8, (-2.0, -2.0, -0.25), (2.0, 2.0, 0.25))
    deep = started(CIRCLE, room, Boundaries(FAR, FAR, FAR, FAR, ends, ends))
    assert 2.0 * deep == pytest.approx(flat, rel=3e-3)


@pytest.mark.parametrize("ends", [RING, CLOSED], ids=lambda side: side.kind)
def test_an_endless_channel_is_refused(ends: Boundary) -> None:
    with pytest.raises(ValueError, match="an endless channel"):
        Boundaries(FAR, FAR, ends, ends)


STREAM = Uniform((1.0, 0.0, 0.0))


def held(sides: Boundaries, viscosity: float) -> World:
    """A circle of 1 m held in a stream of 1 m/s."""
    grid = box(8, (-2.0, -2.0), (4.0, 2.0))
    world = make_world(
        mjcf('<body><geom type="cylinder" size="0.5 1"/></body>'),
        grid,
        boundaries=sides,
        viscosity=viscosity,
    )
    world.flow()[1].velocity[0][:] = 1.0
    return world


@pytest.mark.parametrize("viscosity", [0.0, 0.01])
def test_a_stream_past_a_held_body_stays_bounded_and_its_momentum_closes(viscosity: float) -> None:
    """With the weight left out of the pressure that the viscous solve predicts, it blows up."""
    world = held(Boundaries(BoundaryInflow(STREAM), FAR, FAR, FAR), viscosity)
    start_at_once(world, 1e-9)
    energy = kinetic_energy(world)
    for _ in range(20):
        report = advance(world, 0.05)
        assert report.momentum_budget_error < 1e-12
        assert report.fastest < 3.0
    assert kinetic_energy(world) < 1.1 * energy


@pytest.mark.parametrize("dimensions", [2, 3])
def test_the_solve_takes_no_more_iterations_than_with_open_sides(dimensions: int) -> None:
    grid = box(8, (-2.0,) * dimensions, (2.0,) * dimensions)
    body = '<body><freejoint/><geom type="sphere" size="1"/></body>'
    found = []
    for side in (FAR, OPEN):
        sides = Boundaries(*(side,) * (2 * dimensions))
        world = make_world(mjcf(body), grid, boundaries=sides, gravity=(0.0, -1.0, 0.0))
        found.append(advance(world, 0.01, 16).solver_iterations)
    assert found[0] <= found[1] + 1


SMALL = {"domain.resolution": "16"} | {
    f"boundaries.{side}": "far" for side in ("x_max", "y_min", "y_max")
}


def test_trials_workers_and_a_resumed_run_have_the_same_bits() -> None:
    scene = fb.load_scene("ns-chain-2", SMALL)
    with fb.Simulation(scene, workers=1) as simulation:
        simulation.advance_frame()
        middle = World.from_arrays(simulation.world.setup, simulation.world.copy().arrays())
        simulation.advance_frame()
        expected = simulation.world.arrays()
    with fb.Simulation(scene, workers=2) as resumed:
        resumed.restore(Snapshot(middle, 1, None))
        resumed.advance_frame()
        for name, values in resumed.world.arrays().items():
            np.testing.assert_array_equal(values, expected[name])


def test_momentum_closes_where_a_body_reaches_through_a_side() -> None:
    """The side pushes the fluid on the open part of its faces, and the body on the rest."""
    moving = '<body><joint type="slide" axis="1 0 0"/><geom type="cylinder" size="0.5 5"/></body>'
    wall = '<geom type="box" size="0.5 0.5 5" pos="3 0.3 0"/>'
    grid = Grid.slab(48, 48, 1 / 8, (-3, -3))
    world = make_world(mjcf(wall + moving), grid, boundaries=FLAT, solid_density=1.0)
    world.solid.v[:] = 1.0
    for _ in range(10):
        assert advance(world, 0.05).momentum_budget_error < 1e-12


def test_a_body_in_a_sea_goes_on_as_in_a_closed_tank() -> None:
    """Half of the last pressure acts beforehand in both; without it the sea takes twice as much."""
    body = '<body><joint type="slide" axis="1 0 0"/><geom type="cylinder" size="0.5 5"/></body>'
    grid, speeds = Grid.slab(96, 96, 1 / 8, (-6, -6)), []
    for sides in (FLAT, Boundaries()):
        world = make_world(mjcf(body), grid, boundaries=sides, solid_density=1.0)
        world.solid.v[:] = 1.0
        start(world, 0.05)
        advance(world, 0.05, 20)
        speeds.append(world.solid.v[0])
    assert speeds[0] == pytest.approx(speeds[1], abs=0.005)
    assert speeds[0] > 0.9


def test_a_cell_at_a_far_side_that_a_thin_plate_passes_over_takes_no_part(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """It is set aside, and the dipoles leave its face at the side out: else the leak-proof solve
    would ask for a flux through it."""
    solve, ended = PressureSystem.solve, []

    def told(self: PressureSystem, *given: object, **named: object) -> PressureSolution:
        solution = solve(self, *given, **named)
        ended.append(solution.converged)
        return solution

    monkeypatch.setattr(PressureSystem, "solve", told)
    plate = '<geom type="box" size="0.012 0.49 1"/>'  # ends within the cells at both sides
    body = f'<body pos="0.4 0.5 0"><joint type="slide" axis="1 0 0"/>{plate}</body>'
    world = make_world(mjcf(body), box(32, (0.0, 0.0), (1.0, 1.0)), boundaries=FLAT)
    command = JointCommand.none(1)
    command.set(np.array([0]), 1.0, 1.0)
    for _ in range(6):
        assert advance(world, 0.6 / 32, command=command).momentum_budget_error < 1e-12
    assert all(ended)
