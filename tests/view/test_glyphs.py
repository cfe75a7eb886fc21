"""Marks stand still in the world, and are there where a camera goes along."""

from __future__ import annotations

import numpy as np
import pytest

from flowborne.view.glyphs import camera_moves, crosses, motes


def test_marks_are_for_cameras_that_move() -> None:
    path = np.outer(np.linspace(0.0, 1.0, 9), [0.5, 0.0, 0.0])
    assert camera_moves(path, 2.0)
    assert not camera_moves(path, 20.0)


def test_crosses_are_a_round_number_of_metres_apart_wherever_one_looks() -> None:
    low, high = np.array([0.3, -0.9]), np.array([2.3, 0.6])
    moved = np.array([0.37, 0.0])
    here, there = (
        crosses(low + shift, high + shift, 1.5).mean(axis=1) for shift in (0.0 * moved, moved)
    )
    for places in (here, there):
        np.testing.assert_allclose(places / 0.2, np.round(places / 0.2), atol=1e-9)
    assert ((here >= low - 1e-9) & (here <= high + 1e-9)).all()


def test_motes_stand_still_while_one_goes_by() -> None:
    before, after = (motes(400, np.array([x, 0.0, 0.0]), 2.0) for x in (0.0, 0.5))
    for around, points in ((0.0, before), (0.5, after)):
        assert np.abs(points - [around, 0.0, 0.0]).max() <= 2.0
    kept = np.isclose(before, after).all(axis=1)
    assert kept.mean() == pytest.approx(1.0 - 0.5 / 4.0, abs=0.05)
    np.testing.assert_allclose((after - before)[~kept], [[4.0, 0.0, 0.0]] * int((~kept).sum()))
