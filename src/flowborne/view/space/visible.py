"""The visible quantities of a 3D fluid: dye, vortices, or a slice of speed or pressure."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from flowborne.kernels.arrays import Array
from flowborne.runs.states import cell_vorticity, velocity_gradients
from flowborne.view import style
from flowborne.view.fields import NUMBERS, FieldNumber, Legend, Scale, dye_colours, side_weight
from flowborne.view.run import Run, State
from flowborne.view.shot import Shot

Single = NDArray[np.float32]

SAMPLES = 12
"""Frames from which the scale of a film is taken."""

VORTEX_SHARE = 0.6
"""Share of the sum of positive Q that is inside the surfaces of vortices."""


def visible_of(run: Run, shot: Shot) -> Visible | None:
    """What `shot` shows of the fluid of `run`; None if nothing is visible.

    raises  ValueError if it shows dye and there is none
    """
    if run.grid is None or shot.field == "none":
        return None
    if shot.field == "dye":
        return VisibleDye(run)
    if shot.field == "vorticity":
        return VisibleVortices(run)
    return FieldNumber(run, NUMBERS[shot.field])


class VisibleDye:
    """Dyes, each in its own colour, mixed where they meet.

    legend  (name, colour) of each
    """

    scale: Scale | None = None

    def __init__(self, run: Run) -> None:
        self._dyes, self.legend = dye_colours(run, SAMPLES)
        self._axes = run.window_axes

    def smoke(self, state: State) -> tuple[Single, Single]:
        """Colours (nx, ny, nz, 3) and densities (nx, ny, nz) of the cells, from 0 to 1."""
        colour = np.zeros((*state["open"].shape, 3), np.float32)
        weight = np.zeros(state["open"].shape, np.float32)
        for dye, (full, name) in self._dyes.items():
            strength = np.clip(np.nan_to_num(state[dye]) / full, 1e-6, 1.0)
            colour += strength[..., None] * style.rgb(name).astype(np.float32)
            weight += strength
        density = np.minimum(weight, 1.0) * state["open"] * side_weight(weight.shape, self._axes)
        return (colour / weight[..., None]).astype(np.float32), density.astype(np.float32)


class VisibleVortices:
    """Vortices: iso-surfaces of Q, inside which rotation exceeds strain.

    Q is half of (rotation rate squared - strain rate squared) (Hunt, Wray and Moin 1988). The
    surfaces are warm where the rotation is counter-clockwise for the camera.

    level  1/s^2, Q on the surfaces; see VORTEX_SHARE; the median over frames
    """

    scale: Scale | None = None

    def __init__(self, run: Run) -> None:
        assert run.grid is not None
        self._grid, self._axes = run.grid, run.window_axes
        levels = [_level_of(self.q(state), VORTEX_SHARE) for state in run.sampled(SAMPLES)]
        self.level = float(f"{max(float(np.median(levels)), 1e-12):.2g}")
        self.legend: Legend = (
            (f"vortices, Q = {self.level:g} /s², counter-clockwise", style.SPIN_LEFT[1]),
            ("clockwise", style.SPIN_RIGHT[1]),
        )

    def q(self, state: State) -> Array:
        """(nx, ny, nz) Q in the cells, 1/s^2; 0 in bodies and where it is not finite.

        It goes to 0 at the sides of a domain that follows bodies, so that vortices have ends there.
        """
        gradients = velocity_gradients(self._grid, state)
        q = -0.5 * np.einsum("ij...,ji...->...", gradients, gradients)
        q *= side_weight(q.shape, self._axes)
        return np.where(state["open"] > 0.5, np.nan_to_num(q), 0.0)

    def sense(self, state: State, toward: Array) -> Array:
        """(nx, ny, nz) sense of rotation seen from `toward` (3,), from -1 (clockwise) to 1."""
        spin = np.nan_to_num(cell_vorticity(self._grid, state))
        return np.asarray(spin @ toward / np.maximum(np.linalg.norm(spin, axis=-1), 1e-12))


def _level_of(values: Array, share: float) -> float:
    """Level such that larger values make up a share of the sum of positive ones; 0 if none are."""
    positive = np.sort(values[values > 0.0])[::-1]
    if not positive.size:
        return 0.0
    return float(positive[np.searchsorted(np.cumsum(positive), share * positive.sum())])


Visible = VisibleDye | VisibleVortices | FieldNumber
"""What is visible; a number is shown in a plane through the camera's target."""
