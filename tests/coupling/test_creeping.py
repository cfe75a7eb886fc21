"""Creeping flow: viscosity, pressure and bodies agree within a step."""

import numpy as np
import pytest

from flowborne import Grid, World, step
from flowborne.bodies import JointCommand
from flowborne.coupling import creeping
from flowborne.coupling.bodies_step import equations
from flowborne.coupling.creeping import AGREED, Sweeps
from flowborne.coupling.cut import departure, gradient_on, pose_and_cut
from flowborne.coupling.viscous_solve import viscosity_on
from flowborne.fluid.grid import faces_of
from flowborne.runs.summary import APART
from flowborne.solvers.v_cycle import VCycle
from flowborne.worlds import Boundaries, BoundaryNoSlip, advance, make_world
from flowborne_validation.creeping import held_rod, sinking_rod

WALL = BoundaryNoSlip()


@pytest.mark.parametrize("number", [10.0, 100.0, 2e4])
def test_a_rod_between_walls_has_its_drag_at_once(number: float) -> None:
    """Faxen 1946; 0.96, 0.61 and 0.18 of it with one sweep."""
    (drag,) = held_rod(10, 1e-4, number, 0.5).values()
    assert drag.values == pytest.approx(1.0, abs=0.03)


def test_a_rod_sinks_as_fast_as_it_should_in_its_second_step() -> None:
    for speed in sinking_rod(10, 417.0).values():
        assert speed.values == pytest.approx(1.0, abs=0.03)


def stirred(shape: tuple[int, int, int], viscosity: float) -> World:
    """A box that slides and turns freely beside a ball that is pushed by it, in a closed box."""
    h = 1.0 / shape[0]
    grid = Grid(shape, h, (0.0, 0.0, 0.0 if shape[2] > 1 else -0.5 * h))
    z = 0.5 * h * shape[2] if shape[2] > 1 else 0.0
    joints = '<joint type="slide" axis="1 0 0"/><joint type="slide" axis="0 1 0"/>'
    bodies = (
        f'<body pos=".35 .5 {z}">{joints}<joint type="hinge" axis="0 0 1"/>'
        f'<geom type="box" size=".12 .1 .14"/></body>'
        f'<body pos=".58 .52 {z}">{joints}<geom type="sphere" size=".1"/></body>'
    )
    world = make_world(
        f"<mujoco><worldbody>{bodies}</worldbody></mujoco>",
        grid,
        solid_density=2.0,
        viscosity=viscosity,
        boundaries=Boundaries(*(WALL,) * (6 if shape[2] > 1 else 4)),
    )
    world.solid.v[:3] = 1.0, 0.2, 3.0
    return world


@pytest.mark.parametrize("shape", [(20, 20, 1), (16, 16, 12)])
def test_momentum_closes_and_sweeps_agree_with_contacts(shape: tuple[int, int, int]) -> None:
    world = stirred(shape, 100.0)
    for _ in range(4):
        report = advance(world, 0.002)
        assert 1 < report.sweeps < creeping.SWEEPS
        assert report.sweep_error <= AGREED
        assert report.momentum_budget_error < 1e-10


def test_weak_friction_takes_one_sweep() -> None:
    world = stirred((20, 20, 1), 1e-3)
    assert step(world, 0.002).sweeps == 1


def test_a_step_that_does_not_agree_says_by_how_much(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(creeping, "SWEEPS", 2)
    world = stirred((20, 20, 1), 1e5)
    report = step(world, 0.002)
    assert report.sweeps == 2
    assert report.sweep_error > AGREED
    assert APART == AGREED


def test_sweeps_solve_a_linear_system() -> None:
    """p_out - p = b - A p, and an outflow that goes with it."""
    size = 16
    random = np.random.default_rng(0)
    root = random.normal(size=(size, size))
    matrix = np.eye(size) + 0.3 * root @ root.T / size
    exact = random.normal(size=size)
    shape = (4, 4, 1)
    sweeps = Sweeps(np.ones(shape), np.ones(shape), np.full(shape, -1, np.int32), 0.01)
    pressure = np.ones(shape)
    for _ in range(size):
        missing = (matrix @ (exact - pressure.ravel())).reshape(shape)
        following = sweeps.next(pressure, pressure + missing, -missing)
        if following is None:
            break
        pressure = following
    assert sweeps.error <= AGREED
    assert pressure.ravel() == pytest.approx(exact, abs=0.05)


@pytest.mark.parametrize("shape", [(24, 17, 1), (9, 12, 10)])
def test_a_v_cycle_is_symmetric_and_near_the_inverse(shape: tuple[int, int, int]) -> None:
    random = np.random.default_rng(1)
    weights = faces_of(
        [random.uniform(0.5, 1.5, [n + (a == d) for a, n in enumerate(shape)]) for d in range(3)]
    )
    for d in range(3):
        ends = [slice(None)] * 3
        ends[d] = [0, -1]
        weights[d][tuple(ends)] = 0.0
    rest = random.uniform(0.0, 0.01, shape)

    def diagonal_less_links(x: np.ndarray) -> np.ndarray:
        out = rest * x
        for d in range(3):
            flow = np.zeros_like(weights[d])
            inner = [slice(None)] * 3
            inner[d] = slice(1, -1)
            flow[tuple(inner)] = weights[d][tuple(inner)] * np.diff(x, axis=d)
            out -= np.diff(flow, axis=d)
        return out

    cycle = VCycle(weights, rest, np.ones(shape), np.zeros(3, bool))
    a, b = random.normal(size=(2, *shape))
    one, other = float((a * cycle.times(b)).sum()), float((b * cycle.times(a)).sum())
    assert one == pytest.approx(other, rel=1e-4)
    error = a.copy()
    for _ in range(8):
        error -= cycle.times(diagonal_less_links(error))
    assert np.linalg.norm(error) < 0.05 * np.linalg.norm(a)


def test_friction_lets_out_of_a_cell_what_its_volume_and_viscosity_say() -> None:
    """V / mu in the bulk: what `Sweeps` takes for the pressure's answer to an outflow."""
    for shape in ((16, 16, 1), (12, 12, 12)):
        world = stirred(shape, 100.0)
        start = departure(world)
        given = (
            world,
            world.flow()[1].velocity,
            start.volumes,
            gradient_on(world, start.cut, start.volumes),
        )
        pose, cut = pose_and_cut(world)
        driven = equations(world, start.bodies, np.zeros(5), JointCommand.none(5), 0.002)
        found = viscosity_on(*given, cut, (), pose, driven)
        assert found.system is not None
        grid = world.flow()[0].grid
        corner = found.system.yields(cut.open)[2, 2, shape[2] // 2]
        assert corner == pytest.approx(grid.cell_volume / 100.0, rel=1e-12)
