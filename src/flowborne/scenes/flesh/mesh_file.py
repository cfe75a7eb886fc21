"""The .vtu file in which a run keeps its flesh: another meshing would give another mesh."""

from __future__ import annotations

import json
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pyvista as pv
from numpy.typing import NDArray

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
    """What the mesh of a file was made of; empty for a file that does not say."""
    try:
        return str(pv.read(path).field_data[RECIPE][0])
    except (AttributeError, KeyError, ValueError):
        return ""


def read_mesh(path: Path) -> FleshMesh:
    """The flesh of such a file. Raises ValueError for another file."""
    try:
        grid = pv.read(path)
        bones = [*json.loads(str(grid.field_data[BONES][0])), ""]
        return FleshMesh(
            np.asarray(grid.points, dtype=np.float64),
            _elements(grid),
            tuple(bones[n] for n in grid.point_data[HOLDER]),
        )
    except (AttributeError, FileNotFoundError, KeyError, ValueError) as error:
        raise ValueError(
            f"{path} cannot be read as a mesh of flesh ({error}). Mesh the flesh once more."
        ) from error


def _elements(grid: pv.UnstructuredGrid) -> NDArray[np.int64]:
    """(m, 4) the tetrahedra of a file, (m, 3) its triangles when it has none."""
    cells = grid.cells_dict
    kind = KINDS[4] if KINDS[4] in cells else KINDS[3]
    return np.asarray(cells[kind], dtype=np.int64)
