"""Lit smoke in space: a colour and a density of each cell, with light and shadow in it."""

from __future__ import annotations

import numpy as np
import pyvista as pv
from numpy.typing import NDArray
from scipy.ndimage import zoom
from vtkmodules.vtkCommonDataModel import vtkPiecewiseFunction
from vtkmodules.vtkRenderingCore import vtkVolume, vtkVolumeProperty
from vtkmodules.vtkRenderingVolume import vtkGPUVolumeRayCastMapper

from flowborne.fluid.grid import Grid
from flowborne.view.run import State
from flowborne.view.space.lighting import scattered
from flowborne.view.space.seen import SeenDye

Array = NDArray[np.float64]
Pixels = NDArray[np.uint8]

THICK = 0.016
"""Depth of full smoke that lets through a third of the light, in heights of the picture, or in
sides of a smaller domain."""

CELLS = 0.8
"""The same in cells at least: what is thinner has steps in it."""

FAINT, FULL = 0.06, 0.5
"""Densities below which smoke is not seen, and from which on it is full."""

FINE = 1_500_000
"""Voxels up to which smoke is drawn on a grid twice as fine."""


class Smoke:
    """A cloud in a plotter."""

    def __init__(self, plotter: pv.Plotter, grid: Grid, dye: SeenDye, height: float) -> None:
        """`height`: m, of what is seen."""
        self._grid, self._dye = grid, dye
        self._depth = max(THICK * min(max(grid.shape), height / grid.spacing), CELLS)
        self._mapper = vtkGPUVolumeRayCastMapper()
        self._mapper.SetAutoAdjustSampleDistances(False)
        self._mapper.SetUseJittering(True)
        self._volume = vtkVolume()
        self._volume.SetMapper(self._mapper)
        self._volume.SetProperty(_property(self._depth * grid.spacing))
        self._added = False
        self._plotter = plotter

    def show(self, state: State, toward: Array) -> None:
        """Show the smoke of a state to a camera in the direction `toward` (3,)."""
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
        finer = 2 if 8 * size <= FINE else 1
        lit = np.clip(colour[part] * light[part], 0.0, 1.0)
        voxels = _voxels(lit, share[part], finer)
        h = self._grid.spacing / finer
        image = pv.ImageData(
            dimensions=voxels.shape[:3],
            spacing=(h, h, h),
            origin=np.array(self._grid.origin) + first * self._grid.spacing + 0.5 * h,
        )
        image.point_data["voxels"] = voxels.transpose(2, 1, 0, 3).reshape(-1, 4)
        self._mapper.SetInputData(image)
        self._mapper.SetSampleDistance(h)
        if not self._added:
            self._plotter.add_actor(self._volume, reset_camera=False, render=False)
            self._added = True


def _voxels(colour: NDArray[np.float32], share: NDArray[np.float32], finer: int) -> Pixels:
    """Colours (nx, ny, nz, 3) and shares of full density (nx, ny, nz) as bytes (..., 4).

    The shares are drawn through by cubics before they are sharpened to densities, so that an edge
    is as smooth as the smoke is, and not as its cells are.
    """
    if finer > 1:
        how = {"grid_mode": True, "mode": "nearest"}
        share = np.clip(zoom(share, finer, order=3, **how), 0.0, 1.0)
        colour = zoom(colour, (finer, finer, finer, 1), order=1, **how)
    density = share * share * (3.0 - 2.0 * share)
    return np.rint(255.0 * np.concatenate([colour, density[..., None]], axis=-1)).astype(np.uint8)


def _property(depth: float) -> vtkVolumeProperty:
    """Voxels with a colour of their own, of which `depth` m at full density let through 1/e."""
    wanted = vtkVolumeProperty()
    wanted.IndependentComponentsOff()
    wanted.ShadeOff()
    wanted.SetInterpolationTypeToLinear()
    opacity = vtkPiecewiseFunction()
    opacity.AddPoint(0.0, 0.0)
    opacity.AddPoint(255.0, 1.0 - np.exp(-1.0))
    wanted.SetScalarOpacity(opacity)
    wanted.SetScalarOpacityUnitDistance(depth)
    return wanted
