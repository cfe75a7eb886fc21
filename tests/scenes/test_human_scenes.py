"""The walking human of Figs. 5 and 9, in the middle of a walk."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np

from flowborne.kernels.arrays import Array
from flowborne.motion.human.skeleton import SIDES
from flowborne.motion.quaternions import twist
from flowborne.scenes.load import load_scene
from flowborne.sim.simulation import Simulation
from flowborne.solids.dynamics import kinematics
from flowborne_validation.figures import posture

TWO_STRIDES, ONE_STRIDE = (80, 55), (54, 28)
"""Frames that are run, and of them the last, over which means are taken: arms have settled after
one stride, a leaning back after two."""

SIDEWAYS = np.array([0.0, 1.0, 0.0])

ARMS = [f"{side}_{part}" for side in SIDES for part in ("upper_arm", "forearm", "hand")]


@dataclass(frozen=True)
class Walked:
    """Means over the last frames.

    lean    degrees of the torso's centre of mass ahead of the vertical through the back's joint
    ahead   (2,) m, centre of mass of left and right arm ahead of its shoulder
    drag    N on both arms, along the wind
    torque  N m at the back, median
    sunk    m, how deep the lowest sole of all frames is below the ground
    """

    lean: float
    ahead: Array
    drag: float
    torque: float
    sunk: float


@cache
def walked(
    scene: str, settings: tuple[tuple[str, str], ...] = (), frames: tuple[int, int] = TWO_STRIDES
) -> Walked:
    rows, lowest = [], []
    with Simulation(load_scene(f"human-{scene}", dict(settings))) as simulation:
        model = simulation.world.setup.solid
        arms = [model.body(name) for name in ARMS]
        above = np.flatnonzero(model.moves[:, model.dofs_of("lower_back")[0]])
        for _ in range(frames[0]):
            step = simulation.advance_frame().step
            q = simulation.world.solid.q
            pose = kinematics(model, q)
            mass = model.body_mass[above]
            joint = pose.body_position[model.body("lower_back")]
            centre = mass @ pose.mass_centre[above] / mass.sum() - joint
            torque = np.linalg.norm(step.actuator[model.dofs_of("lower_back")])
            drag = -step.wind_wrench[arms, 0].sum()
            lean = np.degrees(np.arctan2(centre[0], centre[2]))
            rows.append([lean, *posture(model, q)[0], drag, torque])
            toes = [model.geom_names.index(f"{side}_toes") for side in SIDES]
            depth = (np.abs(pose.geom_rotation[toes, 2]) * model.geom_size[toes]).sum(axis=1)
            lowest.append(float((pose.geom_position[toes, 2] - depth).min()))
    late = np.array(rows)[-frames[1] :]
    mean = late.mean(axis=0)
    torque = float(np.median(late[:, 4]))
    return Walked(mean[0], mean[1:3], mean[3], torque, -min(lowest))


def test_the_back_works_less_than_in_the_clip() -> None:
    """Against a back that follows its clip, upright in the wind, while a neck is controlled."""
    other = (("control.0.joints", '["upper_neck"]'), ("objectives.0.joints", '["upper_neck"]'))
    assert walked("wind-back").torque < 0.7 * walked("wind-back", other).torque


def test_the_back_comes_upright() -> None:
    """From a lean of 20 degrees."""
    assert walked("gravity-back").lean < 8.0


def test_the_walker_leans_into_the_wind() -> None:
    """By about what the wind's force asks for beside the weight, and not without wind."""
    still = walked("gravity-back", (("initial.positions", "{}"),))
    assert abs(still.lean) < 2.0
    assert 5.0 < walked("wind-back").lean - still.lean < 11.0


def test_arms_trail_in_the_wind_and_are_held_back_out_of_it() -> None:
    """Fig. 5 b and c: drag of arms on drag is below that of arms on effort (K10)."""
    still = walked("gravity-arms", (("human.mass", "73.0"),), ONE_STRIDE)
    trailing, held = (walked(f"wind-{wish}", (), ONE_STRIDE) for wish in ("arms", "drag"))
    assert np.all(np.abs(still.ahead) < 0.04)
    assert np.all(trailing.ahead < still.ahead - 0.02)
    assert np.all(held.ahead < -0.15)
    assert held.drag < 0.7 * trailing.drag


def test_a_leg_in_the_way_keeps_its_arm_ahead() -> None:
    """Fig. 9 b."""
    blocked = walked("gravity-arms", (), ONE_STRIDE)
    left, right = blocked.ahead
    assert left > right + 0.06
    assert blocked.torque < 60.0


def test_feet_stand_on_the_ground() -> None:
    assert walked("gravity-back").sunk < 0.005


def swings(scene: str, settings: dict[str, str]) -> Array:
    """(2,) degrees over which left and right upper arm go to and fro in a stride."""
    angles = []
    with Simulation(load_scene(scene, settings)) as simulation:
        model = simulation.world.setup.solid
        for _ in range(50):
            simulation.advance_frame()
            q = simulation.world.solid.q
            turns = [q[model.positions_of(f"{side}_shoulder")] for side in SIDES]
            angles.append([float(twist(turn, SIDEWAYS)) for turn in turns])
    return np.asarray(np.degrees(np.ptp(angles[-26:], axis=0)))


def test_arms_keep_as_much_of_their_swing_as_closeness_to_the_clip_is_worth(swing: str) -> None:
    weights = ("3.0", "5.0", "10.0")
    hanging, between, close = (
        swings(swing, {f"objectives.{n}.weight": weight for n in (1, 2)}) for weight in weights
    )
    own = swings("human-gravity-back", {})
    assert np.all(hanging < 0.25 * own)
    assert np.all((between > 0.25 * own) & (between < 0.6 * own))
    assert np.all((close > 0.7 * own) & (close < own))
