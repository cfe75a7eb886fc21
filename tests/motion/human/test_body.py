"""The human's MJCF: joints, outer form, contacts; a free fall."""

import mujoco
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from flowborne import SolidModel, step
from flowborne.bodies import human_mjcf, standard_skeleton
from flowborne.motion.human.body import elbow_hinge
from flowborne.motion.human.skeleton import BODIES, Link, Skeleton
from flowborne.worlds import advance, make_world

MASS = 73.0


def model_of(skeleton=None, hinged=(), sex="male"):
    return SolidModel.from_string(human_mjcf(skeleton or standard_skeleton(), MASS, sex, hinged))


def posed(model, **turns):
    """MuJoCo's data with ball joints turned by rotation vectors in degrees, hinges by degrees."""
    data = mujoco.MjData(model.mj)
    for joint, turn in turns.items():
        places = model.positions_of(joint)
        if len(places) == 1:
            data.qpos[places] = np.radians(turn)
            continue
        angle = np.linalg.norm(turn)
        quaternion = np.zeros(4)
        mujoco.mju_axisAngle2Quat(quaternion, np.array(turn) / angle, np.radians(angle))
        data.qpos[places] = quaternion
    mujoco.mj_forward(model.mj, data)
    return data


def touching(model, data):
    names = model.geom_names
    return {frozenset((names[c.geom[0]], names[c.geom[1]])) for c in data.contact[: data.ncon]}


def test_there_are_23_bodies_on_22_balls_and_a_free_root():
    model = model_of()
    assert model.body_names[1:] == tuple(body for body, _, _ in BODIES)
    assert len(BODIES) == 23
    assert model.joint_names == tuple(joint for _, joint, _ in BODIES)
    assert (model.nq, model.nv) == (7 + 22 * 4, 6 + 22 * 3)
    assert np.all(model.armature == 0.0)


def test_bodies_are_parallel_to_the_world_and_start_at_their_joints():
    skeleton = standard_skeleton()
    model = model_of(skeleton)
    data = posed(model)
    for body, joint, _ in BODIES:
        number = model.body(body)
        np.testing.assert_allclose(data.xpos[number], skeleton.joints[joint], atol=1e-12)
        np.testing.assert_allclose(data.xquat[number], [1.0, 0.0, 0.0, 0.0], atol=1e-15)


@pytest.mark.parametrize("side", ["left", "right"])
def test_a_hinged_elbow_bends_the_forearm_forward(side):
    skeleton = standard_skeleton()
    model = model_of(skeleton, ("left_elbow", "right_elbow"))
    data = posed(model, **{f"{side}_elbow": 90.0})
    hand = data.xpos[model.body(f"{side}_hand")] - data.xpos[model.body(f"{side}_forearm")]
    length = np.linalg.norm(skeleton.joints[f"{side}_wrist"] - skeleton.joints[f"{side}_elbow"])
    np.testing.assert_allclose(hand, [length, 0.0, 0.0], atol=1e-9)
    dof = int(model.dofs_of(f"{side}_elbow")[0])
    np.testing.assert_allclose(np.degrees(model.dof_range[dof]), [0.0, 150.0])


def test_hinged_elbow_of_a_raised_arm_bends_forward_too():
    standard = standard_skeleton()
    joints, tips = dict(standard.joints), dict(standard.tips)
    for points, name in ((joints, "left_elbow"), (joints, "left_wrist"), (tips, "left_fingertip")):
        arm = points[name] - joints["left_shoulder"]
        points[name] = joints["left_shoulder"] + [0.0, -arm[2], 0.0]
    model = model_of(Skeleton(joints, tips), ("left_elbow",))
    data = posed(model, left_elbow=90.0)
    hand = data.xpos[model.body("left_hand")] - data.xpos[model.body("left_forearm")]
    assert hand[0] == pytest.approx(np.linalg.norm(hand))


@pytest.mark.parametrize("sex", ["male", "female"])
def test_nothing_touches_at_rest(sex):
    assert posed(model_of(sex=sex)).ncon == 0


def test_arm_that_swings_inward_meets_the_leg():
    """And nothing else: trunk and upper arm overlap by their form."""
    model = model_of()
    data = posed(model, left_shoulder=(-15.0, 0.0, 0.0))
    assert frozenset(("left_hand", "left_thigh")) in touching(model, data)
    for pair in touching(model, data):
        assert {name.split("_")[-1] for name in pair} & {"forearm", "hand"}


@pytest.mark.parametrize(
    ("turns", "pair"),
    [
        ({"left_shoulder": (0.0, -40.0, 0.0), "left_elbow": (0.0, -150.0, 0.0)}, None),
        ({"left_hip": (0.0, -60.0, 0.0), "left_knee": (0.0, 120.0, 0.0)}, None),
        ({"left_hip": (20.0, 0.0, 0.0)}, ("left_thigh", "left_hand")),
        ({"right_hip": (-20.0, 0.0, 0.0)}, ("right_thigh", "right_hand")),
    ],
)
def test_what_collides(turns, pair):
    model = model_of()
    touched = touching(model, posed(model, **turns))
    assert (frozenset(pair) in touched) if pair else not touched


def test_volume_is_near_the_mass_at_the_density_of_people():
    """Neighbours overlap and count twice here, so it is somewhat more; limbs and head are close."""
    model = model_of()
    volume = dict(zip(model.body_names, model.volume, strict=True))
    mass = dict(zip(model.body_names, model.body_mass, strict=True))
    for body in ("head", "left_hand", "left_foot", "left_forearm", "left_thigh", "left_shank"):
        assert 950.0 < mass[body] / volume[body] < 1170.0, body
    assert 730.0 < MASS / model.volume.sum() < 1100.0


def test_it_is_as_broad_and_as_tall_as_people():
    """Men of Gordon et al. 1989, at 1.741 m: deltoids 48.8 cm, hips 33.9, chest 31.8, foot 9.9."""
    model = model_of()
    size = {name: 2.0 * s for name, s in zip(model.geom_names, model.geom_size, strict=True)}
    shoulder = 2.0 * standard_skeleton().joints["left_shoulder"][1]
    assert shoulder + size["left_upper_arm"][0] == pytest.approx(0.488, abs=0.01)
    assert size["pelvis"][1] == pytest.approx(0.339, abs=0.03)
    assert size["thorax"][1] == pytest.approx(0.318, abs=0.03)
    assert size["left_foot"][1] == pytest.approx(0.099, abs=0.015)
    assert size["head"][0] == pytest.approx(0.195, abs=0.01)
    data = posed(model)
    head = model.geom_names.index("head")
    assert data.geom_xpos[head][2] + 0.5 * size["head"][2] == pytest.approx(1.741, abs=0.01)
    sole = data.geom_xpos[model.geom_names.index("left_foot")][2] - 0.5 * size["left_foot"][0]
    assert abs(sole) < 0.005


def test_a_tumbling_human_falls_as_a_whole():
    """Joints and collisions between its own parts leave the centre of mass alone."""
    xml = human_mjcf(standard_skeleton(), MASS, "male", ("left_elbow",))
    world = make_world(xml, slab=False, gravity=(0.0, 0.0, -9.81))
    world.solid.v[:] = np.random.default_rng(0).uniform(-1.0, 1.0, world.solid.v.size)
    model = world.setup.solid
    data = mujoco.MjData(model.mj)

    def centre():
        data.qpos[:] = world.solid.q
        mujoco.mj_forward(model.mj, data)
        return data.subtree_com[0].copy()

    dt = 1.0 / 240.0
    places = [centre()]
    for _ in range(48):
        advance(world, dt)
        places.append(centre())
    acceleration = np.diff(places, 2, axis=0) / dt**2
    np.testing.assert_allclose(acceleration.mean(axis=0), [0.0, 0.0, -9.81], atol=0.05)


@pytest.mark.parametrize("mass", [0.0, -1.0, np.nan])
def test_a_mass_that_cannot_be_is_refused(mass):
    with pytest.raises(ValueError, match="mass of"):
        human_mjcf(standard_skeleton(), mass, "male")


def test_only_elbows_can_be_hinges():
    with pytest.raises(ValueError, match="'left_knee' cannot be a hinge"):
        human_mjcf(standard_skeleton(), MASS, "male", ("left_knee",))


def test_it_falls_freely_as_one_and_stays_as_it_is() -> None:
    world = make_world(
        human_mjcf(standard_skeleton(), 73.0, "male"), slab=False, gravity=(0.0, 0.0, -9.81)
    )
    for _ in range(20):
        assert step(world, 0.01).outcome.name == "DONE"
    assert world.solid.v[2] == pytest.approx(-9.81 * 0.2, rel=1e-12)
    assert np.abs(np.delete(world.solid.v, 2)).max() < 1e-11


def arm_to(skeleton, elbow, wrist):
    """The skeleton with its left elbow and wrist so far from shoulder and elbow."""
    joints, tips = dict(skeleton.joints), dict(skeleton.tips)
    joints["left_elbow"] = joints["left_shoulder"] + elbow
    joints["left_wrist"] = joints["left_elbow"] + wrist
    tips["left_fingertip"] = joints["left_wrist"] + 0.5 * np.asarray(wrist)
    return Skeleton(joints, tips)


@pytest.mark.parametrize(
    ("elbow", "wrist", "axis", "bend"),
    [
        ((0.0, 0.0, -0.3), (0.0, 0.0, -0.3), (0.0, -1.0, 0.0), 0.0),
        ((0.0, 0.0, -0.3), (0.1, 0.0, -0.1), (0.0, -1.0, 0.0), 45.0),
        ((0.0, 0.3, 0.0), (0.0, 0.1, 0.1), (1.0, 0.0, 0.0), 45.0),
        ((0.3, 0.0, 0.0), (0.3, 0.0, 0.0), (0.0, -1.0, 0.0), 0.0),
    ],
)
def test_a_hinge_bends_an_elbow_the_way_it_is_bent_at_rest(elbow, wrist, axis, bend):
    """And a straight one forward, or up where the arm points forward."""
    skeleton = arm_to(standard_skeleton(), elbow, wrist)
    found, bent = elbow_hinge(skeleton, "left_elbow")
    assert found == pytest.approx(axis)
    assert bent == pytest.approx(bend)
    model = model_of(skeleton, ("left_elbow",))
    joint = model.joint("left_elbow")
    assert np.degrees(model.mj.jnt_range[joint]) == pytest.approx([-bend, 150.0 - bend])


def test_links_and_held_joints_change_neither_mass_nor_inertia():
    """A link at half the thorax's height, and a neck without its upper joint."""
    skeleton = standard_skeleton()
    place = 0.5 * (skeleton["upper_back"] + skeleton["thorax"])
    links = {"thorax": (Link("thorax_base", "Spine2", place),)}
    linked = Skeleton(skeleton.joints, skeleton.tips, links)
    model = SolidModel.from_string(human_mjcf(linked, MASS, "male", held=("upper_neck",)))
    plain = model_of()
    assert "upper_neck" not in model.joint_names
    assert model.body_names[model.mj.body_parentid[model.body_names.index("thorax")]] == (
        "thorax_base"
    )
    sums = []
    for one in (model, plain):
        data = posed(one)
        sums.append([data.subtree_com[0], one.mj.body_subtreemass[0]])
        momentum = np.zeros((3, 3))
        for axis in range(3):
            data.qvel[:] = 0.0
            data.qvel[3 + axis] = 1.0
            mujoco.mj_forward(one.mj, data)
            mujoco.mj_subtreeVel(one.mj, data)
            momentum[axis] = data.subtree_angmom[0]
        sums[-1].append(momentum)
    for ours, theirs in zip(*sums, strict=True):
        assert ours == pytest.approx(theirs, abs=1e-9)
    data = posed(model, thorax_base=(0.0, 20.0, 0.0))
    assert data.body("thorax").xpos == pytest.approx(
        place + Rotation.from_rotvec([0.0, np.radians(20.0), 0.0]).apply(skeleton["thorax"] - place)
    )
