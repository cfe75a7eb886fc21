"""The fixed surroundings of the bodies: the ground with their shadow, or motes in the water."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import pyvista as pv
from PIL import Image, ImageDraw, ImageFilter
from scipy.spatial import ConvexHull, QhullError

from flowborne.kernels.arrays import Array, Pixels
from flowborne.view import style
from flowborne.view.framing import swept
from flowborne.view.glyphs import motes, round_number
from flowborne.view.run import Run

MAX_STANDING_GAP = 0.11
"""Maximum distance of the lowest point of standing bodies from z = 0, in heights of the bodies."""

FLOOR_RADIUS = 3.2
"""Distance from the focus at which the floor is faded out, in heights of the map."""

SQUARE = 0.6
"""Maximum side of a square, in heights of the map; the side is a round number of metres."""

SHADOW_PIXELS = 192
"""Side of the image of the shadow."""

SHADOW_OPACITY = 0.62
"""Share of the light that the shadow removes."""

MOTES = 1200
"""Number of motes within reach."""

MOTES_REACH = 1.1
"""Distance from the focus at which motes are faded out, in heights of the map."""


def stands_on_ground(run: Run) -> bool:
    """Whether the bodies stand on z = 0: gravity is downward or 0, and they come down to it."""
    if run.gravity[:2].any() or run.gravity[2] > 0.0 or not (run.geoms or run.flesh):
        return False
    heights = swept(run, range(len(run.geoms)))[..., 2]
    heights = heights[np.isfinite(heights).all(axis=1)]
    return (
        bool(heights.size)
        and abs(heights.min()) <= MAX_STANDING_GAP * np.ptp(heights, axis=1).max()
    )


class Ground:
    """The visible part of a floor at z = 0 in a plotter.

    height  m, of the view
    light   (3,) direction of the light, downward
    colour  background into which the floor fades, "#rrggbb"; None draws only the shadow
    """

    def __init__(
        self, plotter: pv.Plotter, height: float, light: Array, colour: str | None
    ) -> None:
        self._colour = colour
        self._slope = light[:2] / light[2]
        self._extent = 1.5 * height
        self._lift = 2e-3 * height
        self._radius = FLOOR_RADIUS * height
        self._side = round_number(SQUARE * height)
        floor = pv.Disc(inner=0.0, outer=self._radius, r_res=24, c_res=64)
        self._shade(floor, style.FLOOR, np.zeros(2))
        self._floor = _add(plotter, floor)
        self._squares = _squares(self._side, int(np.ceil(self._radius / self._side)))
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

        bodies  points (n, 3) of each convex part, m
        skin    (m, 3, 3) corners of the triangles of flesh, m
        """
        # the squares are fixed in the world, and fade around the focus
        corner = self._side * np.round(focus[:2] / self._side)
        self._shade(self._squares, style.SQUARES, focus[:2] - corner)
        self._floor.position = (*focus[:2], 0.0)
        self._lines.position = (*corner, 0.5 * self._lift)
        self._shadow.position = (*focus[:2], self._lift)
        self._shadow.texture = _texture(self._cast(focus[:2] - 0.5 * self._extent, bodies, skin))

    def _cast(self, corner: Array, bodies: Sequence[Array], skin: Array) -> Pixels:
        """(SHADOW_PIXELS, SHADOW_PIXELS) shadow of bodies and skin, lowest row first."""
        image = Image.new("L", (SHADOW_PIXELS, SHADOW_PIXELS))
        draw = ImageDraw.Draw(image)
        known = skin[np.isfinite(skin).all(axis=(1, 2))]
        outlines = [_hull(self._projected(points, corner)) for points in bodies]
        for outline in [*outlines, *self._projected(known, corner)]:
            if len(outline) > 2:
                draw.polygon([tuple(point) for point in outline.tolist()], fill=255)
        return np.asarray(image.filter(ImageFilter.GaussianBlur(1.6)))

    def _projected(self, points: Array, corner: Array) -> Array:
        """(..., 2) position of the shadows of points (..., 3) on the image, pixels."""
        height = np.maximum(points[..., 2:], 0.0)
        shadow = points[..., :2] - height * self._slope - corner
        return np.asarray(SHADOW_PIXELS * shadow / self._extent)

    def _shade(self, mesh: pv.PolyData, colour: str, centre: Array) -> None:
        """Colour a mesh so that it fades into the background away from a centre."""
        distance = np.linalg.norm(mesh.points[:, :2] - centre, axis=1, keepdims=True)
        share = np.clip(1.0 - distance / self._radius, 0.0, 1.0) ** 1.5
        mix = style.rgb(self._colour or style.WATER) * (1.0 - share) + style.rgb(colour) * share
        mesh.point_data["colour"] = style.to_bytes(mix)


def _add(plotter: pv.Plotter, mesh: pv.PolyData, **drawn: Any) -> pv.Actor:
    return plotter.add_mesh(mesh, scalars="colour", rgb=True, lighting=False, **drawn)


def _squares(side: float, count: int) -> pv.PolyData:
    """Lines along x and y at a distance `side`, `count` on each side of the origin, in segments."""
    ticks = side * np.arange(-count, count + 1.0)
    points = np.linspace(ticks[0], ticks[-1], 8 * count + 1)
    zero = np.zeros_like(points)
    lines = [np.column_stack([np.full_like(points, tick), points, zero]) for tick in ticks]
    lines += [line[:, [1, 0, 2]] for line in lines]
    return pv.merge([pv.lines_from_points(line) for line in lines])


def _hull(points: Array) -> Array:
    """(k, 2) corners of the convex hull of points in the plane; none if they have no area."""
    if len(points) < 3:
        return points[:0]
    try:
        return np.asarray(points[ConvexHull(points).vertices])
    except QhullError:
        return points[:0]


def _texture(shade: Pixels) -> pv.Texture:
    """Black with opacity `shade`, lowest row first."""
    pixels = np.zeros((*shade.shape, 4), np.uint8)
    pixels[..., 3] = SHADOW_OPACITY * shade[::-1]
    return pv.Texture(pixels)


def water_of(run: Run) -> tuple[Array, Array]:
    """Lower and upper corner (3,) m of the water; it is endless along axes on which its domain
    follows bodies, and where there is no fluid."""
    low, high = np.full(3, -np.inf), np.full(3, np.inf)
    if run.grid is not None:
        walled = [axis for axis in range(3) if axis not in run.window_axes]
        low[walled] = np.array(run.grid.origin)[walled]
        high[walled] = np.array(run.grid.upper)[walled]
    return low, high


class Motes:
    """Motes, points that are fixed in the water, in a plotter.

    height     m, of the view
    low, high  (3,) m, corners of the water
    """

    def __init__(self, plotter: pv.Plotter, height: float, low: Array, high: Array) -> None:
        self._reach, self._low, self._high = MOTES_REACH * height, low, high
        self._mesh = pv.PolyData(motes(MOTES, np.zeros(3), self._reach))
        self._mesh.point_data["colour"] = np.tile(
            style.to_bytes(np.append(style.rgb(style.MOTES), 1.0)), (MOTES, 1)
        )
        _add(plotter, self._mesh, style="points", point_size=3.0)

    def show(self, focus: Array, toward: Array) -> None:
        """Show the motes around `focus` (3,).

        Those in front of it, in the direction `toward` (3,) of the camera, are transparent.
        """
        points = motes(MOTES, focus, self._reach)
        offset = points - focus
        share = 1.0 - np.linalg.norm(offset, axis=1) / self._reach
        share = np.minimum(share, -(offset @ toward) / self._reach)
        share[((points < self._low) | (points > self._high)).any(axis=1)] = 0.0
        self._mesh.points = points
        self._mesh.point_data["colour"][:, 3] = style.to_bytes(np.clip(3.0 * share, 0.0, 1.0))
        self._mesh.Modified()
