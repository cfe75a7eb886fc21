"""What is shown of the fluid: dye, vorticity, vortices, speed or pressure, and its colours."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from flowborne.fluid.grid import Grid
from flowborne.kernels.arrays import Array, Mask, Pixels, Real, Single
from flowborne.runs.states import cell_vorticity, velocity_gradients
from flowborne.view import style
from flowborne.view.run import Run, State
from flowborne.view.shot import Shot

Scale = tuple[Array, float, float, str]
"""Colours from lowest to highest (k, 3), lowest value, highest value, name."""
Legend = Sequence[tuple[str, str]]
"""(name, colour) of each thing shown in its own colour."""

SAMPLES, SAMPLES_IN_SPACE = 24, 12
"""Frames from which the scale of a film is taken."""

VORTEX_SHARE = 0.6
"""Share of the sum of positive Q that is inside the surfaces of vortices."""

MAX_PERCENTILE = 99.8
"""Percentile of speed and pressure at which their colours end: peaks are small in area."""

STRONG_DYE_PERCENTILE = 75.0
"""Percentile of a dye's values above half the largest at which it has its full colour."""

STRONGER_CIRCULATION = 0.4
"""Fraction of the sum of |vorticity| that exceeds the scale of vorticity."""

UNCUT = 0.999
"""Open fraction above which a cell counts as not cut by a body."""

FADED = 0.08
"""Part of a domain that follows bodies, at each side, in which what is shown fades into plain
water: there is water beyond, of which nothing is known."""

REFINED_SIDE = 256
"""Minimum number of points along the longer side of a refined field."""

FILLED_LAYERS, FILLED_LAYERS_VORTICITY = 2, 4
"""Layers of cells in a body that continue the fluid; vorticity is also missing in cut cells."""


class FieldDye:
    """Dyes, each in its own colour, mixed where they meet.

    legend  (name, colour) of each
    raises  ValueError if there is no dye
    """

    scale: Scale | None = None

    def __init__(self, run: Run, samples: int = SAMPLES) -> None:
        """`samples`: number of frames from which the values at full colour are taken."""
        names = [name for name in run.state(0) if name.startswith("scalar_")]
        if not names:
            raise ValueError(
                "the run has no dye to show; draw another field: vorticity, speed or pressure"
            )
        sampled = run.sampled(samples)
        colours = [style.DYES[n % len(style.DYES)] for n in range(len(names))]
        self._dyes = [
            (name, full_strength([state[name] for state in sampled]), style.rgb(colour))
            for name, colour in zip(names, colours, strict=True)
        ]
        self.legend: Legend = [
            (name.removeprefix("scalar_"), colour)
            for name, colour in zip(names, colours, strict=True)
        ]
        self._axes = run.window_axes

    def image(self, state: State) -> Pixels:
        """(ny, nx, 4) colours and opacities of the cells of a slab, lowest row first."""
        known = _in_fluid(state)[:, :, 0]
        weight: Array = np.zeros((*known.T.shape, 1))
        colour, clear = np.repeat(weight, 3, axis=-1), np.ones_like(weight)
        for name, full, own in self._dyes:
            share = _filled(state[name][:, :, 0] / full, known)
            strength = np.clip(share.T, 0.0, 1.0)[..., None]
            light = 0.25 * strength**3
            colour += strength * (own * (1.0 - light) + light)
            weight += strength
            clear *= 1.0 - strength
        mixed = colour / np.maximum(weight, 1e-12)
        return style.to_bytes(np.concatenate([mixed, 1.0 - clear], axis=-1))

    def smoke(self, state: State) -> tuple[Single, Single]:
        """Colours (nx, ny, nz, 3) and densities (nx, ny, nz) of the cells, from 0 to 1."""
        colour = np.zeros((*state["open"].shape, 3), np.float32)
        weight = np.zeros(state["open"].shape, np.float32)
        for name, full, own in self._dyes:
            strength = np.clip(np.nan_to_num(state[name]) / full, 1e-6, 1.0)
            colour += strength[..., None] * own.astype(np.float32)
            weight += strength
        density = np.minimum(weight, 1.0) * state["open"] * side_weight(weight.shape, self._axes)
        return (colour / weight[..., None]).astype(np.float32), density.astype(np.float32)


class FieldVorticity:
    """Vorticity of a slab, warm if counter-clockwise, on one scale for all frames.

    limit  1/s, at the strongest colours
    """

    legend: Legend = ()

    def __init__(self, run: Run, background: str) -> None:
        """`background`: colour at zero vorticity, "#rrggbb"."""
        assert run.grid is not None
        self.grid = run.grid
        self.limit = vorticity_limit(
            [slab_vorticity(state, run.grid) for state in run.sampled(SAMPLES)]
        )
        self.table = style.vorticity_table(1023)
        colours = over(self.table, background) / 255.0
        self.scale: Scale | None = (colours, -self.limit, self.limit, "vorticity (1/s)")

    def image(self, state: State) -> Pixels:
        """(k ny, k nx, 4) colours and opacities of k by k parts of each cell, lowest row first."""
        share = _refined(slab_vorticity(state, self.grid).T / self.limit)
        return self.table[_table_rows(share, len(self.table))]


class FieldVortices:
    """Vortices in space: iso-surfaces of Q, inside which rotation exceeds strain.

    Q is half of (rotation rate squared - strain rate squared) (Hunt, Wray and Moin 1988). The
    surfaces are warm where the rotation is counter-clockwise for the camera.

    level  1/s^2, Q on the surfaces; see VORTEX_SHARE; the median over frames
    """

    scale: Scale | None = None

    def __init__(self, run: Run) -> None:
        assert run.grid is not None
        self._grid, self._axes = run.grid, run.window_axes
        levels = [_level_of(self.q(state), VORTEX_SHARE) for state in run.sampled(SAMPLES_IN_SPACE)]
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


class FieldNumber:
    """Speed or pressure, on one scale for all frames: of a slab, or in a plane through space.

    limit  in the quantity's unit, at the end of the scale
    """

    legend: Legend = ()

    def __init__(self, run: Run, name: Literal["speed", "pressure"]) -> None:
        self._signed = name == "pressure"
        self.values = _pressure if self._signed else _speed
        sampled = [np.abs(self.values(state))[_in_fluid(state)] for state in run.sampled(SAMPLES)]
        sizes = _finite_sizes(sampled)
        self.limit = max(float(np.percentile(sizes, MAX_PERCENTILE)), 1e-12) if sizes.size else 1.0
        self.table = style.number_table(style.PRESSURE if self._signed else style.SPEED, 255)
        low = -self.limit if self._signed else 0.0
        title = "pressure about its mean (Pa)" if self._signed else "speed (m/s)"
        self.scale: Scale | None = (self.table / 255.0, low, self.limit, title)

    def image(self, state: State) -> Pixels:
        """(k ny, k nx, 4) colours and opacities of k by k parts of each cell, lowest row first."""
        values = _filled(self.values(state)[:, :, 0], _in_fluid(state)[:, :, 0])
        colours = self.colours(_refined(values.T))
        opaque = np.full((*colours.shape[:-1], 1), 255, np.uint8)
        return np.concatenate([colours, opaque], axis=-1)

    def layer(self, state: State, axis: int, cell: float) -> Pixels:
        """(n, m, 3) colours of the layer of cells normal to `axis` at `cell`, counted in cells."""
        values = np.moveaxis(self.values(state), axis, 0)
        return self.colours(values[int(np.clip(cell, 0, len(values) - 1))])

    def colours(self, values: Array) -> Pixels:
        """(..., 3) colours of values in the quantity's unit."""
        share = values / self.limit
        return self.table[_table_rows(share if self._signed else 2.0 * share - 1.0, 255)]


Field = FieldDye | FieldVorticity | FieldVortices | FieldNumber
"""What is shown of the fluid, on scales that hold for all frames."""


def field_of(run: Run, shot: Shot) -> Field | None:
    """What `shot` shows of the fluid of `run`; None if nothing is visible.

    raises  ValueError if it shows dye and there is none
    """
    if run.grid is None or shot.field == "none":
        return None
    slab = run.grid.is_slab
    if shot.field == "dye":
        return FieldDye(run, SAMPLES if slab else SAMPLES_IN_SPACE)
    if shot.field == "vorticity":
        return FieldVorticity(run, shot.colour) if slab else FieldVortices(run)
    return FieldNumber(run, shot.field)


def over(image: Pixels, background: str) -> Pixels:
    """(..., 3) an image (..., 4) in front of a background, "#rrggbb"."""
    share = image[..., 3:] / 255.0
    return np.rint(image[..., :3] * share + 255.0 * style.rgb(background) * (1.0 - share)).astype(
        np.uint8
    )


def faded(image: Pixels, axes: Sequence[int]) -> Pixels:
    """An image (ny, nx, 4) that fades out towards its sides across `axes`, 0 for x and 1 for y."""
    weight = side_weight(image.shape[:2], [1 - axis for axis in axes])
    opacity = np.rint(image[..., 3:] * weight[..., None]).astype(np.uint8)
    return np.concatenate([image[..., :3], opacity], axis=-1)


def side_weight(shape: Sequence[int], axes: Sequence[int]) -> Array:
    """Weights (...) of cells: 1, and going to 0 towards the sides across `axes`; see FADED."""
    weight = np.ones(tuple(shape))
    for axis in axes:
        count = shape[axis]
        depth = np.minimum(np.arange(count), np.arange(count)[::-1]) + 0.5
        share = np.clip(depth / (FADED * count), 0.0, 1.0)
        along = [1] * len(shape)
        along[axis] = count
        weight *= np.reshape(share * share * (3.0 - 2.0 * share), along)
    return weight


def slab_vorticity(state: State, grid: Grid) -> Array:
    """(nx, ny) vorticity about z at the cell centres, 1/s; bodies continue their neighbours.

    The corners' values dv/dx - du/dy are averaged; the outermost corners copy their neighbours.
    Corners of cells that a body cuts are left out: partly closed faces carry a flux, not a velocity
    that can be differentiated.
    """
    u, v = state["velocity_x"][:, :, 0], state["velocity_y"][:, :, 0]
    corners = (np.diff(v[:, 1:-1], axis=0) - np.diff(u[1:-1], axis=1)) / grid.spacing
    uncut = state["open"][:, :, 0] > UNCUT
    counted = np.isfinite(corners)
    counted &= uncut[1:, 1:] & uncut[1:, :-1] & uncut[:-1, 1:] & uncut[:-1, :-1]
    padded = np.pad(np.where(counted, corners, 0.0).astype(float), 1, mode="edge")
    count = _corner_sum(np.pad(counted.astype(float), 1, mode="edge"))
    mean = _corner_sum(padded) / np.maximum(count, 1.0)
    return _filled(mean, count > 0.0, FILLED_LAYERS_VORTICITY)


def _speed(state: State) -> Array:
    """(nx, ny, nz) magnitude of the velocity in the cells, m/s."""
    faces = [state[name] for name in ("velocity_x", "velocity_y", "velocity_z") if name in state]
    cells = [0.5 * (np.delete(v, 0, axis) + np.delete(v, -1, axis)) for axis, v in enumerate(faces)]
    return np.asarray(np.sqrt(sum(v.astype(float) ** 2 for v in cells)))


def _pressure(state: State) -> Array:
    """(nx, ny, nz) pressure in the cells relative to its mean in the fluid, Pa."""
    values = state["pressure"].astype(float)
    known = values[_in_fluid(state)]
    return np.asarray(values - (known[np.isfinite(known)].mean() if known.size else 0.0))


def _in_fluid(state: State) -> Mask:
    return np.asarray(state["open"] > 0.5)


def _filled(values: Real, known: Mask, layers: int = FILLED_LAYERS) -> Array:
    """`values` (nx, ny) with unknown ones and NaNs replaced by the mean of their neighbours.

    This fills `layers` of cells, so that interpolation has no jump at a body's edge; the rest is 0.
    """
    known = np.isfinite(values) & known
    result = np.where(known, values, 0.0).astype(float)
    for _ in range(layers):
        total, count = _neighbour_sum(result), _neighbour_sum(known.astype(float))
        reached = ~known & (count > 0.0)
        result[reached] = total[reached] / count[reached]
        known |= reached
    return result


def _corner_sum(values: Array) -> Array:
    return np.asarray(values[1:, 1:] + values[1:, :-1] + values[:-1, 1:] + values[:-1, :-1])


def _neighbour_sum(values: Array) -> Array:
    padded = np.pad(values, 1)
    return np.asarray(padded[2:, 1:-1] + padded[:-2, 1:-1] + padded[1:-1, 2:] + padded[1:-1, :-2])


def _refined(values: Array) -> Array:
    """`values` (n, m) interpolated by cubics on a grid finer by an integer factor, so that edges of
    colours follow the values and not the cells."""
    factor = -(-REFINED_SIDE // max(values.shape))
    if factor == 1:
        return values
    size = (factor * values.shape[1], factor * values.shape[0])
    fine = Image.fromarray(values.astype(np.float32)).resize(size, Image.Resampling.BICUBIC)
    return np.asarray(fine, float)


def vorticity_limit(values: Sequence[Array]) -> float:
    """Size of vorticity with the strongest colours, by STRONGER_CIRCULATION.

    So a wake has the same colours in a large domain as in a small one.
    """
    sizes = _finite_sizes(values)
    return max(_level_of(sizes, STRONGER_CIRCULATION), 1e-12) if sizes.size else 1.0


def full_strength(frames: Sequence[Real]) -> float:
    """Value at which a dye has its full colour: a percentile of its strong values, not the maximum,
    which is an overshoot of the advection at an edge."""
    values = np.concatenate([frame.ravel() for frame in frames])
    values = values[np.isfinite(values)]
    strong = values[values > 0.5 * values.max(initial=0.0)]
    return max(float(np.percentile(strong, STRONG_DYE_PERCENTILE)), 1e-12) if strong.size else 1.0


def _finite_sizes(values: Sequence[Array]) -> Array:
    sizes = np.abs(np.concatenate([one.ravel() for one in values]))
    return np.asarray(sizes[np.isfinite(sizes)])


def _table_rows(share: Array, count: int) -> NDArray[np.intp]:
    """Rows of a table of `count` colours for shares of the limit from -1 to 1."""
    half = 0.5 * (count - 1)
    return np.rint(half + half * np.clip(np.nan_to_num(share), -1.0, 1.0)).astype(np.intp)


def _level_of(values: Array, share: float) -> float:
    """Level such that larger values make up a share of the sum of positive ones; 0 if none are."""
    positive = np.sort(values[values > 0.0])[::-1]
    if not positive.size:
        return 0.0
    total = np.cumsum(positive)
    return float(positive[np.searchsorted(total, share * total[-1])])
