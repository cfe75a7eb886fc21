"""The .vtu file in which a run keeps its flesh: another meshing would give another mesh."""

from __future__ import annotations

import json
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pyvista as pv
from numpy.typing import NDArray
from vtkmodules.vtkCommonCore import vtkOutputWindow, vtkStringOutputWindow
from vtkmodules.vtkIOXML import vtkXMLUnstructuredGridReader

from flowborne.scenes.flesh.mesh import FleshMesh

HOLDER, BONES, RECIPE = "holder", "bones", "recipe"

KINDS = {3: pv.CellType.TRIANGLE, 4: pv.CellType.TETRA}
"""VTK's cells by their corners."""


def mesh_bytes(mesh: FleshMesh, recipe: str) -> bytes:
    """Content of the file: the elements of flesh, exactly.

    Points have the number of their holder among the names in the field `bones`, or -1; the names
    are a JSON list, as VTK has ASCII alone. `recipe` says what the mesh was made of.
    """
    bones = sorted(set(mesh.holders) - {""})
    number = {"": -1} | {name: n for n, name in enumerate(bones)}
    grid = pv.UnstructuredGrid({KINDS[mesh.elements.shape[1]]: mesh.elements}, mesh.points)
    grid.point_data[HOLDER] = np.array([number[name] for name in mesh.holders])
    grid.field_data[BONES] = json.dumps(bones)
    grid.field_data[RECIPE] = [recipe]
    with TemporaryDirectory() as folder:
        whole = Path(folder) / "flesh.vtu"
        grid.save(whole)
        return whole.read_bytes()


def recipe_of(path: Path) -> str:
    """What the mesh of a file was made of; empty for one that does not say.

    raises  ValueError for a file that cannot be read
    """
    fields = _grid(path).field_data
    return str(fields[RECIPE][0]) if RECIPE in fields else ""


def read_mesh(path: Path) -> FleshMesh:
    """The flesh of such a file. Raises ValueError for another file, or one that is damaged."""
    grid = _grid(path)
    try:
        bones = [*map(str, json.loads(str(grid.field_data[BONES][0]))), ""]
        elements, holders = _elements(grid), np.asarray(grid.point_data[HOLDER])
        points = np.asarray(grid.points, dtype=np.float64)
        if elements.min() < 0 or elements.max() >= len(points):
            raise ValueError("its elements have corners that are not there")
        if not np.isfinite(points).all():
            raise ValueError("its points are no finite numbers")
        if not np.isin(holders, np.arange(-1, len(bones) - 1)).all():
            raise ValueError("its points are held by bones that it does not name")
        return FleshMesh(points, elements, tuple(bones[int(n)] for n in holders))
    except (LookupError, TypeError, ValueError) as error:
        said = f"it has no {error}" if isinstance(error, KeyError) else error
        raise _no_mesh(path, said) from error


def _grid(path: Path) -> pv.UnstructuredGrid:
    """What VTK reads of a file. Raises ValueError with the first thing that it stumbles over."""
    before, said = vtkOutputWindow.GetInstance(), vtkStringOutputWindow()
    reader = vtkXMLUnstructuredGridReader()
    reader.SetFileName(str(path))
    vtkOutputWindow.SetInstance(said)
    try:
        if not path.is_file():
            raise _no_mesh(path, "there is no such file")
        reader.Update()
    finally:
        vtkOutputWindow.SetInstance(before)
    if said.GetOutput().strip():
        raise _no_mesh(path, "it is cut, or no .vtu file")
    return pv.wrap(reader.GetOutput())


def _no_mesh(path: Path, why: object) -> ValueError:
    return ValueError(
        f"{path} cannot be read as a mesh of flesh ({why}). Mesh the flesh once more."
    )


def _elements(grid: pv.UnstructuredGrid) -> NDArray[np.int64]:
    """(m, 4) the tetrahedra of a file, (m, 3) its triangles when it has none."""
    cells = grid.cells_dict
    kind = KINDS[4] if KINDS[4] in cells else KINDS[3]
    if kind not in cells:
        raise ValueError("it has neither tetrahedra nor triangles")
    return np.asarray(cells[kind], dtype=np.int64)
