"""Vortices in space: surfaces on which Q has one value, coloured by their sense of rotation."""

from __future__ import annotations

import numpy as np
import pyvista as pv
from numpy.typing import NDArray
from scipy.ndimage import zoom

from flowborne.fluid.grid import Grid
from flowborne.view import style
from flowborne.view.run import State
from flowborne.view.space.seen import SeenVortices
from flowborne.view.space.shapes import LIT

Array = NDArray[np.float64]

FINE = 4_000_000
"""Points up to which surfaces are found on a grid twice as fine, between which Q is cubic."""


class VortexSurfaces:
    """The surfaces of a state as meshes.

    fine  points up to which they are found on a grid twice as fine
    """

    def __init__(self, grid: Grid, seen: SeenVortices, fine: int = FINE) -> None:
        self._seen = seen
        self._finer = 2 if 8 * np.prod(grid.shape) <= fine else 1
        h = grid.spacing / self._finer
        self._image = pv.ImageData(
            dimensions=[self._finer * n for n in grid.shape],
            spacing=(h, h, h),
            origin=[x + 0.5 * h for x in grid.origin],
        )

    def of(self, state: State, toward: Array) -> pv.PolyData:
        """Triangles; their vertices have "sense" from -1, clockwise to a camera in the direction
        `toward` (3,), to 1."""
        for name, values, order in (
            ("q", self._seen.q(state), 3),
            ("sense", self._seen.sense(state, toward), 1),
        ):
            fine = values.astype(np.float32)
            if self._finer > 1:
                fine = zoom(fine, self._finer, order=order, grid_mode=True, mode="nearest")
            self._image.point_data[name] = fine.ravel(order="F")
        return self._image.contour([self._seen.level], scalars="q")


class Vortices:
    """The surfaces in a plotter."""

    def __init__(self, plotter: pv.Plotter, grid: Grid, seen: SeenVortices) -> None:
        self._surfaces = VortexSurfaces(grid, seen)
        self._plotter = plotter
        self._actor: pv.Actor | None = None

    def show(self, state: State, toward: Array) -> None:
        """Show the vortices of a state to a camera in the direction `toward` (3,)."""
        surface = self._surfaces.of(state, toward)
        if self._actor is not None:
            self._plotter.remove_actor(self._actor, render=False)
            self._actor = None
        if surface.n_points == 0:
            return
        share = 0.5 + 0.5 * np.clip(surface.point_data["sense"], -1.0, 1.0)[:, None]
        warm, cold = style.rgb(style.SPIN_LEFT[1]), style.rgb(style.SPIN_RIGHT[1])
        surface.point_data["colour"] = np.rint(255.0 * (cold + share * (warm - cold))).astype(
            np.uint8
        )
        self._actor = self._plotter.add_mesh(
            surface,
            scalars="colour",
            rgb=True,
            smooth_shading=True,
            reset_camera=False,
            render=False,
            **{key: value for key, value in LIT.items() if key != "interpolation"},
        )
