"""The map of a picture of a run in space: lights, bodies, forces, ground, and wind or fluid."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pyvista as pv
from matplotlib.artist import Artist
from matplotlib.axes import Axes

from flowborne.fluid.grid import Grid
from flowborne.kernels.arrays import Array, Pixels
from flowborne.view import style
from flowborne.view.fields import FieldDye, FieldNumber, FieldVortices, Legend, Scale, field_of
from flowborne.view.framing import through_window, window_path
from flowborne.view.glyphs import SHAFT_WIDTH, Forces, box_edges, camera_moves
from flowborne.view.maps import MapImage
from flowborne.view.run import Run, State
from flowborne.view.shot import Shot
from flowborne.view.space.arrows import Arrows, WindArrows
from flowborne.view.space.camera import camera_of
from flowborne.view.space.fluid import Slice, Smoke, Vortices
from flowborne.view.space.lighting import KEY, LIGHTS
from flowborne.view.space.opengl import off_screen
from flowborne.view.space.surfaces import (
    LIT,
    Outside,
    SkinSurface,
    colour_of,
    force_arrows,
    mesh_of,
)
from flowborne.view.space.surroundings import Ground, Motes, stands_on_ground, water_of


class MapSpace:
    """Map of a run in space, drawn by VTK.

    camera  of all frames
    width   m across the map, at the bodies
    aspect  height over width
    forces  the scale of the arrows of forces
    """

    def __init__(self, run: Run, shot: Shot, aspect: float | None = None) -> None:
        """`aspect`: required height over width of the map, if any."""
        self._run, self._shot = run, shot
        self.camera = camera_of(run, shot, aspect)
        self.width, self.aspect = self.camera.width, self.camera.aspect
        self.forces = Forces(run, min(self.camera.width, self.camera.height))
        self._field = field_of(run, shot)
        self.legend: Legend = () if self._field is None else self._field.legend
        self.scale: Scale | None = None if self._field is None else self._field.scale
        self._plotter: pv.Plotter | None = None

    def draw_on(self, axes: Axes, pixels: int) -> Sequence[Artist]:
        """Set the stage; returns the artist of its image in `axes`, `pixels` wide at scale 1.

        raises  ValueError if three dimensions cannot be drawn on this machine
        """
        run, shot, camera, field = self._run, self._shot, self.camera, self._field
        self._image = MapImage(axes)
        self._plotter = plotter = off_screen(*self._image.pixels)
        self._pixel = self.width / pixels
        _light(plotter)
        meshes = [mesh_of(geom) for geom in run.geoms]
        self._points = [np.asarray(mesh.points, float) for mesh in meshes]
        self._bodies = []
        for mesh, geom in zip(meshes, run.geoms, strict=True):
            colour, opacity = colour_of(geom, run.accented)
            self._bodies.append(plotter.add_mesh(mesh, color=tuple(colour), opacity=opacity, **LIT))
        self._hidden = [geom.covered and not shot.bones for geom in run.geoms]
        first = run.state(0)
        self._skins = [
            SkinSurface(plotter, skin, first, seen_through=shot.bones) for skin in run.skins
        ]
        self._outside = Outside(run.geoms, run.skins)
        self._arrows = Arrows(plotter, max(len(run.bodies), 1), style.FORCE, 0.35)
        self._ground = self._wind = self._motes = None
        if stands_on_ground(run):
            behind = None if shot.transparent else shot.colour
            self._ground = Ground(plotter, camera.height, np.array(KEY), behind)
        elif camera_moves(camera.focus, camera.height) and not shot.transparent:
            self._motes = Motes(plotter, camera.height, *water_of(run))
        self._edges: list[tuple[Array, pv.Actor]] = []
        if run.grid is not None:
            self._edges, self._path = _edges(plotter, run.grid), window_path(run)
        elif run.wind.any():
            self._wind = WindArrows(plotter, run, camera, 0.0 if self._ground else -np.inf)
        self._fluid: Smoke | Vortices | Slice | None = None
        if run.grid is not None and field is not None:
            self._through = through_window(run, camera.focus)
            if isinstance(field, FieldDye):
                self._fluid = Smoke(plotter, run.grid, field, camera.height)
            elif isinstance(field, FieldNumber):
                self._fluid = Slice(plotter, run.grid, field, camera.axes(0)[2])
            elif isinstance(field, FieldVortices):
                self._fluid = Vortices(plotter, field)
        return [self._image]

    def show(self, number: int, state: State) -> None:
        """Update the image to the `number`-th state."""
        focus, toward = self.camera.focus[number], self.camera.axes(number)[2]
        positions = state["geom_position"].astype(float)
        rotations = state["geom_rotation"].astype(float)
        poses = zip(self._bodies, self._hidden, positions, rotations, strict=True)
        for actor, hidden, position, rotation in poses:
            _place(actor, position, rotation, hidden=hidden)
        corners = np.concatenate(
            [np.zeros((0, 3, 3)), *(surface.show(state) for surface in self._skins)]
        )
        if self._ground is not None:
            self._ground.show(focus, self._placed(positions, rotations), corners)
        if self._motes is not None:
            self._motes.show(focus, toward)
        if self._wind is not None:
            self._wind.show(number, float(state["time"]))
        if self._fluid is not None:
            self._fluid.show(state, self._run.grid_at(state), self._through[number], toward)
        for facing, edge in self._edges:
            edge.position = self._path[number]
            edge.visibility = bool((facing @ toward < 0.0).any())
        shown = force_arrows(self.forces, self._outside, state, self._pixel)
        self._arrows.show(*shown, SHAFT_WIDTH * self._pixel)
        assert self._plotter is not None
        view = self._plotter.camera
        view.focal_point = focus
        view.position = focus + self.camera.away[number]
        view.up = self.camera.axes(number)[1]
        view.view_angle = np.degrees(self.camera.lens)
        self._plotter.renderer.ResetCameraClippingRange()
        clear = self._shot.transparent
        self._image.image = self._cut_out() if clear else self._render(self._shot.colour)

    def close(self) -> None:
        """Close VTK's window; nothing can be drawn afterwards."""
        if self._plotter is not None:
            self._plotter.close()

    def _render(self, background: str) -> Pixels:
        """(height, width, 3) image with a background, lowest row first."""
        assert self._plotter is not None
        self._plotter.set_background(background)
        # a screenshot renders only the first time
        self._plotter.render()
        return np.asarray(self._plotter.screenshot(return_img=True))[::-1]

    def _cut_out(self) -> Pixels:
        """(height, width, 4) image with opacity, from images on black and on white."""
        black, white = (self._render(colour).astype(float) for colour in ("#000000", "#ffffff"))
        opacity = 1.0 - np.clip((white - black).mean(axis=-1, keepdims=True) / 255.0, 0.0, 1.0)
        colour = np.clip(black / np.maximum(opacity, 1.0 / 255.0), 0.0, 255.0)
        return np.rint(np.concatenate([colour, 255.0 * opacity], axis=-1)).astype(np.uint8)

    def _placed(self, positions: Array, rotations: Array) -> list[Array]:
        """(n, 3) points in the world of each geometry with a finite pose."""
        placed = [
            position + points @ rotation.T
            for position, rotation, points in zip(positions, rotations, self._points, strict=True)
        ]
        return [points for points in placed if np.isfinite(points).all()]


def _light(plotter: pv.Plotter) -> None:
    plotter.enable_anti_aliasing("msaa", multi_samples=8)
    for direction, strength, colour in LIGHTS:
        light = pv.Light(color=colour, intensity=strength, light_type="scene light")
        light.position, light.focal_point = -np.array(direction), (0.0, 0.0, 0.0)
        plotter.add_light(light)


def _place(actor: pv.Actor, position: Array, rotation: Array, *, hidden: bool) -> None:
    """Move a body; hide it if its pose is not finite."""
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = rotation, position
    actor.visibility = not hidden and bool(np.isfinite(matrix).all())
    if actor.visibility:
        actor.user_matrix = matrix


def _edges(plotter: pv.Plotter, grid: Grid) -> list[tuple[Array, pv.Actor]]:
    """The edges of the fluid's domain, each with the outward normals (2, 3) of its two faces.

    An edge between two faces towards the camera is in front of the fluid, and is hidden.
    """
    low, high = np.array(grid.origin), np.array(grid.upper)
    edges = []
    for ends in box_edges(low, high):
        facing = np.diag(np.sign(ends.mean(axis=0) - 0.5 * (low + high)))
        line = pv.line_segments_from_points(ends)
        actor = plotter.add_mesh(line, color=style.LINE, line_width=1.2, lighting=False)
        edges.append((facing[facing.any(axis=1)], actor))
    return edges
