"""The fluid in 3D: lit smoke of dye, surfaces of vortices, and a coloured slice."""

from __future__ import annotations

import numpy as np
import pyvista as pv
from PIL import Image
from scipy.ndimage import zoom
from vtkmodules.vtkCommonDataModel import vtkPiecewiseFunction
from vtkmodules.vtkRenderingCore import vtkVolume, vtkVolumeProperty
from vtkmodules.vtkRenderingVolume import vtkGPUVolumeRayCastMapper

from flowborne.fluid.grid import Grid
from flowborne.kernels.arrays import Array, Pixels, Single
from flowborne.view import style
from flowborne.view.fields import FieldDye, FieldNumber, FieldVortices
from flowborne.view.run import State
from flowborne.view.space.lighting import scattered
from flowborne.view.space.surfaces import LIT

SMOKE_DEPTH = 0.016
"""Depth of full smoke that transmits 1/e of the light, in heights of the picture, or in sides of a
smaller domain."""

MIN_SMOKE_DEPTH = 0.8
"""Minimum of that depth in cells; thinner smoke has visible steps."""

FAINT, FULL = 0.06, 0.5
"""Densities below which smoke is invisible, and above which it is full."""

MAX_FINE_VOXELS = 1_500_000
"""Voxels up to which smoke is drawn on a grid twice as fine."""

MAX_FINE_POINTS = 4_000_000
"""Points up to which vortices are found on a grid twice as fine, by cubic interpolation of Q."""

SLICE_PIXELS = 1024
"""Longer side of the image of a slice."""


class Smoke:
    """A cloud of dye in a plotter."""

    def __init__(self, plotter: pv.Plotter, grid: Grid, dye: FieldDye, height: float) -> None:
        """`height`: of the view, m."""
        self._dye = dye
        self._depth = max(
            SMOKE_DEPTH * min(max(grid.shape), height / grid.spacing), MIN_SMOKE_DEPTH
        )
        self._mapper = vtkGPUVolumeRayCastMapper()
        self._mapper.SetAutoAdjustSampleDistances(False)
        self._mapper.SetUseJittering(True)
        self._volume = vtkVolume()
        self._volume.SetMapper(self._mapper)
        self._volume.SetProperty(_property(self._depth * grid.spacing))
        self._added = False
        self._plotter = plotter

    def show(self, state: State, grid: Grid, focus: Array, toward: Array) -> None:
        colour, strength = self._dye.smoke(state)
        share = np.clip((strength - FAINT) / (FULL - FAINT), 0.0, 1.0)
        density = (share * share * (3.0 - 2.0 * share)).astype(np.float32)
        solid = (1.0 - state["open"]).astype(np.float32)
        light = scattered(density / np.float32(self._depth), solid, toward)
        filled = np.argwhere(density > 1.0 / 255.0)
        self._volume.SetVisibility(len(filled) > 0)
        if len(filled) == 0:
            return
        first = np.maximum(filled.min(axis=0) - 2, 0)
        last = np.minimum(filled.max(axis=0) + 3, density.shape)
        part = tuple(slice(a, b) for a, b in zip(first, last, strict=True))
        size = np.prod(last - first)
        finer = 2 if 8 * size <= MAX_FINE_VOXELS else 1
        lit = np.clip(colour[part] * light[part], 0.0, 1.0)
        voxels = _voxels(lit, share[part], finer)
        h = grid.spacing / finer
        image = pv.ImageData(
            dimensions=voxels.shape[:3],
            spacing=(h, h, h),
            origin=np.array(grid.origin) + first * grid.spacing + 0.5 * h,
        )
        image.point_data["voxels"] = voxels.transpose(2, 1, 0, 3).reshape(-1, 4)
        self._mapper.SetInputData(image)
        self._mapper.SetSampleDistance(h)
        if not self._added:
            self._plotter.add_actor(self._volume, reset_camera=False, render=False)
            self._added = True


def _voxels(colour: Single, share: Single, finer: int) -> Pixels:
    """Colours (nx, ny, nz, 3) and shares of full density (nx, ny, nz) as bytes (..., 4).

    The shares are interpolated by cubics before they are sharpened to densities, so that edges
    follow the smoke and not its cells.
    """
    if finer > 1:
        options = {"grid_mode": True, "mode": "nearest"}
        share = np.clip(zoom(share, finer, order=3, **options), 0.0, 1.0)
        colour = zoom(colour, (finer, finer, finer, 1), order=1, **options)
    density = share * share * (3.0 - 2.0 * share)
    return style.to_bytes(np.concatenate([colour, density[..., None]], axis=-1))


def _property(depth: float) -> vtkVolumeProperty:
    """Coloured voxels, of which `depth` m at full density transmit 1/e of the light."""
    volume = vtkVolumeProperty()
    volume.IndependentComponentsOff()
    volume.ShadeOff()
    volume.SetInterpolationTypeToLinear()
    opacity = vtkPiecewiseFunction()
    opacity.AddPoint(0.0, 0.0)
    opacity.AddPoint(255.0, 1.0 - np.exp(-1.0))
    volume.SetScalarOpacity(opacity)
    volume.SetScalarOpacityUnitDistance(depth)
    return volume


def vortex_surface(
    vortices: FieldVortices,
    state: State,
    grid: Grid,
    toward: Array,
    max_fine: int = MAX_FINE_POINTS,
) -> pv.PolyData:
    """The surfaces of vortices as triangles; "sense" of their vertices is -1 (clockwise seen from
    `toward` (3,)) to 1.

    max_fine  points up to which they are found on a grid twice as fine
    """
    finer = 2 if 8 * np.prod(grid.shape) <= max_fine else 1
    h = grid.spacing / finer
    image = pv.ImageData(
        dimensions=[finer * n for n in grid.shape],
        spacing=(h, h, h),
        origin=[x + 0.5 * h for x in grid.origin],
    )
    for name, values, order in (
        ("q", vortices.q(state), 3),
        ("sense", vortices.sense(state, toward), 1),
    ):
        fine = values.astype(np.float32)
        if finer > 1:
            fine = zoom(fine, finer, order=order, grid_mode=True, mode="nearest")
        image.point_data[name] = fine.ravel(order="F")
    return image.contour([vortices.level], scalars="q")


class Vortices:
    """Surfaces of vortices in a plotter."""

    def __init__(self, plotter: pv.Plotter, vortices: FieldVortices) -> None:
        self._vortices, self._plotter = vortices, plotter
        self._actor: pv.Actor | None = None

    def show(self, state: State, grid: Grid, focus: Array, toward: Array) -> None:
        surface = vortex_surface(self._vortices, state, grid, toward)
        if self._actor is not None:
            self._plotter.remove_actor(self._actor, render=False)
            self._actor = None
        if surface.n_points == 0:
            return
        share = 0.5 + 0.5 * np.clip(surface.point_data["sense"], -1.0, 1.0)[:, None]
        warm, cold = style.rgb(style.SPIN_LEFT[1]), style.rgb(style.SPIN_RIGHT[1])
        surface.point_data["colour"] = style.to_bytes(cold + share * (warm - cold))
        self._actor = self._plotter.add_mesh(
            surface,
            scalars="colour",
            rgb=True,
            smooth_shading=True,
            reset_camera=False,
            render=False,
            **{key: value for key, value in LIT.items() if key != "interpolation"},
        )


class Slice:
    """A vertical coloured plane in a plotter, normal to the horizontal axis nearest to `toward`.

    toward  (3,) direction of the camera in the first frame
    """

    def __init__(self, plotter: pv.Plotter, grid: Grid, number: FieldNumber, toward: Array) -> None:
        self._number = number
        self._axis = int(np.argmax(np.abs(toward[:2])))
        first, second = (n for n in range(3) if n != self._axis)
        self._corners = np.zeros((4, 3))
        self._corners[[1, 2], first] = grid.spacing * grid.shape[first]
        self._corners[[2, 3], second] = grid.spacing * grid.shape[second]
        self._quad = pv.PolyData(self._corners, faces=[4, 0, 1, 2, 3])
        self._quad.active_texture_coordinates = np.array([[0.0, 0], [1, 0], [1, 1], [0, 1]])
        sides = np.array([grid.shape[first], grid.shape[second]])
        width, height = np.ceil(SLICE_PIXELS * sides / sides.max()).astype(int).tolist()
        self._pixels = (width, height)
        self._actor = plotter.add_mesh(
            self._quad, lighting=False, texture=pv.Texture(np.zeros((2, 2, 3), np.uint8))
        )

    def show(self, state: State, grid: Grid, focus: Array, toward: Array) -> None:
        """Show the slice of a state through `focus` (3,) m."""
        cell = (focus[self._axis] - grid.origin[self._axis]) / grid.spacing
        image = self._number.layer(state, self._axis, cell)
        small = Image.fromarray(np.ascontiguousarray(image.transpose(1, 0, 2)[::-1]))
        large = np.asarray(small.resize(self._pixels, Image.Resampling.BICUBIC))
        self._actor.texture = pv.Texture(large)
        corner = np.array(grid.origin)
        corner[self._axis] = focus[self._axis]
        self._quad.points = self._corners + corner
