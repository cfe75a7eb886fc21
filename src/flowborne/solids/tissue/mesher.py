"""Tetrahedra inside surfaces, by fTetWild (Hu, Schneider, Wang, Zorin and Panozzo 2020)."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from numpy.typing import NDArray

from flowborne.extras import check_mesher
from flowborne.kernels.jit import numba_thread_count
from flowborne.shapes.shape import Mesh
from flowborne.solids.elements import oriented
from flowborne.solids.tissue import mesh_run

Array = NDArray[np.float64]

Indices = NDArray[np.int64]


def run_apart(folder: str, made: str, job: str, *arguments: str) -> str | None:
    """Run a job of `mesh_run` in a folder; return why it did not make the file `made`, or None.

    The process may crash; fTetWild may also exit with 0 before there is a mesh.
    """
    # -P: no module of this folder hides one of Python's
    command = [sys.executable, "-P", str(Path(mesh_run.__file__).resolve()), job, *arguments]
    run = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    if run.returncode == 0 and (Path(folder) / made).is_file():
        return None
    said = [line.strip() for line in (run.stdout + run.stderr).splitlines() if line.strip()]
    died = run.returncode < 0 or not said
    return f"it ended with {run.returncode}" if died else said[-1].rstrip(".")


def tetrahedra_within(surface: Mesh, size: float, tolerance: float) -> tuple[Array, Indices]:
    """Points (n, 3) and right-handed tetrahedra (m, 4) of the inside of a surface.

    surface    closed and outward; for a hollow body it has parts that point into the hollow
    size       length of edges, m; shorter where the curvature or size of the surface requires it
    tolerance  largest distance of faces of the tetrahedra from the surface, m
    raises     ValueError when the mesher fails

    Two runs give different meshes of the same quality, even on one thread.
    """
    check_mesher()
    points, triangles = surface
    across = float(np.linalg.norm(np.ptp(points, axis=0)))
    with TemporaryDirectory(prefix="flowborne-flesh-") as folder:
        np.savez(
            Path(folder) / mesh_run.SURFACES,
            points=points,
            triangles=triangles.astype(np.int32),
            size=min(size, across),  # the mesher's box exceeds the surface by it
            tolerance=tolerance / across,
            threads=numba_thread_count(),
        )
        why = run_apart(folder, mesh_run.TETRAHEDRA, "mesh")
        if why is not None:
            raise ValueError(
                f"the flesh cannot be meshed with edges of {size:g} m: {why}. Try another size."
            )
        with np.load(Path(folder) / mesh_run.TETRAHEDRA) as mesh:
            points, tetrahedra = mesh["points"], mesh["tetrahedra"].astype(np.int64)
    return points, oriented(points, tetrahedra)
