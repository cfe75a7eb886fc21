"""The user's own closed surface, read from a file in world axes at rest."""

from __future__ import annotations

from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import trimesh
from trimesh.exchange.load import mesh_formats

from flowborne.base.extras import flesh_library
from flowborne.base.given import read_file
from flowborne.base.phrases import location
from flowborne.kernels.arrays import Mesh
from flowborne.solids.tissue.bones import Bones, contour, signed_distance

if TYPE_CHECKING:
    import pyvista as pv


MERGE_DISTANCE = 1e-7
"""Closer points, relative to the size of the surface, are merged: STL repeats its corners."""


def read_surface(path: Path) -> Mesh:
    """The surface in a file, its triangles oriented outward.

    raises  ValueError for a missing file, a file without triangles, and triangles that do not close
            a surface
    """
    content = surface_bytes(path)
    if path.suffix.lower() not in formats():
        raise ValueError(
            f"flesh file {path} is none of {', '.join(formats())}. Save the surface as one of them."
        )
    surface = _triangles(path, content)
    many = _edges(surface, non_manifold_edges=True)
    if many.n_cells:
        raise ValueError(
            f"flesh file {path}: {many.n_cells} edges are shared by more than two triangles, one "
            f"of them at {_middle(many)}. Leave only the outer skin there."
        )
    open_edges = _edges(surface, boundary_edges=True)
    if open_edges.n_cells:
        raise ValueError(
            f"flesh file {path}: the surface is not closed: {open_edges.n_cells} edges have a "
            f"triangle on one side alone, one of them at {_middle(open_edges)}. Close the holes."
        )
    surface = surface.compute_normals(
        auto_orient_normals=True, split_vertices=False, point_normals=False
    )
    return np.asarray(surface.points, dtype=np.float64), surface.regular_faces.astype(np.int64)


def surface_bytes(path: Path) -> bytes:
    """Content of a flesh file. Raises ValueError when it cannot be read."""
    try:
        return read_file(path)
    except FileNotFoundError:
        raise ValueError(f"there is no flesh file {path}. Correct its name.") from None
    except OSError as error:
        raise ValueError(
            f"flesh file {path} cannot be read: {error.strerror}. Save the surface once more."
        ) from None


def formats() -> tuple[str, ...]:
    """Endings of the mesh files that trimesh reads here; its extras add more."""
    return tuple(sorted(f".{kind}" for kind in mesh_formats() if "_" not in kind))


def check_covers(path: Path, surface: Mesh, bones: Bones, pitch: float, tolerance: float) -> None:
    """Raise ValueError when a bone is more than `tolerance` m outside its flesh.

    pitch  spacing of the lattice for the surfaces of the bones, m
    """
    points = contour(bones, 0.0, pitch)[0]
    outside = signed_distance(points, surface)
    worst = int(outside.argmax())
    if outside[worst] > tolerance:
        bone = bones.names[int(bones.distances(points[worst : worst + 1]).argmin())]
        raise ValueError(
            f"flesh file {path}: bone '{bone}' sticks {outside[worst]:.2g} m out of its flesh at "
            f"{location(points[worst])}. Widen the surface there, or move it: it is taken in the "
            "model's units and world axes, at rest."
        )


def _triangles(path: Path, content: bytes) -> pv.PolyData:
    """The triangles of a file. Raises ValueError when there are none."""
    try:
        kind = path.suffix.lower().removeprefix(".")
        read = trimesh.load_mesh(BytesIO(content), file_type=kind, process=False)
    except Exception as error:  # its readers raise errors of any kind
        why = str(error).rstrip(".!")
        raise ValueError(
            f"flesh file {path} cannot be read: {why}. Save the surface once more."
        ) from error
    if len(read.faces) == 0 or not np.isfinite(read.vertices).all():
        raise ValueError(
            f"flesh file {path} has no triangles at finite places. Save a closed surface in it."
        )
    if read.faces.min() < 0 or read.faces.max() >= len(read.vertices):
        raise ValueError(
            f"flesh file {path} has a triangle of vertex {read.faces.max()}, and vertices "
            f"0 to {len(read.vertices) - 1}. Save the surface once more."
        )
    pyvista = flesh_library()
    surface = pyvista.PolyData.from_regular_faces(read.vertices, read.faces)
    return surface.clean(tolerance=MERGE_DISTANCE)


def _edges(surface: pv.PolyData, **kind: bool) -> pv.PolyData:
    """The edges of one kind."""
    none = dict.fromkeys(
        ("boundary_edges", "non_manifold_edges", "feature_edges", "manifold_edges"), False
    )
    return surface.extract_feature_edges(**{**none, **kind})


def _middle(edges: pv.PolyData) -> str:
    """The middle of the first edge, for messages."""
    return location(np.asarray(edges.points)[edges.lines[1:3]].mean(axis=0))
