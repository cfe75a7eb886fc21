"""Glowing smoke in space: a colour and a density of each cell, seen through."""

from __future__ import annotations

import numpy as np
import pyvista as pv
from numpy.typing import NDArray
from vtkmodules.vtkCommonDataModel import vtkPiecewiseFunction
from vtkmodules.vtkRenderingCore import vtkVolume, vtkVolumeProperty
from vtkmodules.vtkRenderingVolume import vtkGPUVolumeRayCastMapper

from flowborne.fluid.grid import Grid

Pixels = NDArray[np.uint8]

THICK = 0.05
"""Depth of full smoke that lets through a third of the light, in sides of the domain."""


class Smoke:
    """A cloud in a plotter."""

    def __init__(self, plotter: pv.Plotter, grid: Grid) -> None:
        h = grid.spacing
        self._image = pv.ImageData(
            dimensions=grid.shape, spacing=(h, h, h), origin=[x + 0.5 * h for x in grid.origin]
        )
        self._image.point_data["voxels"] = np.zeros((self._image.n_points, 4), np.uint8)
        mapper = vtkGPUVolumeRayCastMapper()
        mapper.SetInputData(self._image)
        mapper.SetAutoAdjustSampleDistances(False)
        mapper.SetSampleDistance(h)
        mapper.SetUseJittering(True)
        volume = vtkVolume()
        volume.SetMapper(mapper)
        volume.SetProperty(_property(THICK * h * max(grid.shape)))
        plotter.add_actor(volume, reset_camera=False, render=False)

    def show(self, voxels: Pixels) -> None:
        """Show (nx, ny, nz, 4) colours and densities."""
        self._image.point_data["voxels"][:] = voxels.transpose(2, 1, 0, 3).reshape(-1, 4)
        self._image.Modified()


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
