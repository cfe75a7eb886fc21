"""Quaternions against scipy's rotations."""

from __future__ import annotations

import numpy as np
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation

from flowborne.motion.quaternions import about, angle, continuous, inverse, product, rotated, twist

RNG = np.random.default_rng(1)
P, Q = Rotation.random(20, random_state=2), Rotation.random(20, random_state=3)
p, q = P.as_quat(scalar_first=True), Q.as_quat(scalar_first=True)


def test_product_is_one_rotation_after_the_other() -> None:
    both = Rotation.from_quat(product(p, q), scalar_first=True)
    assert_allclose(both.as_matrix(), (P * Q).as_matrix(), atol=1e-14)


def test_one_quaternion_goes_with_many() -> None:
    assert_allclose(product(p[0], q)[7], product(p[0], q[7]), atol=1e-15)
    assert_allclose(product(p, q[0])[7], product(p[7], q[0]), atol=1e-15)


def test_rotated_vectors() -> None:
    vectors = RNG.normal(size=(20, 3))
    assert_allclose(rotated(p, vectors), P.apply(vectors), atol=1e-14)
    assert_allclose(rotated(p, vectors[0]), P.apply(vectors[0]), atol=1e-14)
    assert_allclose(rotated(p[0], vectors), P[0].apply(vectors), atol=1e-14)


def test_inverse_and_angle() -> None:
    assert_allclose(angle(product(inverse(p), p)), 0.0, atol=1e-7)
    assert_allclose(angle(-p), P.magnitude(), atol=1e-13)


def test_twist_is_the_turn_about_the_axis() -> None:
    axis = np.array([0.0, 0.6, 0.8])
    turns = np.linspace(-3.0, 3.0, 20)
    swing = about(np.array([1.0, 0.0, 0.0]), np.array(0.9))
    assert_allclose(twist(about(axis, turns), axis), turns, atol=1e-14)
    assert_allclose(twist(product(swing, about(axis, turns)), axis), turns, atol=1e-14)


def test_continuous_undoes_flips_of_sign() -> None:
    steady = about(np.array([0.0, 0.0, 1.0]), np.linspace(0.0, 9.0, 40))
    flipped = steady * np.where(RNG.random((40, 1)) < 0.5, -1.0, 1.0)
    sign = np.sign(steady[0] @ flipped[0])
    assert_allclose(continuous(flipped), sign * steady, atol=1e-15)
