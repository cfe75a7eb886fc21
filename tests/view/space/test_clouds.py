"""What is seen of a fluid in space is what the states hold."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from flowborne.fluid.grid import Grid
from flowborne.view import style
from flowborne.view.space.camera import RIGHT, TOWARD
from flowborne.view.space.clouds import CloudDye, CloudVorticity, cloud_of, vorticity

State = dict[str, np.ndarray]


def turning(grid: Grid, spin: np.ndarray) -> State:
    """State of a fluid that turns as a whole with angular velocity `spin`, 1/s."""
    state: State = {"open": np.ones(grid.shape, np.float32)}
    for axis, name in enumerate("xyz"):
        places = np.stack(np.meshgrid(*grid.face_coordinates(axis), indexing="ij"), axis=-1)
        state[f"velocity_{name}"] = np.cross(spin, places)[..., axis].astype(np.float32)
    return state


def shown(grid: Grid, picture: str, *states: State) -> SimpleNamespace:
    """As much of a run as a cloud reads."""
    return SimpleNamespace(
        grid=grid, picture=picture, state=lambda n: states[n], sampled=lambda most: states
    )


def test_vorticity_of_a_rigid_rotation_is_twice_its_rate(box_of_fluid: Grid) -> None:
    spin = np.array([0.4, -1.1, 2.3])
    curl = vorticity(turning(box_of_fluid, spin), box_of_fluid)
    assert curl.shape == (12, 10, 8, 3)
    np.testing.assert_allclose(curl, np.broadcast_to(2.0 * spin, curl.shape), rtol=1e-4)


@pytest.mark.parametrize(
    ("axis", "colour"),
    [(TOWARD, style.SPIN_LEFT[1]), (-TOWARD, style.SPIN_RIGHT[1])],
)
def test_a_turn_to_the_left_is_warm_and_one_to_the_right_cold(
    box_of_fluid: Grid, axis: np.ndarray, colour: str
) -> None:
    run = shown(box_of_fluid, "vorticity", turning(box_of_fluid, 3.0 * axis))
    cloud = cloud_of(run)
    assert isinstance(cloud, CloudVorticity)
    assert cloud.limit == pytest.approx(6.0, rel=1e-4)
    voxels = cloud.voxels(run.state(0))
    assert (voxels[..., 3] > 250).all()
    assert np.abs(voxels[..., :3] - np.rint(255.0 * style.rgb(colour))).max() <= 1.0


def test_what_turns_slowly_is_not_seen(box_of_fluid: Grid) -> None:
    fast, slow = (turning(box_of_fluid, rate * RIGHT) for rate in (3.0, 0.5))
    cloud = CloudVorticity(shown(box_of_fluid, "vorticity", fast, slow))  # type: ignore[arg-type]
    assert cloud.voxels(slow)[..., 3].max() == 0
    still = cloud.voxels(fast | {"open": np.zeros_like(fast["open"])})
    assert still[..., 3].max() == 0


def test_dye_has_its_colour_and_is_as_dense_as_there_is_of_it(box_of_fluid: Grid) -> None:
    ink, milk = np.zeros((2, *box_of_fluid.shape), np.float32)
    ink[:6], milk[:, :5] = 2.0, 0.5
    ink[0, 0, 0], milk[0, 0, 0] = np.nan, np.nan
    state = {"open": np.ones_like(ink), "scalar_ink": ink, "scalar_milk": milk}
    run = shown(box_of_fluid, "dye", state)
    cloud = cloud_of(run)
    assert isinstance(cloud, CloudDye)
    assert cloud.legend == [("ink", style.DYES[0]), ("milk", style.DYES[1])]
    voxels = cloud.voxels(state).astype(int)
    first, second = (np.rint(255.0 * style.rgb(colour)) for colour in style.DYES[:2])
    assert np.abs(voxels[3, 8, 3] - [*first, 255]).max() <= 1
    assert np.abs(voxels[9, 2, 3] - [*second, 255]).max() <= 1
    assert np.abs(voxels[3, 2, 3] - [*(0.5 * (first + second)), 255]).max() <= 1
    assert voxels[9, 8, 3, 3] == voxels[0, 0, 0, 3] == 0
    half = cloud.voxels(state | {"scalar_ink": 0.5 * ink}).astype(int)
    assert half[3, 8, 3, 3] == pytest.approx(127, abs=1)


def test_nothing_is_seen_where_the_scene_wants_nothing(box_of_fluid: Grid) -> None:
    state = turning(box_of_fluid, TOWARD)
    assert cloud_of(shown(box_of_fluid, "none", state)) is None
    assert isinstance(cloud_of(shown(box_of_fluid, "dye", state)), CloudVorticity)
