"""Steps of a trial in which bodies stand: what is kept, and what is not solved for again."""

from __future__ import annotations

import pickle
from dataclasses import replace

import numpy as np
import pytest

from flowborne import Grid, World
from flowborne.bodies import JointCommand
from flowborne.coupling import leak_proof
from flowborne.coupling.report import StepReport
from flowborne.coupling.step import step
from flowborne.worlds import Boundaries, BoundaryInflow, BoundaryOpen, advance, make_world
from flowborne_validation.worlds import mjcf

GRID = Grid.slab(40, 40, 1.0 / 32, (-0.5, -0.6))


def along(x, y, z, time=0.0):  # type: ignore[no-untyped-def]
    return 1.0 + 0 * x, 0 * x, 0 * x


SIDES = Boundaries(BoundaryInflow(along), BoundaryOpen())
HINGE = '<body><joint axis="0 0 1"/><geom type="box" size=".11 .07 1"/></body>'
DT = 1.0 / 64
STEPS = 6


@pytest.fixture
def world() -> World:
    """A block in a stream, shortly after it began to turn."""
    world = make_world(mjcf(HINGE), GRID, boundaries=SIDES, solid_density=1500.0)
    for _ in range(3):
        advance(world, DT)
    return world


@pytest.fixture
def solves(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """One entry for each projection of a leak-proof field."""
    found: list[int] = []
    corrected = leak_proof.corrected

    def counted(*given):  # type: ignore[no-untyped-def]
        found.append(1)
        return corrected(*given)

    monkeypatch.setattr(leak_proof, "corrected", counted)
    return found


def stand(world: World, trial: bool) -> list[StepReport]:
    """The block is turned in one step, and stands in the others."""
    world.setup = world.setup.hypothetical if trial else replace(world.setup, trial=False)
    command, reports = JointCommand.none(1), []
    for rate in (0.5, *(STEPS * [0.0])):
        command.set(np.array([0]), rate, 0.0)
        reports.append(step(world, DT, command))
    return reports


def test_a_trial_solves_for_the_field_once_after_a_body_has_stopped(
    world: World, solves: list[int]
) -> None:
    stand(world, True)
    assert len(solves) == 2


def test_a_run_solves_for_it_in_every_step(world: World, solves: list[int]) -> None:
    stand(world, False)
    assert len(solves) == STEPS + 1


def test_what_is_not_solved_for_would_change_little(
    world: World, monkeypatch: pytest.MonkeyPatch, solves: list[int]
) -> None:
    """The forces of a trial in which every step solves for it."""
    forces = [r.pressure_wrench[1] for r in stand(world.copy(), True)]
    assert len(solves) == 2
    unsettled = leak_proof.unsettled

    def strict(*given):  # type: ignore[no-untyped-def]
        return unsettled(*given) | np.uint8(given[-1] < 0.0)

    monkeypatch.setattr(leak_proof, "unsettled", strict)
    for force, report in zip(forces, stand(world, True), strict=True):
        scale = np.abs(report.pressure_wrench[1]).max()
        assert np.abs(force - report.pressure_wrench[1]).max() < 1e-5 * scale
    assert len(solves) == 2 + STEPS + 1


def test_volumes_and_matrices_are_those_of_the_step_before(world: World) -> None:
    command = JointCommand.none(1)
    command.set(np.array([0]), 0.0, 0.0)
    world.setup = world.setup.hypothetical
    step(world, DT, command)
    assert world.pressed is not None
    assert world.volumes is not None
    step(world, DT, command)
    first, bodies = world.pressed, world.driven
    assert first is not None
    assert bodies is not None
    assert first[0] is world.volumes[1]
    for _ in range(3):
        step(world, DT, command)
        assert world.pressed is first
        assert world.driven[1].system.A is bodies[1].system.A
        assert world.driven[1] is not bodies[1]
    for other in (world.copy(), pickle.loads(pickle.dumps(world))):
        assert other.pressed is other.driven is None
    command.set(np.array([0]), 0.5, 0.0)
    step(world, DT, command)
    assert world.pressed is not first
    assert world.driven[1].system.A is not bodies[1].system.A


def test_a_flow_that_was_put_in_is_solved_for(world: World, solves: list[int]) -> None:
    stand(world, True)
    world.flow()[1].velocity[0][20, 10] += 0.1
    solves.clear()
    command = JointCommand.none(1)
    command.set(np.array([0]), 0.0, 0.0)
    step(world, DT, command)
    assert solves
