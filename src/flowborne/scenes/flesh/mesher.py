"""Tetrahedra inside surfaces, by fTetWild (Hu, Schneider, Wang, Zorin and Panozzo 2020)."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from numpy.typing import NDArray

from flowborne.kernels.jit import numba_thread_count
from flowborne.scenes.flesh import mesh_run
from flowborne.shapes.shape import Mesh
from flowborne.solids.elements import oriented

Array = NDArray[np.float64]
Indices = NDArray[np.int64]


def tetrahedra_within(
    surfaces: Sequence[Mesh], size: float, tolerance: float
) -> tuple[Array, Indices]:
    """Points (n, 3) and right-handed tetrahedra (m, 4) of all that the surfaces enclose.

    surfaces   closed and outward; faces of tetrahedra follow each of them
    size       length of edges, m; shorter where the surfaces bend too much for it
    tolerance  how far from the surfaces those faces may be, m
    raises     ValueError when the mesher fails

    Two runs give different meshes of the same quality, even on one thread.
    """
    first = np.cumsum([0, *(len(points) for points, _ in surfaces)])
    points = np.concatenate([points for points, _ in surfaces])
    triangles = [t + start for (_, t), start in zip(surfaces, first[:-1], strict=True)]
    with TemporaryDirectory(prefix="flowborne-flesh-") as folder:
        np.savez(
            Path(folder) / mesh_run.SURFACES,
            points=points,
            triangles=np.concatenate(triangles).astype(np.int32),
            size=size,
            tolerance=tolerance / np.linalg.norm(np.ptp(points, axis=0)),
            threads=numba_thread_count(),
        )
        # -P: no module of this folder stands in for one of Python's own
        command = [sys.executable, "-P", str(Path(mesh_run.__file__).resolve())]
        run = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
        made = Path(folder) / mesh_run.TETRAHEDRA
        if run.returncode or not made.is_file():
            said = [line.strip() for line in (run.stdout + run.stderr).splitlines() if line.strip()]
            why = said[-1].rstrip(".") if said else f"it ended with {run.returncode}"
            raise ValueError(
                f"the flesh cannot be meshed with edges of {size:g} m: {why}. Try another size."
            )
        with np.load(made) as mesh:
            points, tetrahedra = mesh["points"], mesh["tetrahedra"].astype(np.int64)
    return points, oriented(points, tetrahedra)
