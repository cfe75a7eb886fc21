"""What stands before the camera: lights, bodies, forces, ground, and wind or smoke."""

from __future__ import annotations

import numpy as np
import pyvista as pv
from numpy.typing import NDArray

from flowborne.fluid.grid import Grid
from flowborne.view import style
from flowborne.view.forces import SHAFT, Forces
from flowborne.view.run import Geom, Run, State
from flowborne.view.space.arrows import Arrows
from flowborne.view.space.camera import OPENING, TOWARD, UP, Camera
from flowborne.view.space.clouds import Cloud
from flowborne.view.space.flesh import FleshSurface
from flowborne.view.space.ground import Ground, stands
from flowborne.view.space.shapes import LIT, mesh_of
from flowborne.view.space.skin import Skin
from flowborne.view.space.smoke import Smoke
from flowborne.view.space.wind import WindArrows

Array = NDArray[np.float64]
Pixels = NDArray[np.uint8]

KEY = (0.1, 0.75, -1.25)
"""Direction in which the strongest light travels, and shadows fall."""

LIGHTS = (
    (KEY, 0.8, "#fff6e8"),
    ((-0.85, 0.45, -0.3), 0.42, "#cfe2ff"),
    ((0.5, -0.85, -0.7), 0.4, "#8fc2ff"),
)
"""Direction, strength and colour of the lights: from above the camera, its right, and behind."""

SMOOTH = 8
"""Samples of a pixel on the edges of what is drawn."""

UNCOLOURED = (0.5, 0.5, 0.5, 1.0)
"""Colour of a geometry to which the model gives none."""


class Stage:
    """Scene of a run in a plotter, which it takes over.

    pixel  m, size of a pixel of the film
    bones  whether flesh is seen through, to the bones in it
    """

    def __init__(
        self,
        plotter: pv.Plotter,
        run: Run,
        camera: Camera,
        forces: Forces,
        cloud: Cloud | None,
        pixel: float,
        bones: bool,
    ) -> None:
        self._plotter, self._camera, self._forces, self._cloud = plotter, camera, forces, cloud
        self._pixel = pixel
        _light(plotter)
        meshes = [mesh_of(geom) for geom in run.geoms]
        self._points = [np.asarray(mesh.points, float) for mesh in meshes]
        self._bodies = [
            _add_body(plotter, mesh, geom, run.accented)
            for mesh, geom in zip(meshes, run.geoms, strict=True)
        ]
        self._hidden = [geom.covered and not bones for geom in run.geoms]
        self._flesh = None
        if run.flesh is not None:
            first = run.state(0)["flesh_vertices"]
            self._flesh = FleshSurface(plotter, run.flesh, first, seen_through=bones)
        self._skin = Skin(run.geoms, meshes, run.flesh)
        self._arrows = Arrows(plotter, max(len(run.bodies), 1), style.FORCE, 0.35)
        self._ground = self._wind = self._smoke = None
        if stands(run):
            self._ground = Ground(plotter, camera.height, np.array(KEY))
        if run.grid is not None:
            plotter.add_mesh(_edges(run.grid), color=style.LINE, line_width=1.2, lighting=False)
        elif run.wind.any():
            self._wind = WindArrows(plotter, run, camera, 0.0 if self._ground else -np.inf)
        if cloud is not None and run.grid is not None:
            self._smoke = Smoke(plotter, run.grid)

    def image(self, number: int, state: State) -> Pixels:
        """(height, width, 3) picture of the `number`-th state, lowest row first."""
        focus = self._camera.focus[number]
        centres, turns = state["geom_position"].astype(float), state["geom_rotation"].astype(float)
        for actor, hidden, *pose in zip(self._bodies, self._hidden, centres, turns, strict=True):
            _place(actor, *pose, hidden=hidden)
        corners = np.zeros((0, 3, 3))
        if self._flesh is not None:
            vertices = state["flesh_vertices"].astype(float)
            self._flesh.show(vertices)
            corners = vertices[self._flesh.triangles]
        if self._ground is not None:
            self._ground.show(focus, self._placed(centres, turns), corners)
        if self._wind is not None:
            self._wind.show(number, float(state["time"]))
        if self._smoke is not None and self._cloud is not None:
            self._smoke.show(self._cloud.voxels(state))
        self._arrows.show(*self._pushes(state), SHAFT * self._pixel)
        return self._render(focus)

    def close(self) -> None:
        self._plotter.close()

    def _render(self, focus: Array) -> Pixels:
        view = self._plotter.camera
        view.focal_point = focus
        view.position = focus + self._camera.distance * TOWARD
        view.up = UP
        view.view_angle = np.degrees(OPENING)
        self._plotter.renderer.ResetCameraClippingRange()
        # a screenshot renders the first time alone
        self._plotter.render()
        return np.asarray(self._plotter.screenshot(return_img=True))[::-1]

    def _pushes(self, state: State) -> tuple[Array, Array]:
        """Tails, on the bodies' surfaces, and vectors (n, 3) of the arrows of forces, m."""
        arrows = self._forces.arrows(state, self._pixel)
        tails = [
            tail + self._skin.reach(body, tail, vector, state) * vector / np.linalg.norm(vector)
            for body, tail, vector in arrows
        ]
        vectors = [vector for *_, vector in arrows]
        return np.reshape(tails, (-1, 3)), np.reshape(vectors, (-1, 3))

    def _placed(self, centres: Array, turns: Array) -> list[Array]:
        """(n, 3) points in the world of each geometry whose place is known."""
        placed = [
            centre + points @ turn.T
            for centre, turn, points in zip(centres, turns, self._points, strict=True)
        ]
        return [points for points in placed if np.isfinite(points).all()]


def _light(plotter: pv.Plotter) -> None:
    plotter.set_background(style.WATER)
    plotter.enable_anti_aliasing("msaa", multi_samples=SMOOTH)
    for direction, strength, colour in LIGHTS:
        light = pv.Light(color=colour, intensity=strength, light_type="scene light")
        light.position, light.focal_point = -np.array(direction), (0.0, 0.0, 0.0)
        plotter.add_light(light)


def _add_body(
    plotter: pv.Plotter, mesh: pv.PolyData, geom: Geom, accented: frozenset[int]
) -> pv.Actor:
    """Add a geometry, in the model's own colour unless it stands fixed or is accented."""
    own = tuple(np.round(geom.rgba, 6))
    plain = own == UNCOLOURED or geom.body == 0 or geom.body in accented
    return plotter.add_mesh(
        mesh,
        color=style.body_colour(geom.body, accented) if plain else own[:3],
        opacity=float(geom.rgba[3]),
        **LIT,
    )


def _place(actor: pv.Actor, centre: Array, turn: Array, *, hidden: bool) -> None:
    """Move a body; one whose numbers are lost is not seen."""
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = turn, centre
    actor.visibility = not hidden and bool(np.isfinite(matrix).all())
    if actor.visibility:
        actor.user_matrix = matrix


def _edges(grid: Grid) -> pv.PolyData:
    """The edges of the fluid's domain but those before it, which meet in the corner nearest by."""
    limits = np.array([grid.origin, grid.upper])
    near = np.where(TOWARD > 0.0, limits[1], limits[0])
    box = pv.Box(limits.T.ravel()).extract_all_edges()
    ends = box.points[box.lines.reshape(-1, 3)[:, 1:]]
    hidden = np.isclose(ends, near.astype(np.float32)).all(axis=-1).any(axis=-1)
    return pv.line_segments_from_points(ends[~hidden].reshape(-1, 3))
