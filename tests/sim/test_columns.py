import numpy as np
import pytest

from flowborne import FrameReport, Grid, Setup, Snapshot, SolidModel, World, step
from flowborne.sim.columns import Columns, axes_of
from flowborne.solids.geoms import quaternion_of
from flowborne.worlds import Boundaries, BoundaryInflow, BoundaryOpen, cut_by_bodies, make_world
from flowborne_validation.worlds import mjcf

MODEL = """
<mujoco>
  <compiler angle="radian"/>
  <worldbody>
    <body name="cart" pos="0 2 0">
      <joint name="rail" type="slide" axis="1 0 0"/>
      <geom name="cart" type="box" size="0.5 0.1 1"/>
      <body name="arm">
        <joint name="hinge" axis="0 0 1"/>
        <geom name="arm" type="box" size="0.5 0.1 1" pos="0.5 0 0"/>
      </body>
    </body>
  </worldbody>
</mujoco>
"""


def test_joints_and_bodies_are_told_with_their_units():
    model = SolidModel.from_string(MODEL, slab=True)
    world = World(Setup(model), model.rest(), time=0.5)
    world.solid.q[:] = [3.0, np.pi / 2]
    columns = Columns(world.setup)
    values = columns.values(Snapshot(world, 12, None))
    assert tuple(values) == columns.names
    assert (values["frame"], values["time_s"]) == (12, 0.5)
    assert (values["position_rail_m"], values["angle_hinge_rad"]) == (3.0, np.pi / 2)
    assert [values[f"arm_{axis}_m"] for axis in "xyz"] == [3.0, 2.0, 0.0]
    assert values["arm_qw"] == pytest.approx(np.sqrt(0.5))
    assert values["arm_qz"] == pytest.approx(np.sqrt(0.5))
    assert np.isnan(values["drag_N"])
    assert not [column for column in columns.names if column.startswith("target_")]


def test_fastest_is_the_largest_speed_of_any_step_across_an_open_face():
    """A disc in a stream that slows down: its sides are passed faster than the stream flows."""

    def slowing(x, y, z, time):
        return (2.0 if time < 0.015 else 1.0) + 0 * x, 0 * x, 0 * x

    sides = Boundaries(x_min=BoundaryInflow(slowing), x_max=BoundaryOpen())
    grid = Grid.slab(32, 32, 1 / 32, (-0.5, -0.5))
    world = make_world(mjcf('<geom type="sphere" size="0.1"/>'), grid, boundaries=sides)
    world.setup = world.setup.but(splits=True)
    columns = Columns(world.setup)
    steps, largest = [], []
    for _ in range(2):
        steps.append(step(world, 0.01))
        opened = cut_by_bodies(world).open
        largest.append(
            max(np.abs(world.fluid.velocity[a])[opened[a] > 0.0].max() for a in grid.axes)
        )
    none = np.zeros(0)
    frame = FrameReport(1, world.time, tuple(steps), np.nan, {}, none, none, False, {})
    assert largest[0] > 1.5 * largest[1] > 1.5
    assert columns.values(Snapshot(world, 1, frame))["fastest_m/s"] == largest[0]
    assert np.isnan(columns.values(Snapshot(world, 0, None))["fastest_m/s"])


@pytest.mark.parametrize(
    ("stream", "along", "across"),
    [
        (None, [1, 0, 0], [0, 1, 0]),
        ((2.0, 0.0, 0.0), [1, 0, 0], [0, 1, 0]),
        ((0.0, -3.0, 0.0), [0, -1, 0], [1, 0, 0]),
        ((0.0, 0.0, 1.0), [0, 0, 1], [1, 0, 0]),
    ],
)
def test_lift_is_a_quarter_turn_to_the_left_of_drag(stream, along, across):
    np.testing.assert_allclose(axes_of(stream), [along, across], atol=1e-15)


def test_quaternions_turn_as_their_matrices_do():
    for seed in range(5):
        rotation, _ = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))
        rotation *= np.linalg.det(rotation)
        w, *xyz = quaternion_of(rotation)
        assert w >= 0
        v = np.array([0.3, -0.5, 0.7])
        turned = v + 2 * np.cross(xyz, np.cross(xyz, v) + w * v)
        np.testing.assert_allclose(turned, rotation @ v, atol=1e-14)
