"""A plane through the fluid: an image of its cells, and arrows of the velocity in it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from PIL import Image
from scipy.spatial.transform import Rotation

from flowborne.fluid.grid import Grid
from flowborne.runs.states import cell_velocity
from flowborne.view import style
from flowborne.view.arrows import arrow
from flowborne.view.browser.nodes import show_mesh
from flowborne.view.browser.prism import Mesh, joined, nothing
from flowborne.view.run import State

if TYPE_CHECKING:
    from viser import SceneApi

Array = NDArray[np.float64]
Pixels = NDArray[np.uint8]

SHARP = 768
"""Longer side of the image that is sent, pixels."""

ARROWS = 28
"""Arrows along the longer side of the plane."""

SLOWEST = 0.04
"""Shares of the highest speed below which there is no arrow."""


APART = 0.05
"""Distance of the arrows from the image, in distances between them."""


class Layer:
    """The plane in the scene."""

    def __init__(self, scene: SceneApi, grid: Grid) -> None:
        self._scene, self._grid = scene, grid

    def show_image(self, image: Pixels, axis: int, place: float) -> None:
        """Show colours (n, m, 3) of the cells of a plane across an axis, at `place` m on it.

        Rows are along the later of the other two axes, columns along the earlier one.
        """
        first, second = across(axis)
        low, high = np.array(self._grid.origin), np.array(self._grid.upper)
        centre = 0.5 * (low + high)
        centre[axis] = place
        frame = np.eye(3)[[first, second]]
        turn = np.column_stack([*frame, np.cross(*frame)])
        self._scene.add_image(
            "/run/slice",
            enlarged(image),
            float(high[first] - low[first]),
            float(high[second] - low[second]),
            format="jpeg",
            jpeg_quality=90,
            cast_shadow=False,
            receive_shadow=False,
            wxyz=Rotation.from_matrix(turn).as_quat(scalar_first=True),
            position=centre,
        )

    def hide_image(self) -> None:
        self._scene.remove_by_name("/run/slice")

    def show_velocity(
        self, state: State, axis: int, place: float, speed: float, wanted: bool
    ) -> None:
        """Show arrows of the velocity in the plane; one of `speed` m/s reaches the next arrow."""
        mesh = velocity_arrows(self._grid, state, axis, place, speed) if wanted else nothing()
        show_mesh(
            self._scene,
            "/run/velocity",
            mesh,
            color=style.rgb(style.TEXT),
            opacity=0.85,
            side="double",
            cast_shadow=False,
            receive_shadow=False,
        )


def across(axis: int) -> tuple[int, int]:
    """The other two axes."""
    first, second = (n for n in range(3) if n != axis)
    return first, second


def velocity_arrows(grid: Grid, state: State, axis: int, place: float, speed: float) -> Mesh:
    """Flat arrows of the velocity of the fluid in a plane across an axis, at `place` m on it.

    speed  m/s, of the arrow that reaches the next one; faster ones are as long
    """
    sides = across(axis)
    shape = [grid.shape[side] for side in sides]
    stride = max(1, round(max(shape) / ARROWS))
    picked = [np.arange(stride // 2, count, stride) for count in shape]
    layer = int(np.clip((place - grid.origin[axis]) / grid.spacing, 0, grid.shape[axis] - 1))
    at = np.ix_(*(picked[sides.index(n)] if n in sides else [layer] for n in range(3)))
    velocity = cell_velocity(grid, state)[at][..., list(sides)].reshape(-1, 2).astype(float)
    free = (state["open"][at] > 0.5).ravel() & np.isfinite(velocity).all(axis=1)
    share = np.linalg.norm(velocity, axis=1) / speed
    spacing = stride * grid.spacing
    i, j = (index.ravel() for index in np.meshgrid(*picked, indexing="ij"))
    middle = np.array([grid.origin[side] for side in sides])
    middle = middle + grid.spacing * (np.stack([i, j], axis=1) + 0.5)
    meshes = []
    for n in np.flatnonzero(free & (share > SLOWEST)):
        vector = spacing / speed / max(1.0, share[n]) * velocity[n]
        corners = arrow(middle[n] - 0.5 * vector, vector, 0.09 * spacing)
        # on both sides of the image
        for side in (-APART, APART):
            points = np.empty((7, 3))
            points[:, list(sides)], points[:, axis] = corners, place + side * spacing
            meshes.append((points, ARROW))
    return joined(meshes)


def enlarged(image: Pixels) -> Pixels:
    """An image (n, m, 3), smoothly enlarged until its longer side has SHARP pixels."""
    height, width = image.shape[:2]
    scale = SHARP / max(height, width)
    if scale <= 1.0:
        return image
    small = Image.fromarray(np.ascontiguousarray(image))
    size = (max(1, round(scale * width)), max(1, round(scale * height)))
    large = np.asarray(small.resize(size, Image.Resampling.BICUBIC))
    # a cubic swings below its knots, which would show as dark seams
    return np.maximum(large, image.min(axis=(0, 1)))


ARROW = np.array([[0, 6, 1], [6, 5, 1], [2, 4, 3]])
"""Triangles of the corners of a flat arrow."""
