"""The part of the fluid's force with which it resists the bodies' acceleration."""

import numpy as np
import pytest

from flowborne import FrameReport, Grid, Simulation, StepReport
from flowborne.coupling.step import step
from flowborne.solids.trajectories import JointCommand
from flowborne.worlds import Boundaries, BoundaryInflow, BoundaryOpen, make_world
from flowborne_validation.worlds import mjcf

BALL = (
    '<body name="ball"><joint name="along" type="slide" axis="1 0 0"/>'
    '<geom type="sphere" size="0.15"/></body>'
)


def stream(x, y, z, time):
    return 0.5 + 0 * (x + y + z), 0 * (x + y + z), 0 * (x + y + z)


def world_with(sides):
    grid = Grid.slab(24, 24, 1 / 24, (-0.5, -0.5))
    world = make_world(mjcf(BALL), grid, density=1000.0, boundaries=sides)
    world.setup = world.setup.but(splits=True)
    return world


def driven(world, velocity, dt=0.01):
    """A step at the end of which the ball has this velocity (m/s)."""
    command = JointCommand.none(1)
    command.set(np.array([0]), world.solid.v, velocity)
    return step(world, dt, command)


def test_all_of_a_start_in_still_fluid_is_added_mass():
    report = driven(world_with(Boundaries()), 0.2)
    force = report.pressure_wrench[1, 0]
    assert force < -100.0
    assert report.added_mass_wrench[1, 0] == pytest.approx(force, rel=1e-4)


def test_a_jump_of_velocity_in_a_stream_is_in_the_added_mass_alone():
    """What is left of the force is what it would have been without the jump."""
    sides = Boundaries(x_min=BoundaryInflow(stream), x_max=BoundaryOpen())
    reports = []
    for jump in (0.0, 0.3):
        world = world_with(sides)
        for _ in range(3):
            driven(world, 0.0)
        reports.append(driven(world, jump))
    steady, jumped = (r.pressure_wrench[1] for r in reports)
    assert not reports[0].added_mass_wrench.any()
    assert abs(jumped[0] - steady[0]) > 100.0
    rest = jumped - reports[1].added_mass_wrench[1]
    np.testing.assert_allclose(rest, steady, atol=1e-4 * abs(jumped[0]))


def test_the_means_of_a_frame_add_up_to_the_impulse_that_it_gave():
    world = world_with(Boundaries())
    steps = tuple(driven(world, v, dt) for v, dt in ((0.2, 0.01), (0.3, 0.005), (-0.1, 0.01)))
    nothing = np.zeros(0)
    frame = FrameReport(1, world.time, steps, np.nan, {}, nothing, nothing, False, {})
    whole = (frame.drag() + frame.mean(StepReport.central_added_mass)[:, :3])[1]
    given = sum(report.momentum_exchanged for report in steps)
    np.testing.assert_allclose(0.025 * whole, given, atol=1e-13 * abs(given[0]))


def test_what_is_asked_for_in_time_is_the_same_and_later_an_error() -> None:
    world, split = world_with(Boundaries()), world_with(Boundaries())
    world.setup = world.setup.but(splits=False)
    reports = [driven(world, 0.2), driven(split, 0.2)]
    np.testing.assert_array_equal(*(report.added_mass_wrench for report in reports))
    asked_late = driven(world, 0.3)
    driven(world, 0.2)
    with pytest.raises(ValueError, match="before the next"):
        _ = asked_late.added_mass_wrench


def test_what_is_asked_for_later_or_by_many_frames_is_the_same() -> None:
    frames = []
    for often in (True, False):
        with Simulation("block-drag-max", workers=1) as simulation:
            for n in range(3):
                report = simulation.advance_frame()
                assert not report.step.added_mass.done
                if often or n == 2:
                    row = simulation.measure()
                assert simulation.setup.splits == (often and n > 0)
            frames.append(row)
    assert frames[0] == frames[1]


def test_a_hypothetical_step_tells_motions_and_forces_alone():
    world = world_with(Boundaries())
    world.setup = world.setup.hypothetical
    report = driven(world, 0.2)
    assert np.isnan(report.added_mass_wrench).all()
    assert np.isnan([*report.momentum_fluid, report.divergence, report.fastest]).all()
    assert np.isfinite(report.pressure_wrench).all()
