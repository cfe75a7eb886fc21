"""What is seen of a fluid in space is what the states hold."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from flowborne.fluid.grid import Grid
from flowborne.view import style
from flowborne.view.fields import FieldDye, FieldNumber, FieldVortices, field_of
from flowborne.view.shot import Shot

State = dict[str, np.ndarray]

TOWARD = np.array([0.4, -0.8, 0.2]) / np.linalg.norm([0.4, -0.8, 0.2])


def turning(grid: Grid, spin: np.ndarray, strain: float = 0.0) -> State:
    """State of a fluid that turns as a whole with angular velocity `spin`, 1/s, and is drawn out
    along x and pressed along y at a rate `strain`, 1/s."""
    state: State = {"open": np.ones(grid.shape, np.float32)}
    for axis, name in enumerate("xyz"):
        places = np.stack(np.meshgrid(*grid.face_coordinates(axis), indexing="ij"), axis=-1)
        velocity = np.cross(spin, places) + strain * places * [1.0, -1.0, 0.0]
        state[f"velocity_{name}"] = velocity[..., axis].astype(np.float32)
    return state


def shown(grid: Grid, *states: State) -> SimpleNamespace:
    """As much of a run as is read."""
    return SimpleNamespace(
        grid=grid, window_axes=(), state=lambda n: states[n], sampled=lambda most: states
    )


@pytest.mark.parametrize(("rate", "strain"), [(3.0, 0.0), (0.0, 2.0), (2.0, 2.0), (2.0, 1.0)])
def test_q_is_of_rotation_less_strain(box_of_fluid: Grid, rate: float, strain: float) -> None:
    """Half of |rotation rate|^2 = 2 rate^2, less half of |strain rate|^2 = 2 strain^2."""
    state = turning(box_of_fluid, np.array([0.0, 0.0, rate]), strain)
    seen = field_of(shown(box_of_fluid, state), Shot())
    assert isinstance(seen, FieldVortices)
    np.testing.assert_allclose(seen.q(state), rate**2 - strain**2, atol=1e-4)
    closed = seen.q(state | {"open": np.zeros_like(state["open"])})
    assert not closed.any()


@pytest.mark.parametrize("sense", [1.0, -1.0])
def test_the_sense_is_that_which_the_camera_sees(box_of_fluid: Grid, sense: float) -> None:
    state = turning(box_of_fluid, 3.0 * sense * TOWARD)
    seen = FieldVortices(shown(box_of_fluid, state))  # type: ignore[arg-type]
    np.testing.assert_allclose(seen.sense(state, TOWARD), sense, atol=1e-5)


def test_the_legend_says_what_the_surfaces_are(box_of_fluid: Grid) -> None:
    """Slabs that turn at different rates: the strongest hold more than VORTEX_SHARE of all Q."""
    state = turning(box_of_fluid, np.array([0.0, 0.0, 1.0]))
    seen = FieldVortices(shown(box_of_fluid, state))  # type: ignore[arg-type]
    assert seen.level == pytest.approx(1.0, rel=0.01)
    assert [colour for _, colour in seen.legend] == [style.SPIN_LEFT[1], style.SPIN_RIGHT[1]]
    assert seen.legend[0][0] == "vortices, Q = 1 /s², counter-clockwise"


def test_dye_has_its_colour_and_is_as_dense_as_there_is_of_it(box_of_fluid: Grid) -> None:
    ink, milk = np.zeros((2, *box_of_fluid.shape), np.float32)
    ink[:6], milk[:, :5] = 2.0, 0.5
    ink[0, 0, 0], milk[0, 0, 0] = np.nan, np.nan
    state = {"open": np.ones_like(ink), "scalar_ink": ink, "scalar_milk": milk}
    seen = field_of(shown(box_of_fluid, state), Shot(field="dye"))
    assert isinstance(seen, FieldDye)
    assert seen.legend == [("ink", style.DYES[0]), ("milk", style.DYES[1])]
    colour, density = seen.smoke(state)
    first, second = (style.rgb(name) for name in style.DYES[:2])
    np.testing.assert_allclose(colour[3, 8, 3], first, atol=0.01)
    np.testing.assert_allclose(colour[9, 2, 3], second, atol=0.01)
    np.testing.assert_allclose(colour[3, 2, 3], 0.5 * (first + second), atol=0.01)
    assert density[9, 8, 3] == pytest.approx(0.0, abs=1e-5)
    assert density[0, 0, 0] == pytest.approx(0.0, abs=1e-5)
    assert density[3, 8, 3] == pytest.approx(1.0)
    half = seen.smoke(state | {"scalar_ink": 0.5 * ink})[1]
    assert half[3, 8, 3] == pytest.approx(0.5, abs=1e-5)


def test_a_slice_shows_the_layer_where_it_is(box_of_fluid: Grid) -> None:
    state = turning(box_of_fluid, np.array([0.0, 0.0, 2.0]))
    seen = field_of(shown(box_of_fluid, state), Shot(field="speed"))
    assert isinstance(seen, FieldNumber)
    assert seen.scale is not None
    assert seen.scale[3] == "speed (m/s)"
    image = seen.layer(state, 1, 5.5).astype(int)
    assert image.shape == (12, 8, 3)
    brightness = image.sum(axis=-1)
    assert (np.diff(brightness[6:], axis=0) > 0).all(), "faster away from the axis"
    assert np.abs(brightness - brightness[::-1]).max() <= 6


def test_nothing_is_seen_where_nothing_is_wanted_and_no_dye_is_said(box_of_fluid: Grid) -> None:
    state = turning(box_of_fluid, TOWARD)
    assert field_of(shown(box_of_fluid, state), Shot(field="none")) is None
    with pytest.raises(ValueError, match="the run has no dye to show"):
        field_of(shown(box_of_fluid, state), Shot(field="dye"))
