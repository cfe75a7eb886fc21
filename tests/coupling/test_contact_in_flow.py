"""Contact in a fluid: the contacts of a step are found in few passes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from flowborne import Grid, Outcome, World, step
from flowborne.bodies import JointCommand
from flowborne.coupling import solve
from flowborne.coupling.viscous_solve import Viscosity
from flowborne.worlds import PressureSolution, PressureSystem, advance, make_world

BOX = """<mujoco><worldbody>
  <geom type="plane" size="4 4 1" pos="0 -0.4 0" zaxis="0 1 0" condim="{condim}" friction="0 0 0"/>
  <body pos="0 -0.355 0"><freejoint/>
    <geom type="box" size="0.1 0.05 0.1" condim="{condim}" friction="0 0 0" density="2000"/>
  </body>
</worldbody></mujoco>"""

GRIDS = {
    "slab": Grid.slab(16, 16, 1.0 / 16, (-0.5, -0.4)),
    "room": Grid((12, 12, 12), 1.0 / 12, (-0.5, -0.4, -0.5)),
    "no fluid": None,
}


def sliding(grid: Grid | None, condim: int) -> World:
    """A box that slides over a floor without friction, under gravity."""
    world = make_world(BOX.format(condim=condim), grid, gravity=(0.0, -9.81, 0.0), density=1000.0)
    world.solid.v[0] = 0.5
    return world


@pytest.mark.parametrize("grid", GRIDS)
def test_contact_without_friction_settles(grid: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Four edges of a pyramid that are one: they do not take turns, and settle like one."""
    passes: list[int] = []
    correct = solve.correct

    def counted(*given: object) -> object:
        passes[-1] += 1
        return correct(*given)

    monkeypatch.setattr(solve, "correct", counted)
    bare, plain = sliding(GRIDS[grid], 3), sliding(GRIDS[grid], 1)
    for _ in range(20):
        passes.append(0)
        assert advance(bare, 0.01).contacts > 0
        passes.append(0)
        advance(plain, 0.01)
        assert passes[-2] <= passes[-1] + 1, passes
    np.testing.assert_allclose(bare.solid.v, plain.solid.v, atol=1e-6)


@pytest.mark.parametrize("grid", GRIDS)
def test_what_does_not_settle_is_told_apart_from_a_solve(
    grid: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """One pass is too few for a drive that gives way: its dof is named, and no solve is blamed."""
    world = sliding(GRIDS[grid], 1)
    command = JointCommand.none(world.setup.solid.nv)
    command.set(np.array([0]), 5.0, 5.0, 1.0)
    assert step(world.copy(), 0.01, command).outcome is Outcome.DONE
    monkeypatch.setattr(solve, "PASSES", 1)
    report = step(world, 0.01, command)
    assert report.outcome is Outcome.NOT_SETTLED
    assert 0 in report.unsettled


def missed(solution: PressureSolution) -> PressureSolution:
    return replace(solution, converged=False)


def test_each_solve_that_misses_its_tolerance_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    world = sliding(GRIDS["slab"], 1)
    smooth, solved = Viscosity.solve, PressureSystem.solve
    monkeypatch.setattr(Viscosity, "solve", lambda *given: (*smooth(*given)[:2], False))
    assert step(world.copy(), 0.01).outcome is Outcome.VISCOSITY_NOT_CONVERGED
    monkeypatch.setattr(
        PressureSystem, "solve", lambda *given, **named: missed(solved(*given, **named))
    )
    assert step(world.copy(), 0.01).outcome is Outcome.PRESSURE_NOT_CONVERGED
