"""A clip in the wrong unit is told so, and in which one it makes a person."""

from __future__ import annotations

import numpy as np
import pytest

from flowborne.errors import SceneError
from flowborne.io.clip import Clip
from flowborne.scenes.clip_scale import check_scale, leg_length

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
        (0.0085, 0.01, "1 (m)"),
        (33.4, 1.0, "0.0254 (inches)"),
        (14.2, 1.0, "0.056444 (CMU's own)"),
        (850.0, 1.0, "0.001 (mm)"),
        (0.008, 0.0001, "0.01 (cm)"),
        (1e9, 1.0, "8.5e-10 or so"),
    ],
)
def test_implausible_leg_names_a_unit_that_fits(length: float, unit: float, remedy: str) -> None:
    with pytest.raises(SceneError) as caught:
        check_scale(length, unit)
    assert str(caught.value) == (
        f"with unit = {unit:g} its legs are {length:.3g} m long from hip to ankle. "
        f"Set unit = {remedy}."
    )


def test_children_and_giants_pass() -> None:
    for length in (0.2, 0.85, 2.0):
        check_scale(length, 0.01)


def test_legs_without_length_are_refused() -> None:
    with pytest.raises(SceneError, match="no length from hip to ankle"):
        check_scale(0.0, 1.0)
