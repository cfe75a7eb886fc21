"""The surroundings of the bodies: light, background, ground, edges of the domain, and wind."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from flowborne.fluid.grid import Grid
from flowborne.kernels.arrays import Array
from flowborne.view import style
from flowborne.view.browser.meshes import add_mesh, repeated
from flowborne.view.browser.viewpoint import FilmView
from flowborne.view.glyphs import box_edges, camera_moves, crosses, motes, round_number
from flowborne.view.run import Run
from flowborne.view.space.arrows import TRIANGLES, arrows
from flowborne.view.space.lighting import LIGHTS
from flowborne.view.space.surroundings import SQUARE, stands_on_ground

if TYPE_CHECKING:
    from viser import SceneApi

MOTES = 20_000
"""Number of motes in a cube around the domain."""

MARKED_AGAIN = 0.05
"""Way of the domain after which the marks in it are chosen again, in its smaller sides."""

ABOVE_IMAGE = 1e-3
"""Height of lines above the image of a slab, in smaller sides of the view."""

WALLS = ("closed", "no-slip")
"""Kinds of sides that no fluid passes; the first one is the default."""

SCALE = 0.2
"""Largest length of the scale bar, in smaller sides of the view."""

LIGHT_RATIO = 3.0
"""Strength of a light in a browser over that in a film: browsers divide it by pi."""

ABOVE = ((0.25, 0.45, -1.0), 0.75, "#ffffff")
"""Direction, strength and colour of the light on a slab, which is seen from above."""


class Surroundings:
    """All in the scene that is neither fluid nor bodies, with the domain where it is.

    root  the frame that all is in, by which a view follows
    """

    def __init__(self, scene: SceneApi, run: Run, view: FilmView) -> None:
        self._scene, self._run, self._view = scene, run, view
        scene.set_up_direction(view.up)
        scene.set_background_image(
            np.broadcast_to(style.to_bytes(style.rgb(run.shot.colour)), (4, 4, 3)), format="png"
        )
        self.root = scene.add_frame("/run", show_axes=False)
        ground = not run.is_slab and stands_on_ground(run)
        _add_lights(scene, run.is_slab, ground)
        if ground:
            _add_ground(scene, view)
        self._domain = scene.add_frame("/run/domain", show_axes=False)
        if run.grid is not None:
            _add_edges(scene, run, run.grid, view)
        if run.is_slab and run.shot.scale_bar:
            _add_scale(scene, view)
        follows = bool(run.window_axes) or camera_moves(view.path, view.side)
        self._has_marks = run.grid is not None and not ground and follows
        self._marked: Array | None = None
        if run.grid is None:
            show_wind(scene, run.wind.sum(axis=0), view)
        self.show(np.zeros(3))

    def show(self, moved: Array) -> None:
        """Show the domain moved by (3,) m from its start; marks are fixed in the water."""
        self._domain.position = moved
        if not self._has_marks:
            return
        run, view = self._run, self._view
        grid = run.grid_at({})
        step = MARKED_AGAIN * min(grid.spacing * n for n in grid.shape[: len(grid.axes)])
        around = step * np.round(moved / step)
        if self._marked is None or not np.array_equal(around, self._marked):
            self._marked = around
            _add_marks(self._scene, around + grid.origin, around + grid.upper, view, run.is_slab)


def _add_lights(scene: SceneApi, slab: bool, shadows: bool) -> None:
    scene.configure_default_lights(False)
    scene.configure_environment_map(None)
    scene.add_light_ambient("/lights/ambient", intensity=0.75)
    for n, (direction, strength, colour) in enumerate([ABOVE] if slab else LIGHTS):
        red, green, blue = style.to_bytes(style.rgb(colour)).tolist()
        x, y, z = (-10.0 * np.array(direction)).tolist()
        scene.add_light_directional(
            f"/lights/{n}",
            color=(red, green, blue),
            intensity=LIGHT_RATIO * strength,
            cast_shadow=shadows and n == 0,
            position=(x, y, z),
        )


def _add_ground(scene: SceneApi, view: FilmView) -> None:
    """Add a floor with squares of a round number of metres that fades out."""
    square = round_number(SQUARE * view.side)
    scene.add_grid(
        "/run/ground",
        infinite_grid=True,
        cell_size=square,
        section_size=square,
        cell_color=style.rgb(style.SQUARES),
        section_color=style.rgb(style.SQUARES),
        fade_distance=8.0 * view.side,
        fade_strength=2.0,
        shadow_opacity=0.55,
        plane_color=style.rgb(style.FLOOR),
        plane_opacity=0.0,
        position=(0.0, 0.0, -1e-3 * view.side),
    )


def _add_marks(scene: SceneApi, low: Array, high: Array, view: FilmView, slab: bool) -> None:
    """Add marks that are fixed in the water between two corners, to show that the view moves."""
    if slab:
        strokes = crosses(low[:2], high[:2], view.side)
        above = ((0, 0), (0, 0), (0, 1))
        ends = np.pad(strokes, above, constant_values=ABOVE_IMAGE * view.side)
        _add_lines(scene, "/run/marks", ends, style.MOTES, 1.0)
        return
    reach = 0.5 * float((high - low).max())
    middle = 0.5 * (low + high)
    points = motes(MOTES, middle, reach)
    inside = points[((points > low) & (points < high)).all(axis=1)]
    scene.add_point_cloud(
        "/run/marks",
        inside.astype(np.float32),
        style.rgb(style.MOTES),
        point_size=0.004 * view.side,
    )


def _add_edges(scene: SceneApi, run: Run, grid: Grid, view: FilmView) -> None:
    """Add the edges of the domain; in a slab its walls are thicker than sides that fluid passes."""
    low, high = np.array(grid.origin), np.array(grid.upper)
    if not run.is_slab:
        _add_lines(scene, "/run/domain/edges", box_edges(low, high), style.LINE, 1.5)
        return
    walls: list[Array] = []
    others: list[Array] = []
    for axis, name in enumerate("xy"):
        for end, coordinate in (("min", low[axis]), ("max", high[axis])):
            given = run.tables.get("boundaries", {}).get(f"{name}_{end}", WALLS[0])
            kind = given if isinstance(given, str) else given["kind"]
            line = np.stack([low, high])
            line[:, axis], line[:, 2] = coordinate, ABOVE_IMAGE * view.side
            (walls if kind in WALLS else others).append(line)
    _add_lines(scene, "/run/domain/walls", np.reshape(walls, (-1, 2, 3)), style.FIXED, 4.0)
    _add_lines(scene, "/run/domain/open", np.reshape(others, (-1, 2, 3)), style.MOTES, 1.2)


def _add_scale(scene: SceneApi, view: FilmView) -> None:
    """Add a bar of a round length in the lower left corner of the first view of a slab."""
    length = round_number(SCALE * view.side)
    start = view.first.target - view.side * np.array([0.46, 0.46, -ABOVE_IMAGE])
    along, tick = np.array([length, 0.0, 0.0]), np.array([0.0, 0.012 * view.side, 0.0])
    end = start + along
    bar = np.array([(start, end), (start - tick, start + tick), (end - tick, end + tick)])
    _add_lines(scene, "/scale", bar, style.TEXT, 2.0)
    scene.add_label("/scale/length", f"{length:g} m", position=end + tick, anchor="bottom-left")


def _add_lines(scene: SceneApi, name: str, ends: Array, colour: str, pixels: float) -> None:
    """Add lines between `ends` (n, 2, 3), m."""
    scene.add_line_segments(
        name, ends.astype(np.float32), style.rgb(colour), thickness=pixels, thickness_units="screen"
    )


def show_wind(scene: SceneApi, wind: Array, view: FilmView) -> None:
    """Show a fixed arrow along a wind (3,), m/s, upwind of the camera's first target, with its
    speed; remove it without wind."""
    speed = float(np.linalg.norm(wind))
    if speed == 0.0:
        scene.remove_by_name("/wind")
        return
    vector = 0.17 * view.side * wind / speed
    tail = view.first.target - 0.54 * view.side * wind / speed
    mesh = repeated(arrows(tail[None], vector[None], 0.012 * view.side), TRIANGLES)
    colour = style.rgb(style.CURVES[1])
    add_mesh(scene, "/wind", mesh, color=colour, cast_shadow=False, receive_shadow=False)
    label_position = tail + 0.5 * vector + 0.04 * view.side * np.eye(3)["xyz".index(view.up[1])]
    scene.add_label("/wind/speed", f"wind {speed:.3g} m/s", position=label_position)
