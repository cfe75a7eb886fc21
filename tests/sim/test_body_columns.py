"""What a history says of the bodies that a scene names."""

from pathlib import Path

import numpy as np
import pytest

from flowborne import (
    FrameReport,
    Grid,
    SceneError,
    Simulation,
    Snapshot,
    StepReport,
    World,
    load_scene,
    step,
)
from flowborne.bodies import TrajectorySinusoid, WindForce
from flowborne.sim.columns import Columns
from flowborne.worlds import make_world
from flowborne_validation.worlds import mjcf

BALL = (
    '<body name="ball" pos="0.1 0 0"><joint name="along" type="slide" axis="1 0 0"{spring}/>'
    '<geom type="sphere" size="0.1" pos="0.2 0 0"/></body>'
)


def end_of(world: World, report: StepReport) -> Snapshot:
    """The end of a frame of one step, without a controller."""
    none = np.zeros(0)
    frame = FrameReport(1, world.time, (report,), np.nan, {}, none, none, False, {})
    return Snapshot(world, 1, frame)


def test_velocity_of_a_free_body_is_that_where_it_is():
    """The central difference of its path; v itself would be that of half a step later."""
    force = WindForce((30.0, 0.0, 0.0), ("ball",))
    grid = Grid.slab(24, 24, 1 / 24, (-0.5, -0.5))
    world = make_world(
        mjcf(BALL.format(spring="")), grid, solid_density=2.0, winds=(force,), density=1.0
    )
    dt, path, told = 0.002, [], []
    columns = Columns(world.setup, bodies=("ball",))
    for _ in range(5):
        values = columns.values(end_of(world, step(world, dt)))
        path.append(values["ball_centre_x_m"])
        told.append(values["ball_velocity_x_m/s"])
    assert world.parts == 1, "the path is known at the end of every part"
    differences = (np.array(path[2:]) - np.array(path[:-2])) / (2.0 * dt)
    np.testing.assert_allclose(told[1:-1], differences, rtol=1e-12)
    assert abs(world.solid.v[0] / told[-1] - 1.0) > 0.05


def test_force_of_a_wind_is_told_with_its_torque_about_the_centre_of_mass():
    world = make_world(
        mjcf(BALL.format(spring="")),
        slab=True,
        solid_density=1000.0,
        winds=(WindForce((3.0, 2.0, 0.0), ("ball",)),),
    )
    columns = Columns(world.setup, bodies=("ball",))
    values = columns.values(end_of(world, step(world, 0.01)))
    assert [values[f"ball_force_{a}_N"] for a in "xyz"] == pytest.approx([3.0, 2.0, 0.0])
    assert [values[f"ball_torque_{a}_Nm"] for a in "xyz"] == pytest.approx([0.0, 0.0, 0.0])


def test_velocity_of_a_driven_body_is_told_where_the_body_is():
    told = TrajectorySinusoid(np.array([0]), 0.05, 1.0)
    grid = Grid.slab(24, 24, 1 / 24, (-0.5, -0.5))
    world = make_world(mjcf(BALL.format(spring="")), grid, motions=(told,))
    columns = Columns(world.setup, bodies=("ball",))
    for _ in range(3):
        report = step(world, 0.02)
    values = columns.values(end_of(world, report))
    before, after = (told.position(world.time + sign * 0.02)[0] for sign in (-1.0, 1.0))
    assert values["ball_velocity_x_m/s"] == pytest.approx((after - before) / 0.04, rel=1e-12)
    assert values["ball_velocity_x_m/s"] == pytest.approx(told.velocity(world.time)[0], rel=3e-3)
    assert values["ball_force_x_N"] == report.fluid_wrench()[1, 0]


def test_history_holds_what_the_scene_names(tmp_path: Path):
    scene = load_scene("block-drag-max", {"output.bodies": '["block"]'})
    with Simulation(scene, workers=1) as simulation:
        before = simulation.measure()
        simulation.advance_frame()
        after = simulation.measure()
    assert np.isnan(before["block_force_x_N"])
    assert np.isfinite([value for name, value in after.items() if name.startswith("block_")]).all()
    assert list(after) == list(simulation.columns.names)


def test_unknown_body_is_named_with_the_place():
    with pytest.raises(SceneError, match=r"output.*body 'blok' is not in model.*block"):
        load_scene("block-drag-max", {"output.bodies": '["blok"]'})
