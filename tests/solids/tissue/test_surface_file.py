"""Closed surfaces from files, and what is said of those that are not."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import pyvista as pv
import trimesh

from flowborne.shapes.closing import is_closed
from flowborne.solids.tissue.surface_file import read_surface


def sphere() -> pv.PolyData:
    return pv.Sphere(radius=0.3, theta_resolution=20, phi_resolution=20)


@pytest.mark.parametrize("suffix", ["obj", "ply", "stl", "STL"])
def test_surface_is_read_closed_and_outward(suffix: str, tmp_path: Path) -> None:
    path = tmp_path / f"body.{suffix}"
    inward = sphere().flip_faces()
    inward.save(path)
    points, triangles = read_surface(path)
    assert is_closed((points, triangles))
    assert len(points) == sphere().n_points
    assert np.linalg.norm(points, axis=1) == pytest.approx(0.3, abs=1e-6)


@pytest.mark.parametrize("suffix", ["glb", "off"])
def test_whatever_trimesh_reads_is_a_surface(suffix: str, tmp_path: Path) -> None:
    whole = trimesh.Trimesh(sphere().points, sphere().regular_faces)
    whole.export(tmp_path / f"body.{suffix}")
    points, triangles = read_surface(tmp_path / f"body.{suffix}")
    assert is_closed((points, triangles))
    assert len(points) == sphere().n_points


def test_quadrangles_are_split(tmp_path: Path) -> None:
    pv.Cube().clean().save(tmp_path / "cube.ply")
    assert is_closed(read_surface(tmp_path / "cube.ply"))


def test_missing_and_unreadable_files_are_refused(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=r"there is no flesh file .*none\.stl"):
        read_surface(tmp_path / "none.stl")
    for name, said in (
        ("body.txt", r"body\.txt is none of .*\.glb, .*\.obj, \.off, \.ply, \.stl"),
        ("body.ply", r"body\.ply cannot be read: Not a ply file\. "),
        ("body.stl", r"body\.stl has no triangles"),
    ):
        (tmp_path / name).write_text("hello\n")
        with pytest.raises(ValueError, match=said):
            read_surface(tmp_path / name)


def test_holes_are_counted_and_one_is_placed(tmp_path: Path) -> None:
    whole = sphere()
    rest = whole.extract_cells(range(1, whole.n_cells)).extract_surface(algorithm=None)
    rest.save(tmp_path / "open.ply")
    with pytest.raises(ValueError, match=r"open\.ply: .* not closed: 3 edges .* 0\.2\d+\) m"):
        read_surface(tmp_path / "open.ply")


def test_inner_walls_are_counted_and_one_is_placed(tmp_path: Path) -> None:
    whole = sphere()
    wall = [*whole.regular_faces[50][:2], whole.n_points]
    points = np.vstack([whole.points, np.zeros(3)])
    faces = np.vstack([whole.regular_faces, wall])
    pv.PolyData.from_regular_faces(points, faces).save(tmp_path / "wall.ply")
    with pytest.raises(ValueError, match=r"wall\.ply: 1 edges .* more than two .* \(0\.26"):
        read_surface(tmp_path / "wall.ply")


def test_a_triangle_of_a_vertex_that_is_not_there_is_told(tmp_path: Path) -> None:
    """The mesher would read what is behind its arrays, and end the interpreter."""
    lines = [
        "ply\nformat ascii 1.0\nelement vertex 4",
        *(f"property float {axis}" for axis in "xyz"),
        "element face 4\nproperty list uchar int vertex_indices\nend_header",
        *("0 0 0", "1 0 0", "0 1 0", "0 0 1", "3 0 1 200", "3 0 1 3", "3 0 2 3", "3 1 2 3"),
    ]
    (tmp_path / "bad.ply").write_text("\n".join(lines) + "\n")
    with pytest.raises(ValueError, match=r"a triangle of vertex 200, and vertices 0 to 3\."):
        read_surface(tmp_path / "bad.ply")
