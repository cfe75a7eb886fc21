"""Reference H2: de Leva's segments, recomputed from the compiled model."""

import mujoco
import numpy as np
import pytest

from flowborne.motion.human.body import human_mjcf
from flowborne.motion.human.segments import MEASURES, TRUNK, ends_of, segments
from flowborne.motion.human.skeleton import Skeleton, standard_skeleton
from flowborne.solids.model import SolidModel

MASS = 70.0

H2 = {
    "male": {
        "head": (0.0694, 0.5002, 0.303, 0.315, 0.261),
        "trunk": (0.4346, 0.5138, 0.328, 0.306, 0.169),
        "upper_arm": (0.0271, 0.5772, 0.285, 0.269, 0.158),
        "forearm": (0.0162, 0.4574, 0.276, 0.265, 0.121),
        "hand": (0.0061, 0.79, 0.628, 0.513, 0.401),
        "thigh": (0.1416, 0.4095, 0.329, 0.329, 0.149),
        "shank": (0.0433, 0.4459, 0.255, 0.249, 0.103),
        "foot": (0.0137, 0.4415, 0.257, 0.245, 0.124),
    },
    "female": {
        "head": (0.0669, 0.4841, 0.271, 0.295, 0.261),
        "trunk": (0.4257, 0.4964, 0.307, 0.292, 0.147),
        "upper_arm": (0.0255, 0.5754, 0.278, 0.26, 0.148),
        "forearm": (0.0138, 0.4559, 0.261, 0.257, 0.094),
        "hand": (0.0056, 0.7474, 0.531, 0.454, 0.335),
        "thigh": (0.1478, 0.3612, 0.369, 0.364, 0.162),
        "shank": (0.0481, 0.4416, 0.271, 0.267, 0.093),
        "foot": (0.0129, 0.4014, 0.299, 0.279, 0.124),
    },
}
"""The reference: mass, centre of mass; sagittal, transverse, longitudinal radius of gyration."""

BODIES_OF = {
    "head": ("lower_neck", "upper_neck", "head"),
    "trunk": ("pelvis", "lower_back", "upper_back", "thorax", "left_clavicle", "right_clavicle"),
    "left_foot": ("left_foot", "left_toes"),
    "right_foot": ("right_foot", "right_toes"),
}


def random_skeleton():
    """Every joint up to 2 cm away from where a tall person has it; arms raised sideways."""
    rng = np.random.default_rng(3)
    standard = standard_skeleton(1.9)
    joints = {name: place + rng.uniform(-0.02, 0.02, 3) for name, place in standard.joints.items()}
    tips = {name: place + rng.uniform(-0.02, 0.02, 3) for name, place in standard.tips.items()}
    for side, sign in (("left", 1.0), ("right", -1.0)):
        shoulder = joints[f"{side}_shoulder"]
        for points, name in ((joints, "elbow"), (joints, "wrist"), (tips, "fingertip")):
            arm = points[f"{side}_{name}"] - shoulder
            points[f"{side}_{name}"] = shoulder + np.array([arm[0], -sign * arm[2], sign * arm[1]])
    return Skeleton(joints, tips)


def short_backed_skeleton():
    """Shoulders and neck 6 cm lower: the trunk's bodies are as if squeezed."""
    standard = standard_skeleton()
    carried = ("thorax", "neck", "head", "clavicle", "shoulder", "elbow", "wrist", "finger")

    def lower(places):
        return {
            name: place - [0.0, 0.0, 0.06 * any(part in name for part in carried)]
            for name, place in places.items()
        }

    return Skeleton(lower(standard.joints), lower(standard.tips))


SKELETONS = {
    "standard": standard_skeleton,
    "random": random_skeleton,
    "short back": short_backed_skeleton,
}


def whole(model, data, bodies):
    """Mass, centre of mass and inertia about it of several bodies, in the world's axes."""
    numbers = [model.body(body) for body in bodies]
    masses = model.mj.body_mass[numbers]
    centres = data.xipos[numbers]
    centre = masses @ centres / masses.sum()
    inertia = np.zeros((3, 3))
    for number, mass, place in zip(numbers, masses, centres, strict=True):
        turn = data.ximat[number].reshape(3, 3)
        away = place - centre
        inertia += turn @ np.diag(model.mj.body_inertia[number]) @ turn.T
        inertia += mass * (away @ away * np.eye(3) - np.outer(away, away))
    return masses.sum(), centre, inertia


@pytest.mark.parametrize("sex", ["male", "female"])
@pytest.mark.parametrize("kind", SKELETONS)
def test_H2_segments(sex, kind):
    skeleton = SKELETONS[kind]()
    model = SolidModel.from_string(human_mjcf(skeleton, MASS, sex))
    data = mujoco.MjData(model.mj)
    mujoco.mj_forward(model.mj, data)
    assert model.body_mass.sum() == pytest.approx(MASS, rel=1e-12)
    for segment in segments():
        mass, centre, inertia = whole(model, data, BODIES_OF.get(segment, (segment,)))
        share, fraction, *wanted = H2[sex][segment.removeprefix("left_").removeprefix("right_")]
        start, end = ends_of(segment, skeleton)
        axis = (start - end) / np.linalg.norm(end - start)
        assert mass == pytest.approx(share * MASS, rel=1e-6), segment
        np.testing.assert_allclose(
            centre, start + fraction * (end - start), atol=1e-7, err_msg=segment
        )
        length = np.linalg.norm(end - start)
        front = np.array([0.0, 0.0, 1.0] if segment.endswith("foot") else [1.0, 0.0, 0.0])
        front -= (front @ axis) * axis
        front /= np.linalg.norm(front)
        axes = (front, np.cross(axis, front), axis)
        radii = [np.sqrt(direction @ inertia @ direction / mass) / length for direction in axes]
        np.testing.assert_allclose(radii, wanted, rtol=1e-6, err_msg=segment)
        crossed = np.array([axes[i] @ inertia @ axes[j] for i, j in ((0, 1), (0, 2), (1, 2))])
        assert np.abs(crossed).max() < 1e-6 * inertia.trace(), segment


@pytest.mark.parametrize("sex", ["male", "female"])
def test_H2_masses_add_up(sex):
    one = MEASURES[sex]
    total = sum(m.mass * (1 if name in ("head", "trunk") else 2) for name, m in one.items())
    assert total == pytest.approx(1.0, abs=1e-12)
    assert sum(TRUNK[sex].values()) == pytest.approx(one["trunk"].mass, abs=1e-12)


def test_parts_of_the_trunk_have_de_levas_masses():
    model = SolidModel.from_string(human_mjcf(standard_skeleton(), MASS, "male"))
    mass = dict(zip(model.body_names, model.body_mass / MASS, strict=True))
    assert mass["pelvis"] == pytest.approx(0.1117)
    assert mass["lower_back"] + mass["upper_back"] == pytest.approx(0.1633)
    girdle = mass["left_clavicle"] + mass["right_clavicle"]
    assert mass["thorax"] + girdle == pytest.approx(0.1596)


def test_bodies_of_a_standard_trunk_keep_their_distances():
    """Their own middles leave room for their own inertia: nothing is drawn in."""
    skeleton = standard_skeleton()
    model = SolidModel.from_string(human_mjcf(skeleton, MASS, "male"))
    data = mujoco.MjData(model.mj)
    mujoco.mj_forward(model.mj, data)
    pelvis, thorax = (data.xipos[model.body(body)] for body in ("pelvis", "thorax"))
    middles = [np.mean(skeleton.bone(body), axis=0) for body in ("thorax", "pelvis")]
    np.testing.assert_allclose(thorax - pelvis, middles[0] - middles[1], atol=1e-9)
