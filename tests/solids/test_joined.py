"""A base that is fixed here does not push away what hangs on it; floors and the rest collide."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest

from flowborne.solids.joined import joined_pairs
from flowborne.solids.mjcf import compiled

MODEL = """<mujoco><worldbody>{floor}
<body name="trunk" pos="0 0 1">{root}<geom type="box" size=".2 .1 .1"/>
 <body name="hip" pos=".2 0 0">{joint}<geom type="box" size=".1 .05 .05"/>
  <body name="shank" pos=".1 0 0"><joint/><geom type="capsule" size=".03 .1"/></body></body></body>
</worldbody></mujoco>"""

HINGE, FREE = '<joint type="hinge" axis="0 1 0"/>', "<freejoint/>"


def model(joint: str = HINGE, root: str = "", floor: str = "") -> mujoco.MjModel:
    return compiled(MODEL.format(joint=joint, root=root, floor=floor), False, (0.0, 0.0, 0.0))


def test_a_hip_within_its_fixed_trunk_stays_at_rest() -> None:
    mj = model()
    assert joined_pairs(mj) == ["trunk and hip"]
    data = mujoco.MjData(mj)
    mujoco.mj_step(mj, data, 50)
    np.testing.assert_allclose(data.qpos, 0.0, atol=1e-12)


def test_bodies_without_a_name_are_called_by_their_numbers() -> None:
    text = MODEL.replace(' name="trunk"', "").replace(' name="hip"', "")
    mj = compiled(text.format(joint=HINGE, root="", floor=""), False, (0.0, 0.0, 0.0))
    assert joined_pairs(mj) == ["body1 and body2"]


@pytest.mark.parametrize(
    "given",
    [
        {"root": FREE},  # MuJoCo leaves the pair out itself
        {"joint": '<joint type="slide" axis="0 0 1"/>'},  # what lies on it may slide
        {"joint": HINGE + '<joint type="slide" axis="1 0 0"/>'},
    ],
)
def test_no_other_pair_is_left_out(given: dict[str, str]) -> None:
    assert joined_pairs(model(**given)) == []


def test_a_leg_still_meets_the_floor_of_the_world() -> None:
    """A base whose geoms are the world's own, beside a plane: MuJoCo cannot leave out one alone."""
    text = MODEL.replace('<body name="trunk" pos="0 0 1">{root}', "").replace(
        "</body></body></body>", "</body></body>"
    )
    assert joined_pairs(compiled(text.format(joint=HINGE, floor=""), False, (0.0,) * 3)) == [
        "world and hip"
    ]
    floor = '<geom type="plane" size="1 1 1" pos="0 0 -1"/>'
    assert joined_pairs(compiled(text.format(joint=HINGE, floor=floor), False, (0.0,) * 3)) == []
