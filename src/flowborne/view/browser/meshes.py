"""Meshes in the scene, and flat shapes raised to prisms."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import pyvista as pv

from flowborne.kernels.arrays import Array, Integers, Mesh

if TYPE_CHECKING:
    from viser import MeshHandle, SceneApi


def prism(outlines: Sequence[Array], low: float, high: float) -> Mesh:
    """The area inside outlines, extruded from z = low to z = high, m.

    The invisible bottom is left out. Top and sides share no vertex, so that the edge between them
    is sharp.

    outlines  (k, 2) m of each, counter-clockwise; clockwise around holes
    """
    if not outlines:
        return nothing()
    flat = np.concatenate(outlines)
    sizes = [len(outline) for outline in outlines]
    here = np.arange(len(flat))
    loops = np.split(here, np.cumsum(sizes)[:-1])
    there = np.concatenate([np.roll(loop, -1) for loop in loops])
    points = prism_points(flat, low, high)
    top = points[: len(flat)]
    upper, lower = len(flat), 2 * len(flat)
    sides = [
        (lower + here, lower + there, upper + there),
        (lower + here, upper + there, upper + here),
    ]
    faces = [_inside(top, loops), *(np.stack(corners, axis=1) for corners in sides)]
    return points, np.concatenate(faces)


def prism_points(flat: Array, low: float, high: float) -> Array:
    """(3 k, 3) m, vertices of a prism on the corners (k, 2) of outlines: those of the top, and
    those of the sides at the top and at the bottom."""
    top, bottom = (np.pad(flat, ((0, 0), (0, 1)), constant_values=z) for z in (high, low))
    return np.concatenate([top, top, bottom])


def repeated(parts: Array, triangles: Integers, least: int = 0) -> Mesh:
    """Equal meshes as one.

    parts      (n, k, 3) m, vertices of each, n > 0
    triangles  (m, 3) vertices of one
    least      number of meshes up to which others without size are added
    """
    added = max(least - len(parts), 0)
    points = np.concatenate([parts, np.broadcast_to(parts[0, 0], (added, *parts.shape[1:]))])
    first = parts.shape[1] * np.arange(len(points))
    return points.reshape(-1, 3), (first[:, None, None] + triangles).reshape(-1, 3)


def nothing() -> Mesh:
    """A mesh without vertices."""
    return np.zeros((0, 3)), np.zeros((0, 3), np.int64)


def counter_clockwise(outline: Array) -> Array:
    """The outline (k, 2), reversed if it was clockwise."""
    x, y = outline.T
    area = float(x @ np.roll(y, -1) - y @ np.roll(x, -1))
    return outline if area >= 0.0 else outline[::-1]


def _inside(points: Array, loops: Sequence[Integers]) -> Integers:
    """(m, 3) triangles of points (n, 3) of a plane, inside loops of these points."""
    lines = [entry for loop in loops for entry in (len(loop) + 1, *loop.tolist(), int(loop[0]))]
    faces = pv.PolyData(points, lines=lines).triangulate_contours().regular_faces
    return np.asarray(faces, np.int64)


def add_mesh(scene: SceneApi, name: str, mesh: Mesh, **drawn: Any) -> MeshHandle:
    """Add a mesh with options of viser's add_mesh_simple."""
    vertices, faces = mesh
    return scene.add_mesh_simple(
        name, vertices.astype(np.float32), faces.astype(np.uint32), **drawn
    )


def show_mesh(scene: SceneApi, name: str, mesh: Mesh, **drawn: Any) -> None:
    """Show a mesh under a name and replace an earlier one; without triangles only remove it.

    drawn  options of viser's add_mesh_simple
    """
    if len(mesh[1]):
        add_mesh(scene, name, mesh, **drawn)
    else:
        scene.remove_by_name(name)
