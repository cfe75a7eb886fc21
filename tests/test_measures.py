import numpy as np
import pytest

from flowborne.coupling.world import Setup, World
from flowborne.measures import Measures, quaternion
from flowborne.solids.model import SolidModel

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
    measures = Measures(world.setup, None, None)
    values = measures.values(world, 12, None)
    assert tuple(values) == measures.columns
    assert (values["frame"], values["time_s"]) == (12, 0.5)
    assert (values["position_rail_m"], values["angle_hinge_rad"]) == (3.0, np.pi / 2)
    assert [values[f"arm_{axis}_m"] for axis in "xyz"] == [3.0, 2.0, 0.0]
    assert values["arm_qw"] == pytest.approx(np.sqrt(0.5))
    assert values["arm_qz"] == pytest.approx(np.sqrt(0.5))
    assert np.isnan(values["drag_N"])
    assert not [column for column in measures.columns if column.startswith("target_")]


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
    model = SolidModel.from_string(MODEL, slab=True)
    measures = Measures(Setup(model), None, stream)
    np.testing.assert_allclose(measures._along, along, atol=1e-15)
    np.testing.assert_allclose(measures._across, across, atol=1e-15)


def test_quaternions_turn_as_their_matrices_do():
    for seed in range(5):
        rotation, _ = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))
        rotation *= np.linalg.det(rotation)
        w, *xyz = quaternion(rotation)
        assert w >= 0
        v = np.array([0.3, -0.5, 0.7])
        turned = v + 2 * np.cross(xyz, np.cross(xyz, v) + w * v)
        np.testing.assert_allclose(turned, rotation @ v, atol=1e-14)
