"""The file in which a run keeps its flesh, since meshing again would give another mesh.

flowborne writes .npz. A mesh of the user may also be a .vtu, which VTK reads.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from functools import lru_cache
from io import BytesIO
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flowborne.base.extras import optional
from flowborne.base.given import read_arrays, read_file
from flowborne.kernels.arrays import Integers
from flowborne.solids.tissue.mesh import FleshMesh
from flowborne.solids.tissue.mesh_run import READ, run_apart

HOLDER, BONES, RECIPE = "holder", "bones", "recipe"

ENDING = ".npz"
"""Ending of the files that flowborne writes."""


def mesh_bytes(mesh: FleshMesh, recipe: str) -> bytes:
    """Content of the file: arrays in an .npz, exactly.

    `points` (n, 3) m; `elements_4` (m, 4) or `elements_3` (m, 3); `holder` (n,) the index of the
    bone that holds a point in `bones`, a JSON list of names, or -1; `recipe` describes how the mesh
    was made.
    """
    bones = sorted(set(mesh.holders) - {""})
    number = {"": -1} | {name: n for n, name in enumerate(bones)}
    content = BytesIO()
    arrays = {
        "points": mesh.points,
        f"elements_{mesh.elements.shape[1]}": mesh.elements,
        HOLDER: np.array([number[name] for name in mesh.holders]),
        BONES: np.array(json.dumps(bones)),
        RECIPE: np.array(recipe),
    }
    np.savez_compressed(content, allow_pickle=False, **arrays)
    return content.getvalue()


def recipe_of(path: Path) -> str:
    """The recipe of the mesh in a file; empty without one.

    raises  ValueError for a file that cannot be read
    """
    found = _contents(path)
    return str(found[RECIPE]) if RECIPE in found else ""


def read_mesh(path: Path) -> FleshMesh:
    """The flesh in a file. Raises ValueError for another kind of file, or a damaged one."""
    found = _contents(path)
    try:
        bones = [*map(str, json.loads(str(found[BONES]))), ""]
        elements, holders = _elements(found), found[HOLDER]
        points = found["points"].astype(np.float64)
        if points.ndim != 2 or points.shape[1] != 3:
            raise ValueError("its points have no three coordinates each")
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


def _contents(path: Path) -> Mapping[str, NDArray[Any]]:
    """The arrays of a file. Raises ValueError with the first error of its reader."""
    try:
        if path.suffix.lower() == ENDING:
            return read_arrays(path)
        return _read_vtu(read_file(path))
    except FileNotFoundError:
        raise _no_mesh(path, "there is no such file") from None
    except (OSError, ValueError) as error:
        raise _no_mesh(path, error) from error


@lru_cache(maxsize=8)
def _read_vtu(content: bytes) -> Mapping[str, NDArray[Any]]:
    optional("vtkmodules", "VTK", "flesh", ".vtu files", verb="read")
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


def _elements(found: Mapping[str, NDArray[Any]]) -> Integers:
    """(m, 4) the tetrahedra of a file, or (m, 3) its triangles if it has no tetrahedra."""
    for corners in (4, 3):
        elements = found.get(f"elements_{corners}", np.zeros((0, corners)))
        if len(elements):
            if elements.ndim != 2 or elements.shape[1] != corners:
                raise ValueError(f"its elements have no {corners} corners each")
            return elements.astype(np.int64)
    raise ValueError("it has neither tetrahedra nor triangles")
