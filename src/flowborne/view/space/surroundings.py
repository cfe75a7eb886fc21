"""What is fixed around the bodies: the ground with their shadow, or motes in the water."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pyvista as pv
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFilter
from scipy.spatial import ConvexHull, QhullError

from flowborne.fluid.grid import Grid
from flowborne.view import style
from flowborne.view.framing import swept
from flowborne.view.glyphs import motes, round_number
from flowborne.view.run import Run

Array = NDArray[np.float64]

NEAR = 0.11
"""The lowest place of bodies that stand on z = 0 is as near to it, in heights of the bodies."""

SEEN = 3.2
"""Distance from the focus at which the floor has faded away, in heights of the map."""

SQUARE = 0.6
"""Largest side of a square, in heights of the map; the side is a round number of metres."""

PIXELS = 192
"""Sides of the image of the shadow."""

BLUR = 1.6
"""Softness of the shadow's edge, pixels of its image."""

DARK = 0.62
"""How much of the light the shadow takes away."""


def stands(run: Run) -> bool:
    """Whether the bodies stand on z = 0: nothing pulls them elsewhere, and they come down to it."""
    if run.gravity[:2].any() or run.gravity[2] > 0.0 or not (run.geoms or run.flesh):
        return False
    heights = swept(run, range(len(run.geoms)))[..., 2]
    heights = heights[np.isfinite(heights).all(axis=1)]
    return bool(heights.size) and abs(heights.min()) <= NEAR * np.ptp(heights, axis=1).max()


class Ground:
    """Floor at z = 0 in a plotter, as much of it as is seen.

    height  m, of what is seen
    light   (3,) direction in which light travels, down
    colour  "#rrggbb" of what the floor fades into; None where that is nothing, and of the ground
            the shadow alone is seen
    """

    def __init__(
        self, plotter: pv.Plotter, height: float, light: Array, colour: str | None
    ) -> None:
        self._colour = colour
        self._slope = light[:2] / light[2]
        self._extent = 1.5 * height
        self._lift = 2e-3 * height
        self._seen = SEEN * height
        self._side = round_number(SQUARE * height)
        floor = pv.Disc(inner=0.0, outer=self._seen, r_res=24, c_res=64)
        self._shade(floor, style.FLOOR, np.zeros(2))
        self._floor = _add(plotter, floor)
        self._squares = _squares(self._side, int(np.ceil(self._seen / self._side)))
        self._shade(self._squares, style.SQUARES, np.zeros(2))
        self._lines = _add(plotter, self._squares, line_width=1.5)
        self._floor.visibility = self._lines.visibility = colour is not None
        self._shadow = plotter.add_mesh(
            pv.Plane(i_size=self._extent, j_size=self._extent, i_resolution=1, j_resolution=1),
            lighting=False,
            texture=_texture(np.zeros((2, 2), np.uint8)),
        )

    def show(self, focus: Array, bodies: Sequence[Array], skin: Array) -> None:
        """Show the floor around `focus` (3,) with the shadow of bodies and flesh.

        bodies  points (n, 3) of each convex part of them, m
        skin    (m, 3, 3) corners of the triangles of flesh, m
        """
        # the squares stay where they are in the world, and fade around the focus
        whole = self._side * np.round(focus[:2] / self._side)
        self._shade(self._squares, style.SQUARES, focus[:2] - whole)
        self._floor.position = (*focus[:2], 0.0)
        self._lines.position = (*whole, 0.5 * self._lift)
        self._shadow.position = (*focus[:2], self._lift)
        self._shadow.texture = _texture(self._cast(focus[:2] - 0.5 * self._extent, bodies, skin))

    def _cast(self, corner: Array, bodies: Sequence[Array], skin: Array) -> NDArray[np.uint8]:
        """(PIXELS, PIXELS) where bodies and skin keep light from the floor, lowest row first."""
        image = Image.new("L", (PIXELS, PIXELS))
        draw = ImageDraw.Draw(image)
        known = skin[np.isfinite(skin).all(axis=(1, 2))]
        outlines = [_hull(self._fallen(points, corner)) for points in bodies]
        for outline in [*outlines, *self._fallen(known, corner)]:
            if len(outline) > 2:
                draw.polygon([tuple(place) for place in outline.tolist()], fill=255)
        return np.asarray(image.filter(ImageFilter.GaussianBlur(BLUR)))

    def _fallen(self, points: Array, corner: Array) -> Array:
        """(..., 2) where on the image the shadows of points (..., 3) fall."""
        height = np.maximum(points[..., 2:], 0.0)
        fallen = points[..., :2] - height * self._slope - corner
        return np.asarray(PIXELS * fallen / self._extent)

    def _shade(self, mesh: pv.PolyData, colour: str, centre: Array) -> None:
        """Give a mesh a colour that fades into the background away from a centre."""
        away = np.linalg.norm(mesh.points[:, :2] - centre, axis=1, keepdims=True)
        share = np.clip(1.0 - away / self._seen, 0.0, 1.0) ** 1.5
        mix = style.rgb(self._colour or style.WATER) * (1.0 - share) + style.rgb(colour) * share
        mesh.point_data["colour"] = np.rint(255.0 * mix).astype(np.uint8)


def _add(plotter: pv.Plotter, mesh: pv.PolyData, **drawn: float) -> pv.Actor:
    return plotter.add_mesh(mesh, scalars="colour", rgb=True, lighting=False, **drawn)


def _squares(side: float, count: int) -> pv.PolyData:
    """Lines along x and y, `side` apart and `count` each way from the origin, of short pieces."""
    ticks = side * np.arange(-count, count + 1.0)
    pieces = np.linspace(ticks[0], ticks[-1], 8 * count + 1)
    nothing = np.zeros_like(pieces)
    lines = [np.column_stack([np.full_like(pieces, tick), pieces, nothing]) for tick in ticks]
    lines += [line[:, [1, 0, 2]] for line in lines]
    return pv.merge([pv.lines_from_points(line) for line in lines])


def _hull(points: Array) -> Array:
    """(k, 2) places of the convex hull of points in the plane; none when they have no area."""
    if len(points) < 3:
        return points[:0]
    try:
        return np.asarray(points[ConvexHull(points).vertices])
    except QhullError:
        return points[:0]


def _texture(shade: NDArray[np.uint8]) -> pv.Texture:
    """Black, as opaque as `shade` (lowest row first) says."""
    pixels = np.zeros((*shade.shape, 4), np.uint8)
    pixels[..., 3] = DARK * shade[::-1]
    return pv.Texture(pixels)


COUNT = 1200
"""Points within reach."""

REACH = 1.1
"""Distance from the focus at which they have faded away, in heights of the map."""

SIZE = 3.0
"""Pixels."""


class Motes:
    """The points in a plotter.

    height  m, of what is seen
    grid    of the fluid in which they are; None for all of space
    """

    def __init__(self, plotter: pv.Plotter, height: float, grid: Grid | None) -> None:
        self._reach, self._grid = REACH * height, grid
        self._mesh = pv.PolyData(motes(COUNT, np.zeros(3), self._reach))
        self._mesh.point_data["colour"] = np.tile(
            np.append(np.rint(255.0 * style.rgb(style.MOTES)), 255.0).astype(np.uint8), (COUNT, 1)
        )
        plotter.add_mesh(
            self._mesh, style="points", point_size=SIZE, scalars="colour", rgb=True, lighting=False
        )

    def show(self, focus: Array, toward: Array) -> None:
        """Show those around `focus` (3,), of which those before it, in the direction `toward` (3,)
        of the camera, are clear."""
        points = motes(COUNT, focus, self._reach)
        away = points - focus
        share = 1.0 - np.linalg.norm(away, axis=1) / self._reach
        share = np.minimum(share, -(away @ toward) / self._reach)
        if self._grid is not None:
            low, high = np.array(self._grid.origin), np.array(self._grid.upper)
            share[((points < low) | (points > high)).any(axis=1)] = 0.0
        self._mesh.points = points
        self._mesh.point_data["colour"][:, 3] = np.rint(
            255.0 * np.clip(3.0 * share, 0.0, 1.0)
        ).astype(np.uint8)
        self._mesh.Modified()
