"""Bodies, flesh, and the forces on them, as meshes in the scene."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from flowborne.view import style
from flowborne.view.browser.meshes import Mesh, counter_clockwise, joined, nothing, prism, show_mesh
from flowborne.view.glyphs import SHAFT_WIDTH, Forces, arrow
from flowborne.view.outlines import Outlines, flesh_loops
from flowborne.view.run import Run, Skin, State
from flowborne.view.space.arrows import arrow_mesh
from flowborne.view.space.surfaces import Outside, colour_of, creased, mesh_of, pushes

if TYPE_CHECKING:
    from viser import MeshHandle, SceneApi

Array = NDArray[np.float64]

THICK = 0.02
"""Thickness of what is drawn of a slab, in smaller sides of what is seen."""

PIXELS = 700.0
"""About how many a browser shows across the smaller side of what is seen."""


class Bodies:
    """The geometries, each a mesh in its own frame that is placed anew for every state.

    meshes  of each geometry
    """

    def __init__(self, scene: SceneApi, run: Run, side: float) -> None:
        """`side`: m, smaller side of what is seen."""
        self._covered = [geom.covered for geom in run.geoms]
        self.meshes: list[MeshHandle] = []
        for n, (vertices, faces) in enumerate(_surfaces(run, side)):
            colour, opacity = colour_of(run.geoms[n], run.accented)
            self.meshes.append(
                scene.add_mesh_simple(
                    f"/run/bodies/{n}",
                    vertices.astype(np.float32),
                    faces.astype(np.uint32),
                    color=colour,
                    opacity=None if opacity == 1.0 else opacity,
                )
            )

    def show(self, state: State, bones: bool) -> None:
        """Place them; those in flesh are seen with `bones`, one whose numbers are lost is not."""
        centres, turns = state["geom_position"].astype(float), state["geom_rotation"].astype(float)
        for n, mesh in enumerate(self.meshes):
            known = np.isfinite(centres[n]).all() and np.isfinite(turns[n]).all()
            mesh.visible = bool(known) and (bones or not self._covered[n])
            if mesh.visible:
                mesh.position = centres[n]
                mesh.wxyz = Rotation.from_matrix(turns[n]).as_quat(scalar_first=True)


class SkinMesh:
    """A skin; of the flesh of a slab its cross-section.

    mesh  in the scene
    """

    def __init__(self, scene: SceneApi, run: Run, skin: Skin, name: str, side: float) -> None:
        """`side`: m, smaller side of what is seen."""
        self._run, self._skin, self._high = run, skin, THICK * side
        state = run.state(0)
        places = skin.vertices(state)
        self._vertex, self._faces = creased(places, skin.triangles)
        vertices, faces = self._surface(state, places)
        self.mesh: MeshHandle = scene.add_mesh_simple(
            f"/run/skins/{name}",
            vertices.astype(np.float32),
            faces.astype(np.uint32),
            color=skin.rgb,
        )

    def show(self, state: State, bones: bool) -> None:
        """Show the skin in a state, seen through with `bones`; not when its numbers are lost."""
        places = self._skin.vertices(state)
        self.mesh.visible = bool(np.isfinite(places).all())
        self.mesh.opacity = style.SEEN_THROUGH if bones else None
        if self.mesh.visible:
            vertices, faces = self._surface(state, places)
            self.mesh.vertices = vertices.astype(np.float32)
            if self._run.slab:
                self.mesh.faces = faces.astype(np.uint32)

    def _surface(self, state: State, places: Array) -> Mesh:
        """Of the skin with vertices (k, 3) m in a state."""
        if self._run.slab:
            return prism(flesh_loops(self._run, state), 0.0, self._high)
        return places[self._vertex], self._faces


class Pushes:
    """The forces of fluid and winds on the bodies, as arrows of one scale.

    scale  of the arrows
    """

    def __init__(self, scene: SceneApi, run: Run, side: float) -> None:
        self.scale = Forces(run, side)
        self._scene, self._slab = scene, run.slab
        self._pixel, self._high = side / PIXELS, THICK * side
        self._outside = None
        if not run.slab:
            self._outside = Outside(run.geoms, [mesh_of(geom) for geom in run.geoms], run.skins)

    def show(self, state: State, wanted: bool) -> None:
        """Show the arrows of a state, or none."""
        mesh = self._mesh(state) if wanted else nothing()
        colour = style.rgb(style.FORCE)
        show_mesh(self._scene, "/run/forces", mesh, color=colour, cast_shadow=False)

    def _mesh(self, state: State) -> Mesh:
        """All arrows of a state as one."""
        width = SHAFT_WIDTH * self._pixel
        if self._outside is None:
            found = self.scale.arrows(state, self._pixel)
            flat = [arrow(tail, vector, width)[::-1] for _, tail, vector in found]
            return joined([prism([one], self._high, 1.5 * self._high) for one in flat])
        return arrow_mesh(*pushes(self.scale, self._outside, state, self._pixel), width)


def _surfaces(run: Run, side: float) -> list[Mesh]:
    """Vertices (k, 3) m and faces (m, 3) of each geometry in its own frame."""
    if not run.slab:
        meshes = [mesh_of(geom) for geom in run.geoms]
        return [(np.asarray(m.points, float), m.regular_faces) for m in meshes]
    state, found = run.state(0), []
    placed = Outlines(run).placed(state)
    poses = zip(state["geom_position"], state["geom_rotation"], placed, strict=True)
    for centre, turn, outline in poses:
        vertices, faces = prism([counter_clockwise(outline)], 0.0, THICK * side)
        found.append(((vertices - centre) @ turn, faces))
    return found
