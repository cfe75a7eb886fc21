"""Fields in the middle of cells against flows whose derivatives are known."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose

from flowborne.fluid.grid import Grid
from flowborne.runs.states import cell_velocity, cell_vorticity, velocity_gradients

SLOPES = np.array([[0.3, -0.2, 0.5], [1.1, 0.4, -0.6], [0.7, -0.9, -0.7]])
"""Derivative of each component along each axis, 1/s."""


def linear(grid: Grid, slopes: np.ndarray) -> dict[str, np.ndarray]:
    """State of a fluid whose velocity is `slopes` times the place."""
    state = {}
    for axis in grid.axes:
        places = np.stack(np.meshgrid(*grid.face_coordinates(axis), indexing="ij"), axis=-1)
        state[f"velocity_{'xyz'[axis]}"] = (places @ slopes[axis]).astype(np.float32)
    return state


def test_a_linear_flow_has_its_slopes_everywhere() -> None:
    grid = Grid((4, 5, 6), 0.5)
    state = linear(grid, SLOPES)
    places = np.stack(np.meshgrid(*grid.cell_coordinates(), indexing="ij"), axis=-1)
    assert_allclose(cell_velocity(grid, state), places @ SLOPES.T, atol=1e-5)
    wanted = np.broadcast_to(SLOPES[:, :, None, None, None], (3, 3, 4, 5, 6))
    assert_allclose(velocity_gradients(grid, state), wanted, atol=1e-5)
    curl = [SLOPES[2, 1] - SLOPES[1, 2], SLOPES[0, 2] - SLOPES[2, 0], SLOPES[1, 0] - SLOPES[0, 1]]
    assert_allclose(cell_vorticity(grid, state), np.broadcast_to(curl, (4, 5, 6, 3)), atol=1e-5)


def test_a_slab_turns_about_z_alone() -> None:
    grid = Grid.slab(6, 5, 0.25, (0.0, 0.0))
    turning = np.array([[0.0, -1.5, 0.0], [1.5, 0.0, 0.0], [0.0, 0.0, 0.0]])
    curl = cell_vorticity(grid, linear(grid, turning))
    assert curl.shape == (6, 5, 1, 3)
    assert not curl[..., :2].any()
    assert curl[..., 2] == pytest.approx(3.0, rel=1e-5)
