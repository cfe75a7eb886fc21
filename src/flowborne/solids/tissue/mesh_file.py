"""The .vtu file in which a run keeps its flesh: another meshing would give another mesh."""

from __future__ import annotations

import json
from collections.abc import Mapping
from functools import lru_cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
import pyvista as pv
from numpy.typing import NDArray

from flowborne.files.arrays import read_arrays
from flowborne.files.given import read_file
from flowborne.solids.tissue.apart import run_apart
from flowborne.solids.tissue.mesh import FleshMesh
from flowborne.solids.tissue.mesh_run import READ

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
    found = _contents(path)
    return str(found[RECIPE]) if RECIPE in found else ""


def read_mesh(path: Path) -> FleshMesh:
    """The flesh of such a file. Raises ValueError for another file, or one that is damaged."""
    found = _contents(path)
    try:
        bones = [*map(str, json.loads(str(found[BONES]))), ""]
        elements, holders = _elements(found), found[HOLDER]
        points = found["points"].astype(np.float64)
        if elements.min() < 0 or elements.max() >= len(points):
            raise ValueError("its elements have corners that are not there")
        if not np.isfinite(points).all():
            raise ValueError("its points are no finite numbers")
        known = np.isin(holders, np.arange(-1, len(bones) - 1))
        if holders.shape != (len(points),) or not known.all():
            raise ValueError("its points are held by bones that it does not name")
        return FleshMesh(points, elements, tuple(bones[int(n)] for n in holders))
    except (LookupError, RecursionError, TypeError, ValueError) as error:
        said = f"it has no {error}" if isinstance(error, KeyError) else error
        raise _no_mesh(path, said) from error


def _contents(path: Path) -> dict[str, NDArray[Any]]:
    """What VTK reads of a file. Raises ValueError with the first thing that it stumbles over."""
    try:
        return _read(read_file(path))
    except FileNotFoundError:
        raise _no_mesh(path, "there is no such file") from None
    except (OSError, ValueError) as error:
        raise _no_mesh(path, error) from error


@lru_cache(maxsize=8)
def _read(content: bytes) -> dict[str, NDArray[Any]]:
    with TemporaryDirectory(prefix="flowborne-flesh-") as folder:
        (Path(folder) / "flesh.vtu").write_bytes(content)
        why = run_apart(folder, READ, "read", "flesh.vtu")
        if why is not None:
            raise ValueError(why)
        return read_arrays(Path(folder) / READ)


def _no_mesh(path: Path, why: object) -> ValueError:
    return ValueError(
        f"{path} cannot be read as a mesh of flesh ({why}). Mesh the flesh once more."
    )


def _elements(found: Mapping[str, NDArray[Any]]) -> NDArray[np.int64]:
    """(m, 4) the tetrahedra of a file, (m, 3) its triangles when it has none."""
    for corners in (4, 3):
        elements = found[f"elements_{corners}"]
        if len(elements):
            return elements.astype(np.int64)
    raise ValueError("it has neither tetrahedra nor triangles")
