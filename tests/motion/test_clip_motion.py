"""A clip as prescribed motion: the model stands as the clip does, and moves without jumps."""

from __future__ import annotations

import pickle
import re
from functools import cache
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from flowborne.base.errors import SceneError
from flowborne.motion.clip_following import Passage, trajectory_of_clip
from flowborne.motion.clip_motion import MAX_CACHED_TIMES, TrajectoryClip
from flowborne.motion.quaternions import about, angle, inverse, product
from flowborne.solids.model import SolidModel
from flowborne.solids.trajectories import Trajectory

from ..read_bvh import read_bvh
from .clip_models import BODIES, MAPPING, NAMES, REST, circling, model, wandering

MOCAP = Path(__file__).parents[3] / "shared" / "mocap"
MODEL, WANDER, CIRCLE = model(), wandering(), circling()
UP = np.array([0.0, 0.0, 1.0])


def motion(
    clip: Any = WANDER, joints: Any = None, initial: Any = None, **passage: Any
) -> TrajectoryClip:
    return trajectory_of_clip(
        MODEL, clip, MAPPING, Passage(**passage), joints=joints, initial=initial
    )


def whole(prescribed: TrajectoryClip, time: float) -> np.ndarray:
    """(nq,) q with the joints where they are told to be, the others at rest."""
    q = MODEL.mj.qpos0.copy()
    places = [MODEL.positions_of(name) for name in prescribed.columns.names]
    q[np.concatenate(places)] = prescribed.position(time)
    return q


def rate(prescribed: TrajectoryClip, time: float, step: float) -> np.ndarray:
    """(k,) difference quotient of position by MuJoCo."""
    v = np.zeros(MODEL.nv)
    before, after = whole(prescribed, time - step), whole(prescribed, time + step)
    mujoco.mj_differentiatePos(MODEL.mj, v, 2.0 * step, before, after)
    return v[prescribed.dofs]


def root(prescribed: TrajectoryClip, time: float) -> tuple[np.ndarray, np.ndarray]:
    """Place and rotation of the pelvis, the latter from its rest."""
    position = prescribed.position(time)
    rest = REST[0].as_quat(scalar_first=True)
    return position[:3], product(position[3:7], inverse(rest))


def test_bodies_rotated_at_rest_follow_the_clip() -> None:
    prescribed = motion()
    data = mujoco.MjData(MODEL.mj)
    places, rotations = WANDER.poses()
    rest = dict(zip(("pelvis", "thigh", "shank", "foot", "waist", "head"), REST, strict=True))
    for frame in range(WANDER.frames):
        data.qpos[:] = whole(prescribed, frame * WANDER.frame_time)
        mujoco.mj_kinematics(MODEL.mj, data)
        for joint, bone in MAPPING.items():
            body, number = BODIES[joint], NAMES.index(bone)
            turned = product(rotations[frame, number], rest[body].as_quat(scalar_first=True))
            assert angle(product(inverse(turned), data.body(body).xquat)) < 1e-6
            assert_allclose(data.body(body).xpos, places[frame, number], atol=1e-9)


MANNERS: dict[str, dict[str, Any]] = {
    "plain": {},
    "blended": {"blend": 0.6},
    "trimmed": {"start": 0.31, "stop": 1.77, "blend": 0.4},
    "smooth": {"smooth": 6.0, "blend": 0.3},
    "looped": {"loop": True, "blend": 0.5},
    "looped smooth": {"loop": True, "blend": 0.2, "start": 0.1, "stop": 1.9, "smooth": 8.0},
    "some joints": {"joints": ["knee", "ankle", "head"], "loop": True, "blend": 0.5},
    "cycle": {"clip": CIRCLE, "loop": True},
    "cycle blended": {"clip": CIRCLE, "loop": True, "blend": 0.3},
    "cycle smooth": {"clip": CIRCLE, "loop": True, "blend": 0.3, "smooth": 6.0},
}


@cache
def moving(manner: str) -> TrajectoryClip:
    """The motion of a manner, made once for all tests that leave it as it is."""
    return motion(**MANNERS[manner])


@settings(max_examples=300, deadline=None)
@given(st.sampled_from(sorted(MANNERS)), st.floats(0.001, 8.0))
def test_velocity_is_the_derivative_of_position(name: str, time: float) -> None:
    prescribed = moving(name)
    if abs(time - prescribed.length) < 1e-3 and not prescribed.blend and prescribed.stride is None:
        return  # where a clip without a blend stops at once
    assert_allclose(prescribed.velocity(time), rate(prescribed, time, 2e-5), rtol=1e-6, atol=1e-5)


@pytest.mark.parametrize("name", sorted(MANNERS))
def test_velocity_is_the_derivative_where_one_piece_goes_over_into_the_next(name: str) -> None:
    m = moving(name)
    cycles = [m.length * n + part for n in (1, 2, 5) for part in (0.0, m.overlap)]
    ends = cycles if m.stride else [m.length - m.blend / 2.0, m.length + m.blend / 2.0]
    starts = [0.0, m.blend]
    for time in starts + ends:
        if m.blend == 0.0 and (time == 0.0 or m.stride is None):
            continue
        for near in (time - 1e-7, time, time + 1e-7):
            assert_allclose(m.velocity(near), rate(m, near, 1e-5), rtol=1e-5, atol=2e-4)


@pytest.mark.parametrize("name", ["blended", "looped", "cycle blended", "trimmed"])
def test_blended_motion_starts_and_ends_at_rest(name: str) -> None:
    m = moving(name)
    assert np.all(m.velocity(-1.0) == 0.0)
    assert_allclose(m.velocity(1e-5), 0.0, atol=1e-4)
    assert np.array_equal(m.position(-3.0), m.position(0.0))
    if m.stride is None:
        end = m.length + m.blend / 2.0
        assert_allclose(m.velocity(end - 1e-5), 0.0, atol=1e-4)
        assert np.all(m.velocity(end + 1e-9) == 0.0)
        assert np.array_equal(m.position(end + 1e-9), m.position(end + 9.0))


def test_blend_starts_from_the_pose_given_at_the_place_and_heading_of_the_clip() -> None:
    pose = MODEL.mj.qpos0.copy()
    tilt, heading = about(np.array([0.0, 1.0, 0.0]), np.array(0.2)), about(UP, np.array(2.5))
    rest = REST[0].as_quat(scalar_first=True)
    pose[3:7] = product(product(heading, tilt), rest)
    pose[MODEL.positions_of("knee")] = about(np.array([1.0, 0.0, 0.0]), np.array(0.7))
    clip = wandering(seed=3)
    clip.rotations[0, 0] = about(UP, np.array(-1.1))
    m = motion(clip, blend=0.5, initial=pose)
    place, turn = root(m, 0.0)
    assert_allclose(place, clip.translation[0], atol=1e-12)
    wanted = product(about(UP, np.array(-1.1)), tilt)
    # the heading of a tilted body is its twist about the vertical
    assert angle(product(inverse(wanted), turn)) < 1e-7
    assert_allclose(whole(m, 0.0)[7:], pose[7:], atol=1e-12)
    assert_allclose(m.position(0.5), motion(clip).position(0.5), atol=1e-12)


def test_blend_goes_the_short_way_whatever_the_sign_of_a_quaternion() -> None:
    plain = moving("plain")
    for sign in (-1.0, 1.0):
        pose = whole(plain, 0.0)
        pose[MODEL.positions_of("hip")] *= sign
        m = motion(blend=0.2, initial=pose)
        for time in (0.05, 0.1, 0.15):
            here, there, start = (
                whole(each, at)[MODEL.positions_of("hip")]
                for each, at in ((m, time), (plain, time), (plain, 0.0))
            )
            away = angle(product(inverse(start), there))
            assert angle(product(inverse(here), there)) < away


def test_clip_slows_down_along_its_own_path() -> None:
    plain, braked = moving("plain"), moving("blended")
    assert_allclose(braked.position(2.3), plain.position(2.0), atol=1e-12)
    times = np.linspace(1.7, 2.3, 60)
    path = np.array([plain.position(t)[:2] for t in np.linspace(1.7, 2.0, 3000)])
    speeds = []
    for time in times:
        place = braked.position(time)[:2]
        assert np.linalg.norm(path - place, axis=1).min() < 1e-3
        speeds.append(np.linalg.norm(braked.velocity(time)[:2]))
    assert max(speeds) <= np.linalg.norm(plain.velocity(1.7)[:2]) * 1.01


def test_trim_is_the_same_motion_from_a_later_time() -> None:
    plain, late = moving("plain"), motion(start=0.31, stop=1.77)
    for time in (0.0, 0.2, 1.0, 1.459):
        assert_allclose(late.position(time), plain.position(0.31 + time), atol=1e-12)
        assert_allclose(late.velocity(time), plain.velocity(0.31 + time), atol=1e-12)
    assert_allclose(late.position(7.0), plain.position(1.77), atol=1e-12)


def test_whole_cycles_go_round_in_a_circle() -> None:
    m = moving("cycle")
    assert m.length == pytest.approx(1.0)
    for time in (0.1, 0.7, 3.25):
        assert_allclose(whole(m, time + 1.0)[7:], whole(m, time)[7:], atol=1e-9)
        place, turn = root(m, time)
        assert np.hypot(place[0], place[1] - 2.0) == pytest.approx(2.0, abs=1e-5)
        further, next_turn = root(m, time + 1.0)
        chord = 2.0 * 2.0 * np.sin(np.pi / 6.0)
        assert np.linalg.norm(further - place) == pytest.approx(chord, abs=1e-8)
        relative = product(next_turn, inverse(turn))
        assert angle(product(relative, about(UP, np.array(-np.pi / 3.0)))) < 1e-7
        for cycles in (6, 600):
            back, again = root(m, time + cycles)
            assert_allclose(back, place, atol=1e-8)
            assert angle(product(inverse(turn), again)) < 1e-7


def test_straight_cycles_go_on_for_ever() -> None:
    clip = circling(turn=1e-9)
    clip.translation[:, 0] = 1.3 * np.linspace(0.0, 1.0, clip.frames)
    m = motion(clip, loop=True)
    assert_allclose(m.position(1000.25)[:3] - m.position(0.25)[:3], [1300.0, 0, 0], atol=1e-2)


def test_seam_of_an_open_clip_keeps_to_ground_and_heading() -> None:
    m = moving("looped")
    assert m.length == pytest.approx(1.5)
    heights = [m.position(time)[2] for time in np.arange(0.0, 60.0, 0.1)]
    assert min(heights) > 0.84
    assert max(heights) < 0.96
    plain = moving("plain")
    for time in (0.6, 1.0, 1.49):
        assert_allclose(whole(m, 1.5 * 7 + time)[7:], whole(plain, time)[7:], atol=1e-9)
    steps = [np.linalg.norm(m.velocity(time)[:2]) for time in np.arange(1.4, 2.1, 0.01)]
    assert max(steps) < 2.2  # the clip itself goes at 1.3 to 1.6 m/s


def test_the_blend_that_the_message_proposes_is_long_enough() -> None:
    with pytest.raises(SceneError) as refused:
        motion(loop=True, blend=0.02)
    said = str(refused.value)
    (longer,) = re.findall(r"Make blend ([\d.]+) s or longer", said)
    motion(loop=True, blend=float(longer))


def test_low_pass_halves_the_power_at_its_frequency_and_does_not_lag() -> None:
    clip = wandering(601)
    time = clip.frame_time * np.arange(clip.frames)
    inside = np.arange(2.0, 8.0, 0.013)
    for frequency, gain in ((0.5, 1.0), (6.0, np.sqrt(0.5)), (20.0, 0.0)):
        wave = 0.4 * np.sin(2.0 * np.pi * frequency * time)
        clip.rotations[:, 4] = about(np.array([0.0, 0.6, 0.8]), wave)
        m = motion(clip, joints=["ankle"], smooth=6.0)
        found = np.array([m.position(t)[0] for t in inside]) - np.deg2rad(11.0)
        expected = gain * 0.4 * np.sin(2.0 * np.pi * frequency * inside)
        assert_allclose(found, expected, atol=0.01)


def test_before_the_start_joints_rest_with_and_without_a_blend() -> None:
    for name in ("plain", "looped"):
        m = moving(name)
        assert np.array_equal(m.position(-1.0), m.position(0.0))
        assert not m.velocity(-1.0).any()


def test_motion_fits_the_contract_and_survives_pickling() -> None:
    prescribed: Trajectory = moving("looped")
    again = pickle.loads(pickle.dumps(prescribed))
    for time in (-1.0, 0.3, 1.6, 9.0):
        assert np.array_equal(prescribed.position(time), again.position(time))
        assert np.array_equal(prescribed.velocity(time), again.velocity(time))
    some = moving("some joints")
    wanted = np.concatenate([MODEL.dofs_of(name) for name in ("head", "knee", "ankle")])
    assert np.array_equal(some.dofs, np.sort(wanted))
    assert some.columns.names == ("head", "knee", "ankle")


WRONG: dict[str, tuple[dict[str, Any], str]] = {
    "stop": ({"stop": 2.5}, r"it lasts 2 s, but start is 0 s and stop 2\.5 s"),
    "start": ({"start": 1.0, "stop": 1.0}, r"start is 1 s and stop 1 s"),
    "negative": ({"start": -0.1}, r"start is -0\.1 s and stop 2 s"),
    "blend": ({"blend": 1.5}, r"blend 1\.5 s is more than half of the 2 s"),
    "open loop": ({"loop": True}, r"without a blend, but joint '\w+' ends [\d.]+ rad or m"),
    "seam": (
        {"loop": True, "blend": 0.01},
        r"where it starts again, joint '\w+' moves \d+ times as fast as anywhere else, because a "
        r"blend of 0\.01 s joins different ends\. Make blend 0\.\d+ s or longer, or set stop",
    ),
    "low-pass": ({"smooth": 25.0}, r"smooth 25 Hz is not between 0 and 24\.1 Hz.* 60 frames"),
    "unknown": ({"joints": ["ancle"]}, r"'ancle' is not in the model; did you mean 'ankle'"),
    "unmapped": ({"joints": ["waist"]}, r"'waist' follows the clip, but is not mapped"),
}


@pytest.mark.parametrize("case", WRONG)
def test_invalid_passage_is_refused(case: str) -> None:
    options, message = WRONG[case]
    with pytest.raises(SceneError, match=message):
        motion(**options)


@pytest.mark.parametrize(
    ("joints", "message"),
    [
        ('<joint name="hip" type="slide"/>', "joint 'hip' is a slide"),
        (
            '<joint name="hip"/><joint name="knee" axis="0 1 0"/>',
            "'hip' and 'knee' belong to one body",
        ),
    ],
)
def test_joints_that_cannot_follow_are_refused(joints: str, message: str) -> None:
    body = f'<body name="b">{joints}<geom size="0.1"/></body>'
    other = SolidModel.from_string(f"<mujoco><worldbody>{body}</worldbody></mujoco>")
    with pytest.raises(SceneError, match=message):
        trajectory_of_clip(other, WANDER, MAPPING)


@pytest.mark.skipif(not MOCAP.is_dir(), reason="the real clips are not here")
def test_real_clip_keeps_its_feet_on_the_ground() -> None:
    clip = read_bvh(MOCAP / "131_01.bvh", 0.056444, skip=1)
    text = "<mujoco><worldbody>"
    legs = [("Hips", "root")] + [(f"Left{b}", b) for b in ("Hip", "Knee", "Ankle", "Toe")]
    for bone, joint in legs:
        offset = clip.offsets[clip.names.index(bone)]
        kind = "free" if joint == "root" else "ball"
        text += f'<body name="{bone}" pos="{offset[0]} {offset[1]} {offset[2]}">'
        text += f'<joint name="{joint}" type="{kind}"/><geom size="0.05"/>'
    leg = SolidModel.from_string(text + "</body>" * len(legs) + "</worldbody></mujoco>")
    m = trajectory_of_clip(leg, clip, {joint: bone for bone, joint in legs}, Passage(smooth=6.0))
    data = mujoco.MjData(leg.mj)
    heights = []
    for time in np.arange(0.0, clip.duration, 0.02):
        data.qpos[:] = m.position(time)
        mujoco.mj_kinematics(leg.mj, data)
        heights.append(data.body("LeftToe").xpos[2])
    assert 0.0 < min(heights) < 0.05
    assert max(heights) < 0.3


def test_cached_motion_equals_a_fresh_one() -> None:
    prescribed = motion(loop=True, blend=0.5)
    times = np.linspace(0.0, 5.0, 2 * MAX_CACHED_TIMES)
    fresh = {}
    for time in times[:: MAX_CACHED_TIMES // 8]:
        other = motion(loop=True, blend=0.5)
        fresh[time] = other.position(time), other.velocity(time)
    for _ in range(2):
        for time in times:
            position, velocity = prescribed.position(time), prescribed.velocity(time)
            assert prescribed.position(time) is position
            if time in fresh:
                np.testing.assert_array_equal(position, fresh[time][0])
                np.testing.assert_array_equal(velocity, fresh[time][1])
    assert not prescribed.position(times[0]).flags.writeable
    assert len(pickle.dumps(prescribed)) == len(pickle.dumps(motion(loop=True, blend=0.5)))
