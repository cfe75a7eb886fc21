"""Pressure on bodies that overlap: an even one does no work, whatever their joints' angles."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import flowborne
from flowborne import World
from flowborne.coupling import step as steps
from flowborne.coupling.cut import cut_by_bodies
from flowborne.coupling.operators import generalised, pressure_push
from flowborne.coupling.overlaps import handed_on
from flowborne.coupling.report import Outcome
from flowborne.coupling.step import step
from flowborne.fluid.boundary import Boundaries
from flowborne.fluid.grid import Grid
from flowborne.fluid.sides.kinds import BoundaryOpen
from flowborne.kernels.arrays import Array
from flowborne.kernels.coupling_rows import COVERED, ENCLOSED, NARROW, WIDE
from flowborne.sim.simulation import Simulation
from flowborne.solids.dynamics import kinematics
from flowborne.solids.trajectories import JointCommand
from flowborne.worlds import make_world
from flowborne_validation.worlds import mjcf

from .test_flesh_in_flow import leg

LINKS = mjcf(
    "<body><joint type='slide' axis='1 0 0'/><joint type='slide' axis='0 1 0'/>"
    "<joint axis='0 0 1'/>{0}<body pos='.4 0 0'><joint axis='0 0 1'/>{0}"
    "<body pos='.4 0 0'><joint axis='0 0 1'/>{0}</body></body></body>"
)
CAPSULE = "<geom type='capsule' fromto='0 0 0 .4 0 0' size='.13'/>"
BOX = "<geom type='box' pos='.2 0 0' size='.27 .13 .16'/>"
GRIDS = Grid.slab(48, 48, 0.06, (-1.44, -1.44)), Grid((36, 36, 10), 0.08, (-1.44, -1.44, -0.4))
"""Longer than the links: a body that reaches into a side is pushed off it."""


def even_push(world: World) -> Array:
    """T^T J^T 1 over all cells, m^2 or m^3."""
    pose, cut = kinematics(world.setup.solid, world.solid.q), cut_by_bodies(world)
    size = 6 * world.setup.solid.nbody + pose.vertices.size
    return generalised(pose, pressure_push(cut, np.ones(world.flow()[0].grid.shape), size))


@pytest.mark.parametrize("grid", GRIDS)
@pytest.mark.parametrize("geom", [CAPSULE, BOX])
def test_an_even_pressure_does_no_work(grid: Grid, geom: str) -> None:
    @settings(max_examples=12)
    @given(place=st.tuples(*2 * [st.floats(-0.05, 0.05)]), bend=st.tuples(*3 * [st.floats(-2, 2)]))
    def at_any_angle(place: tuple[float, ...], bend: tuple[float, ...]) -> None:
        world = make_world(LINKS.format(geom), grid)
        world.solid.q[:] = *place, *bend
        assert np.abs(even_push(world)).max() < 1e-13
        found.append((cut_by_bodies(world).owner < 0).any())

    found: list[bool] = []
    at_any_angle()
    assert any(found)


def test_beside_an_open_side_covered_cells_have_no_pressure() -> None:
    world = make_world(LINKS.format(CAPSULE), GRIDS[0], boundaries=Boundaries(x_max=BoundaryOpen()))
    world.solid.q[2:] = 0.3, 1.0, -1.0
    assert (cut_by_bodies(world).owner >= 0).all()
    push = even_push(world)
    assert np.abs(push[:2]).max() < 1e-13
    assert np.abs(push[3:]).min() > 1e-5


def test_an_even_pressure_does_no_work_where_flesh_and_bones_overlap() -> None:
    """A bone that reaches out of flesh by half its length."""
    world = make_world(leg(length=0.34), Grid((20, 16, 16), 1.0 / 20.0, (-0.5, -0.4, -0.4)))
    for knee in (0.0, 0.2, 0.5):
        world.solid.q[7] = knee
        assert np.abs(even_push(world)[:7]).max() < 1e-14
        assert (cut_by_bodies(world).owner < 0).any()
    world.solid.v[6] = 1.0
    report = step(world, 0.01)
    assert report.outcome is Outcome.DONE
    assert report.momentum_exchange_error < 1e-14


def test_covered_cells_take_the_mean_of_those_nearer_to_the_fluid() -> None:
    kind = np.full((5, 4, 1), COVERED, np.int8)
    kind[0], kind[:, 3], kind[4, 0] = WIDE, ENCLOSED, WIDE
    kind[1, 0] = NARROW
    rows = np.array([4, 8]), np.array([0, 2, 3]), np.array([7, 1, 7]), np.array([1.0, 2.0, 3.0])
    cells, start, columns, values = handed_on(rows, kind, 9, (False, False, False))
    # (1, 0) has the pressure of (0, 0); (2, 0) half that and half that of (1, 0)'s like, (3, 0)
    np.testing.assert_array_equal(cells, [0, 16])
    np.testing.assert_array_equal(start, [0, 2, 3])
    np.testing.assert_array_equal(columns, [1, 7, 7])
    np.testing.assert_allclose(values, [2.0, 2.5, 1.5])


def test_covered_cells_take_the_pressure_from_across_a_periodic_side() -> None:
    kind = np.full((4, 3, 1), ENCLOSED, np.int8)
    kind[0, 1], kind[3, 1] = COVERED, WIDE
    rows = np.array([1]), np.array([0, 1]), np.array([2]), np.array([5.0])
    cells, _, columns, values = handed_on(rows, kind, 6, (True, False, False))
    assert (cells, columns, values) == ([10], [2], [5.0])


def test_cells_that_no_way_leads_out_of_have_no_pressure() -> None:
    kind = np.full((3, 3, 1), ENCLOSED, np.int8)
    kind[1, 1] = COVERED
    rows = np.array([4]), np.array([0, 1]), np.array([0]), np.array([1.0])
    assert handed_on(rows, kind, 6, (False, False, False))[0].size == 0


FREE = np.arange(3, 8)
TORQUE = 0.4 * np.array([1.0, -1.0, 1.0, -1.0, 1.0])


def eel(y_max: str) -> World:
    changed = {"domain.resolution": "48", "boundaries.y_max": f'"{y_max}"'}
    return Simulation(flowborne.load_scene("eel-free", changed), workers=1).world


def test_torques_in_a_closed_tank_bend_as_in_one_with_an_open_side(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    equations, torque = steps.equations, np.zeros(8)
    torque[FREE] = TORQUE
    monkeypatch.setattr(
        steps, "equations", lambda w, b, force, *rest: equations(w, b, force + torque, *rest)
    )
    closed, one_open = eel("no-slip"), eel("open")  # of joints that stop at 20 degrees
    for world in (closed, one_open):
        for _ in range(5):
            assert step(world, 1.0 / 60.0).outcome is Outcome.DONE
    bend = np.degrees(closed.solid.q[FREE])
    assert np.abs(bend).min() > 19.0
    np.testing.assert_allclose(bend, np.degrees(one_open.solid.q[FREE]), atol=0.1)


def test_a_weak_drive_moves_as_under_its_torque_whatever_it_is_told() -> None:
    """Towards 30 rad/s and 10,000 rad/s; neither is reached."""
    worlds = []
    for speed in (30.0, 1e4):
        world = eel("no-slip")
        for _ in range(3):
            command = JointCommand.none(8)
            told = speed * np.sign(TORQUE)
            command.set(FREE, told, told, np.abs(TORQUE))
            report = step(world, 1.0 / 60.0, command)
            assert report.outcome is Outcome.DONE
            np.testing.assert_array_equal(report.actuator[FREE], TORQUE)
        worlds.append(world)
    np.testing.assert_allclose(worlds[0].solid.q, worlds[1].solid.q, atol=1e-9)
    np.testing.assert_allclose(worlds[0].solid.v, worlds[1].solid.v, atol=1e-7)
