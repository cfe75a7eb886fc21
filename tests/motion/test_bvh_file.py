"""Angles of rotations, against scipy's, across turns and at the lock."""

from __future__ import annotations

from itertools import permutations

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation

from flowborne.motion.bvh_file import angles_of, quaternions_of
from flowborne.motion.quaternions import angle, inverse, product

ORDERS = list(permutations(range(3)))
AXES = np.eye(3)


@pytest.mark.parametrize("order", ORDERS)
def test_quaternions_are_the_product_in_the_order_of_the_angles(order: tuple[int, ...]) -> None:
    angles = np.random.default_rng(1).uniform(-400.0, 400.0, (30, 3))
    names = "".join("XYZ"[axis] for axis in order)
    expected = Rotation.from_euler(names, angles, degrees=True)
    found = Rotation.from_quat(quaternions_of(angles, AXES[list(order)]), scalar_first=True)
    assert_allclose(found.as_matrix(), expected.as_matrix(), atol=1e-13)


@pytest.mark.parametrize("order", ORDERS)
def test_angles_come_back_even_over_several_turns(order: tuple[int, int, int]) -> None:
    s = np.linspace(0.0, 1.0, 400)[:, None]
    angles = 20.0 + s * [900.0, 0.0, -700.0] + 89.0 * np.sin(7.0 * s * [1.0, 2.0, 1.3])
    rotations = quaternions_of(angles, AXES[list(order)])
    assert_allclose(angles_of(rotations, order, angles[0]), angles, atol=1e-8)


@pytest.mark.parametrize("order", ORDERS)
@pytest.mark.parametrize("middle", [90.0, -90.0])
def test_where_the_middle_angle_locks_the_others_stay_nearest(
    order: tuple[int, int, int], middle: float
) -> None:
    angles = np.array([[10.0, middle, 30.0], [14.0, middle, 33.0], [40.0, middle, 20.0]])
    rotations = quaternions_of(angles, AXES[list(order)])
    found = angles_of(rotations, order, np.array([10.0, middle, 30.0]))
    back = quaternions_of(found, AXES[list(order)])
    assert angle(product(inverse(rotations), back)).max() < 1e-7
    assert_allclose(found[0], angles[0], atol=1e-6)
    steps = np.abs(np.diff(found, axis=0))
    assert np.all(steps <= np.abs(np.diff(angles, axis=0)).max(axis=1, keepdims=True) + 1e-6)


def test_passing_close_to_the_lock_turns_no_angle_by_more_than_it_has_to() -> None:
    s = np.linspace(-1.0, 1.0, 401)
    angles = np.stack([20.0 + 5.0 * s, 90.0 + 30.0 * s, -8.0 + 0.0 * s], axis=-1)
    rotations = quaternions_of(angles, AXES[[2, 0, 1]])
    assert_allclose(angles_of(rotations, (2, 0, 1), angles[0]), angles, atol=0.025)  # one step
