"""A clip in the wrong unit is refused, with the unit that makes it a person."""

from __future__ import annotations

import numpy as np
import pytest

from flowborne.base.errors import SceneError
from flowborne.motion.bvh import TO_WORLD
from flowborne.motion.clip import Clip
from flowborne.motion.clip_reading import check_scale, leg_length, likely_unit, standing_axis

STILL = np.array([1.0, 0.0, 0.0, 0.0])


def test_leg_is_measured_along_the_bones() -> None:
    names = ("pelvis", "a", "b", "twist", "c", "d", "e", "f")
    mapping = dict.fromkeys(("left_hip", "right_hip"), "a") | {"right_hip": "d"}
    mapping |= {"left_ankle": "c", "right_ankle": "f"}
    offsets = np.zeros((8, 3))
    offsets[1:] = [
        [9, 0, 0],
        [0, 0, -0.4],
        [0, 0.3, -0.4],
        [0.1, 0, 0],
        [7, 0, 0],
        [0, 0.6, 0],
        [0, 0, 0.8],
    ]
    clip = Clip(
        names,
        np.array([-1, 0, 1, 2, 3, 0, 5, 6]),
        offsets,
        {},
        0.01,
        np.tile(STILL, (1, 8, 1)),
        np.zeros((1, 3)),
    )
    assert leg_length(clip, mapping) == pytest.approx((0.4 + 0.5 + 0.1 + 0.6 + 0.8) / 2.0)


@pytest.mark.parametrize(
    ("length", "unit", "remedy"),
    [
        (85.0, 1.0, "0.01 (cm)"),
        (0.85, 0.01, "1 (m)"),
        (33.4, 1.0, "0.0254 (inches)"),
        (14.2, 1.0, "0.056444 (CMU's own)"),
        (850.0, 1.0, "0.001 (mm)"),
        (80.0, 0.0001, "0.01 (cm)"),
        (1e9, 1.0, "8.56e-10"),
        (21.7, 1.0, "0.0394"),
    ],
)
def test_implausible_leg_names_a_unit_that_fits(length: float, unit: float, remedy: str) -> None:
    """None that makes a giant of 2.4 m, as CMU's own does of the last."""
    with pytest.raises(SceneError) as caught:
        check_scale(length, unit)
    assert str(caught.value) == (
        f"with unit = {unit:g} its legs are {length * unit:.3g} m long from hip to ankle. "
        f"Set unit = {remedy}, or leave it out."
    )


@pytest.mark.parametrize("length", np.geomspace(1e-3, 1e5, 40))
def test_a_likely_unit_makes_a_grown_persons_legs(length: float) -> None:
    unit = likely_unit(length)
    assert 0.65 <= unit * length <= 1.1
    check_scale(length, unit)


def test_the_axis_along_which_a_person_stands_is_up() -> None:
    for axis, world in TO_WORLD.items():
        standing = np.array([0.2, -0.3, 0.9])
        for read_as, other in TO_WORLD.items():
            assert standing_axis(other @ world.T @ standing, read_as) == axis
    lying = np.array([0.0, 0.95, 0.3])  # from side to side in a file of either axis
    assert standing_axis(lying, "y") is None
    leaning = np.array([0.7, 0.0, 0.6])
    assert standing_axis(leaning, "y") == "y", "y goes before what fits better"


def test_children_and_giants_pass() -> None:
    for length in (0.2, 0.85, 2.0):
        check_scale(100.0 * length, 0.01)


def test_legs_without_length_are_refused() -> None:
    with pytest.raises(SceneError, match="no length from hip to ankle"):
        likely_unit(0.0)
