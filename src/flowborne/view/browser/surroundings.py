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
    from viser import LineSegmentsHandle, SceneApi

MOTES = 20_000
"""Number of motes in a cube around the domain."""

MARKED_AGAIN = 0.05
"""Way of the domain after which the marks in it are chosen again, in its smaller sides."""

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
        self._edges: LineSegmentsHandle | None = None
        if run.grid is not None and not run.is_slab:
            self._edges = _add_edges(scene, run.grid)
        follows = bool(run.window_axes) or camera_moves(view.path, view.side)
        self._has_marks = run.grid is not None and not ground and follows
        self._marked: Array | None = None
        if run.grid is None:
            show_wind(scene, run.wind.sum(axis=0), view)
        self.show(np.zeros(3))

    def show(self, moved: Array) -> None:
        """Show the domain moved by (3,) m from its start; marks are fixed in the water."""
        if self._edges is not None:
            self._edges.position = moved
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
        above = 1e-3 * view.side
        scene.add_line_segments(
            "/run/marks",
            np.pad(strokes, ((0, 0), (0, 0), (0, 1)), constant_values=above).astype(np.float32),
            style.rgb(style.MOTES),
            thickness=1.0,
            thickness_units="screen",
        )
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


def _add_edges(scene: SceneApi, grid: Grid) -> LineSegmentsHandle:
    return scene.add_line_segments(
        "/run/domain",
        box_edges(np.array(grid.origin), np.array(grid.upper)).astype(np.float32),
        style.rgb(style.LINE),
        thickness=1.5,
        thickness_units="screen",
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
