"""Bodies, flesh, and the forces on them, as meshes in the scene."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from scipy.spatial.transform import Rotation

from flowborne.kernels.arrays import Array, Mesh
from flowborne.view import style
from flowborne.view.browser.meshes import (
    add_mesh,
    counter_clockwise,
    nothing,
    prism,
    prism_points,
    repeated,
)
from flowborne.view.glyphs import SHAFT_WIDTH, Forces, flat_arrows
from flowborne.view.outlines import Outlines, flesh_loops
from flowborne.view.run import Run, Skin, State
from flowborne.view.space.arrows import TRIANGLES, arrows
from flowborne.view.space.surfaces import Outside, colour_of, creased, force_arrows, mesh_of

if TYPE_CHECKING:
    from viser import MeshHandle, SceneApi

SLAB_THICKNESS = 0.02
"""Thickness of drawn slabs, in smaller sides of the view."""

FLAT_ARROW = prism([flat_arrows(np.zeros(2), np.array([1.0, 0.0]), 0.1)[::-1]], 0.0, 1.0)[1]
"""Triangles of every flat arrow that is raised to a prism."""

PIXELS = 700.0
"""Approximate number of pixels along the smaller side of the view in a browser."""


class Bodies:
    """The geometries, each a mesh in its own frame that is moved for every state.

    meshes  of each geometry
    """

    def __init__(
        self, scene: SceneApi, run: Run, side: float, name: str = "bodies", share: float = 1.0
    ) -> None:
        """`side`: smaller side of the view, m; `name`: in the scene; `share`: of their opacity."""
        self._covered = [geom.covered for geom in run.geoms]
        self.meshes: list[MeshHandle] = []
        for n, mesh in enumerate(_surfaces(run, side)):
            colour, own = colour_of(run.geoms[n], run.accented)
            opacity = share * own
            drawn = {"color": colour, "opacity": None if opacity == 1.0 else opacity}
            self.meshes.append(
                add_mesh(scene, f"/run/{name}/{n}", mesh, cast_shadow=share == 1.0, **drawn)
            )

    def show(self, state: State, bones: bool) -> None:
        """Place them; hide those with non-finite poses and, unless `bones`, those in flesh."""
        positions = state["geom_position"].astype(float)
        rotations = state["geom_rotation"].astype(float)
        known = np.isfinite(positions).all(axis=1) & np.isfinite(rotations).all(axis=(1, 2))
        rotations[~known] = np.eye(3)
        turns = Rotation.from_matrix(rotations).as_quat(scalar_first=True) if len(known) else ()
        poses = zip(self.meshes, self._covered, known, positions, turns, strict=True)
        for mesh, covered, there, position, turn in poses:
            mesh.visible = bool(there) and (bones or not covered)
            if mesh.visible:
                mesh.position, mesh.wxyz = position, turn


class SkinMesh:
    """A skin, or the cross-section of the flesh of a slab.

    mesh  in the scene
    """

    def __init__(self, scene: SceneApi, run: Run, skin: Skin, name: str, side: float) -> None:
        """`side`: smaller side of the view, m."""
        self._run, self._skin, self._high = run, skin, SLAB_THICKNESS * side
        state = run.state(0)
        vertices = skin.vertices(state)
        self._vertex, self._faces = creased(vertices, skin.triangles)
        mesh = self._surface(state, vertices)
        self.mesh = add_mesh(scene, f"/skins/{name}", mesh, color=skin.rgb)

    def show(self, state: State, bones: bool, along: Array) -> None:
        """Show the skin, transparent if `bones`; hide it if its vertices are not finite.

        along  (3,) m, by which the world is moved back. The vertices are moved themselves: a
               browser shows new ones some frames later than it moves the world
        """
        vertices = self._skin.vertices(state)
        self.mesh.visible = bool(np.isfinite(vertices).all())
        self.mesh.opacity = style.SEEN_THROUGH if bones else None
        if self.mesh.visible:
            points, faces = self._surface(state, vertices)
            self.mesh.vertices = (points - along).astype(np.float32)
            if self._run.is_slab:
                self.mesh.faces = faces.astype(np.uint32)

    def _surface(self, state: State, vertices: Array) -> Mesh:
        """Mesh of the skin with vertices (k, 3) m in a state."""
        if self._run.is_slab:
            return prism(flesh_loops(self._run, state), 0.0, self._high)
        return vertices[self._vertex], self._faces


class ForceArrows:
    """The forces of fluid and winds on the bodies, as arrows of one scale.

    scale  of the arrows
    """

    def __init__(self, scene: SceneApi, run: Run, side: float) -> None:
        self.scale = Forces(run, side)
        self._scene = scene
        self._pixel, self._high = side / PIXELS, SLAB_THICKNESS * side
        self._arrows: MeshHandle | None = None
        self._outside = None
        if not run.is_slab:
            self._outside = Outside(run.geoms, run.skins)

    def show(self, state: State, visible: bool, along: Array) -> None:
        """Show the arrows of a state, or none.

        along  (3,) m, by which the world is moved back; see `SkinMesh.show`
        """
        vertices, faces = self._mesh(state) if visible else nothing()
        if self._arrows is not None:
            self._arrows.visible = len(faces) > 0
        if not len(faces):
            return
        if self._arrows is None:
            mesh, colour = (vertices - along, faces), style.rgb(style.FORCE)
            self._arrows = add_mesh(self._scene, "/forces", mesh, color=colour, cast_shadow=False)
            return
        self._arrows.vertices = (vertices - along).astype(np.float32)

    def _mesh(self, state: State) -> Mesh:
        """All arrows of a state as one, with the vertices of as many as there can be: a browser
        that draws slowly never gets to show a mesh that is replaced in each frame."""
        width = SHAFT_WIDTH * self._pixel
        if self._outside is None:
            found = self.scale.arrows(state, self._pixel)
            if not found:
                return nothing()
            flat = [flat_arrows(tail, vector, width)[::-1] for _, tail, vector in found]
            parts = [prism_points(one, self._high, 1.5 * self._high) for one in flat]
            return repeated(np.array(parts), FLAT_ARROW, self.scale.most)
        tails, vectors = force_arrows(self.scale, self._outside, state, self._pixel)
        if not len(tails):
            return nothing()
        return repeated(arrows(tails, vectors, width), TRIANGLES, self.scale.most)


def _surfaces(run: Run, side: float) -> list[Mesh]:
    """Vertices (k, 3) m and faces (m, 3) of each geometry in its own frame."""
    if not run.is_slab:
        meshes = [mesh_of(geom) for geom in run.geoms]
        return [(np.asarray(m.points, float), m.regular_faces) for m in meshes]
    state, found = run.state(0), []
    outlines = Outlines(run).placed(state)
    poses = zip(state["geom_position"], state["geom_rotation"], outlines, strict=True)
    for position, rotation, outline in poses:
        vertices, faces = prism([counter_clockwise(outline)], 0.0, SLAB_THICKNESS * side)
        found.append(((vertices - position) @ rotation, faces))
    return found
