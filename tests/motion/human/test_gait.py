"""Reference H1: the generated walk, through the clip's own rotations and the model's own soles."""

import mujoco
import numpy as np
import pytest

from flowborne.motion.clip_following import Passage, trajectory_of_clip
from flowborne.motion.human.body import human_mjcf
from flowborne.motion.human.clip_skeleton import skeleton_of
from flowborne.motion.human.gait import CYCLE, gait_clip, leg_turns
from flowborne.motion.human.skeleton import JOINTS, standard_skeleton
from flowborne.solids.model import SolidModel

LANDMARKS = {
    ("knee", 12): 19.29,
    ("knee", 72): 59.13,
    ("hip", 52): -5.76,
    ("ankle", 46): 11.84,
    ("ankle", 64): -19.79,
}
"""(joint, percent of the cycle): degrees of flexion, dorsiflexion."""

SIGN = {"hip": -1.0, "knee": 1.0, "ankle": -1.0}

SOLE = np.array([[-1.0, y, z] for y in (-1.0, 1.0) for z in (-1.0, 1.0)])
"""Corners of a foot's box in parts of its half sizes: its first axis points up."""


@pytest.fixture(scope="module")
def clip():
    return gait_clip(standard_skeleton())


@pytest.fixture(scope="module")
def hundred():
    """A walk with a frame at each percent."""
    return gait_clip(standard_skeleton(), 100.0 / 120.0)


def degrees(clip, joint):
    """(frames,) turn about y; nothing turns otherwise."""
    w, x, y, z = clip.rotations[:, clip.names.index(joint)].T
    assert np.abs([x, z]).max() == 0.0
    return np.degrees(2.0 * np.arctan2(y, w))


def played(model, clip):
    """MuJoCo's data at each frame."""
    data = mujoco.MjData(model.mj)
    for place, turns in zip(clip.translation, clip.rotations, strict=True):
        for joint, turn in zip(clip.names, turns, strict=True):
            data.qpos[model.positions_of(joint)[-4:]] = turn
        data.qpos[:3] = place
        mujoco.mj_forward(model.mj, data)
        yield data


def soles(model, clip):
    """(frames, 4 boxes, 4 corners, 3) corners of foot and toes on the ground's side."""
    names = [f"{side}_{part}" for side in ("left", "right") for part in ("foot", "toes")]
    geoms = [model.geom_names.index(name) for name in names]
    return np.array(
        [
            [
                data.geom_xpos[g] + (SOLE * model.geom_size[g]) @ data.geom_xmat[g].reshape(3, 3).T
                for g in geoms
            ]
            for data in played(model, clip)
        ]
    )


@pytest.fixture(scope="module")
def model():
    return SolidModel.from_string(human_mjcf(standard_skeleton(), 73.0, "male"))


@pytest.mark.parametrize(("joint", "percent"), LANDMARKS)
def test_H1_landmarks(hundred, joint, percent):
    right = SIGN[joint] * degrees(hundred, f"right_{joint}")
    left = SIGN[joint] * degrees(hundred, f"left_{joint}")
    assert right[percent] == pytest.approx(LANDMARKS[joint, percent], abs=1e-9)
    assert left[(percent + 50) % 100] == pytest.approx(LANDMARKS[joint, percent], abs=1e-9)


def test_H1_landmarks_are_the_curves_extremes(hundred):
    knee, hip = degrees(hundred, "right_knee"), -degrees(hundred, "right_hip")
    ankle = -degrees(hundred, "right_ankle")
    assert abs(np.argmax(knee) - 72) <= 1
    assert abs(np.argmax(knee[:40]) - 12) <= 1
    assert abs(np.argmin(hip) - 52) <= 1
    assert abs(np.argmax(ankle) - 46) <= 1
    assert abs(np.argmin(ankle) - 64) <= 1


def test_thigh_swings_as_far_forward_of_the_vertical_as_behind_it(hundred):
    """The hip's angle is against the pelvis, which tips forward by 12 degrees."""
    thigh = -(degrees(hundred, "root") + degrees(hundred, "right_hip"))
    assert 22.0 < thigh.max() < 28.0
    assert -20.0 < thigh.min() < -15.0


def third_differences(clip):
    """Largest across the seam of two cycles played one after the other, of root and of turns."""
    stride = clip.translation[-1] - clip.translation[0]
    places = np.concatenate([clip.translation[-4:-1], clip.translation[:4] + stride])
    turns = np.concatenate([clip.rotations[-4:-1], clip.rotations[:4]])
    return np.array([np.abs(np.diff(values, 3, axis=0)).max() for values in (places, turns)])


def test_loop_has_no_seam(clip):
    """Four times as many frames: a jump of the velocity would leave a quarter, it leaves 1 / 64."""
    np.testing.assert_allclose(clip.rotations[-1], clip.rotations[0], atol=1e-14)
    stride = clip.translation[-1] - clip.translation[0]
    np.testing.assert_allclose(stride[1:], 0.0, atol=1e-14)
    fine = gait_clip(standard_skeleton(), 4.0 * CYCLE)
    assert np.all(third_differences(fine) < third_differences(clip) / 25.0)
    assert (len(clip.translation) - 1) * clip.frame_time == pytest.approx(CYCLE, rel=1e-12)


def test_left_side_is_half_a_cycle_later(hundred):
    for joint in JOINTS:
        if joint.startswith("left_"):
            continue
        twin = joint.replace("right_", "left_")
        ours, theirs = degrees(hundred, joint)[:-1], degrees(hundred, twin)[:-1]
        np.testing.assert_allclose(np.roll(ours, 50), theirs, atol=1e-9, err_msg=joint)


def test_trunk_stays_upright(clip):
    np.testing.assert_allclose(degrees(clip, "root"), -degrees(clip, "lower_back"), atol=1e-12)


def test_arms_swing_against_the_legs(clip):
    arm, hip = -degrees(clip, "right_shoulder")[:-1], -degrees(clip, "right_hip")[:-1]
    assert np.corrcoef(arm, hip)[0, 1] < -0.8
    assert (arm.min(), arm.max()) == (pytest.approx(-24.0, abs=0.1), pytest.approx(8.0, abs=0.1))
    elbow = -degrees(clip, "left_elbow")
    assert 20.0 <= elbow.min() < elbow.max() <= 45.0 + 1e-9


def test_people_walk_as_fast(clip):
    speed = (clip.translation[-1] - clip.translation[0])[0] / CYCLE
    assert speed == pytest.approx(1.30, abs=0.02)
    rise = np.ptp(clip.translation[:, 2])
    assert 0.02 < rise < 0.06
    velocity = np.diff(clip.translation[:, 0]) / clip.frame_time
    assert velocity.min() > 1.0
    assert velocity.max() < 1.6


def test_the_root_moves_smoothly(clip):
    """Less than gravity: no blow where the support passes from foot to foot."""
    acceleration = np.diff(clip.translation, 2, axis=0) / clip.frame_time**2
    assert np.abs(acceleration).max() < 9.0


def test_soles_touch_the_ground_at_every_time(model, clip):
    lowest = soles(model, clip)[..., 2].min(axis=(1, 2))
    assert lowest.min() > -0.0025
    assert lowest.max() < 0.0005


def test_feet_do_not_slide(model, clip):
    """The lowest point stands still, but where the other foot takes over; a standing ball drifts
    by little more than a millimetre."""
    corner = soles(model, clip).reshape(len(clip.translation), 16, 3)
    middle = 0.5 * (corner[1:] + corner[:-1])
    speed = np.abs(np.diff(corner[..., 0], axis=0)) / clip.frame_time
    lowest = middle[..., 2].argmin(axis=1)
    slide = speed[np.arange(len(speed)), lowest]
    assert slide.max() < 0.2
    assert np.sqrt(np.mean(slide**2)) < 0.03
    phase = np.arange(len(corner)) / (len(corner) - 1)
    standing = (phase > 0.08) & (phase < 0.5)
    right_toes = corner[:, 12:, :]
    ball = right_toes[:, np.argmin(right_toes[0, :, 0]), 0]
    assert np.ptp(ball[standing]) < 0.002


def test_swinging_foot_clears_the_ground(model, clip):
    corner = soles(model, clip)
    phase = np.arange(len(corner)) / (len(corner) - 1)
    swinging = (phase > 0.68) & (phase < 0.95)
    assert corner[swinging][:, 2:, :, 2].min() > 0.012


@pytest.mark.parametrize("sex", ["male", "female"])
def test_nothing_touches_in_the_walk(clip, sex):
    model = SolidModel.from_string(human_mjcf(standard_skeleton(), 73.0, sex))
    assert not any(data.ncon for data in played(model, clip))


def test_toes_bend_when_the_heel_lifts():
    bent = -np.degrees(leg_turns(np.array([0.3, 0.4, 0.5, 0.57]))[3])
    assert np.all(np.diff(bent) > 0.0)
    always = -np.degrees(leg_turns(np.linspace(0.0, 1.0, 500))[3])
    assert always.min() > 0.0
    assert 35.0 < always.max() < 60.0


def test_clip_carries_its_skeleton(clip):
    wanted = standard_skeleton()
    found = skeleton_of(clip, {name: name for name in JOINTS})
    shift = wanted["root"] - found["root"]
    for name in (*wanted.joints, *wanted.tips):
        np.testing.assert_allclose(found[name] + shift, wanted[name], atol=1e-12)


@pytest.mark.parametrize("height", [1.3, 1.9])
def test_other_people_walk_too(height):
    walk = gait_clip(standard_skeleton(height))
    stride = (walk.translation[-1] - walk.translation[0])[0]
    assert stride == pytest.approx(1.364 * height / 1.741, rel=0.02)


def test_a_cycle_lasts():
    with pytest.raises(ValueError, match=r"cycle of 0\.0 s"):
        gait_clip(standard_skeleton(), 0.0)


def test_the_walk_goes_on_round_after_round(model, clip):
    """Played as a loop through a scene's motion, without a jump of place or velocity."""
    motion = trajectory_of_clip(model, clip, {name: name for name in JOINTS}, Passage(loop=True))
    stride = clip.translation[-1, 0] - clip.translation[0, 0]
    start = motion.position(0.0)
    np.testing.assert_allclose(motion.position(3.0 * CYCLE)[0] - start[0], 3.0 * stride, rtol=1e-9)
    np.testing.assert_allclose(motion.position(3.0 * CYCLE)[1:], start[1:], atol=1e-9)
    before, after = (motion.velocity(CYCLE + 1e-6 * side) for side in (-1.0, 1.0))
    np.testing.assert_allclose(before, after, atol=1e-3)
