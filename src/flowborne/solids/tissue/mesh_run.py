"""A process that makes or reads a mesh and may crash: files in, files out.

fTetWild leaves a file in its working folder and writes to the terminal. VTK trusts the array sizes
in a file, and crashes if they are wrong. This module runs as a script in a temporary folder, and
ends with its parent process.
"""

from __future__ import annotations

import ctypes
import signal
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np

SURFACES, TETRAHEDRA, READ = "surfaces.npz", "tetrahedra.npz", "read.npz"

FIELDS = ("bones", "recipe")
"""Names of the texts in a mesh of flesh."""

CORNERS = {5: 3, 10: 4}
"""VTK's cell types of flesh, triangles and tetrahedra -> number of corners."""

PR_SET_PDEATHSIG = 1
"""Linux's name for the signal that a process gets when its parent ends."""

MEMORY = 8 << 30
"""Most bytes that VTK may allocate for a file."""


def run_apart(folder: str, made: str, job: str, *arguments: str) -> str | None:
    """Run a job of this module in a folder; return why it did not make the file `made`, or None.

    The process may crash; fTetWild may also exit with 0 before there is a mesh.
    """
    # -P: no module of this folder hides one of Python's
    command = [sys.executable, "-P", str(Path(__file__).resolve()), job, *arguments]
    run = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    if run.returncode == 0 and (Path(folder) / made).is_file():
        return None
    output = [line.strip() for line in (run.stdout + run.stderr).splitlines() if line.strip()]
    crashed = run.returncode < 0 or not output
    return f"it ended with {run.returncode}" if crashed else output[-1].rstrip(".")


def end_with_parent() -> None:
    """Let the system end this process with its parent, on Linux.

    The parent may be killed, and nothing else would stop a mesher that runs for hours.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the parent handles Ctrl-C and ends this process
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, signal.SIGKILL)


def mesh() -> None:
    """Mesh the surface in SURFACES into TETRAHEDRA, both in this folder."""
    import pytetwild

    with np.load(SURFACES) as given:
        points, tetrahedra = pytetwild.tetrahedralize(
            given["points"],
            given["triangles"],
            edge_length_abs=float(given["size"]),
            epsilon=float(given["tolerance"]),
            num_threads=int(given["threads"]),
        )
    np.savez(Path.cwd() / TETRAHEDRA, points=points, tetrahedra=tetrahedra)


def read(file: str) -> None:
    """Copy the contents of a .vtu file to READ: points, elements, holders and FIELDS."""
    from vtkmodules.util.numpy_support import vtk_to_numpy
    from vtkmodules.vtkCommonCore import vtkOutputWindow, vtkStringOutputWindow
    from vtkmodules.vtkIOXML import vtkXMLUnstructuredGridReader

    if sys.platform == "linux":
        import resource

        resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
    said, reader = vtkStringOutputWindow(), vtkXMLUnstructuredGridReader()
    vtkOutputWindow.SetInstance(said)
    reader.SetFileName(file)
    reader.Update()
    grid = reader.GetOutput()
    if said.GetOutput().strip() or grid.GetPoints() is None or grid.GetNumberOfCells() == 0:
        sys.exit("it is cut, or no .vtu file")
    found: dict[str, Any] = {"points": vtk_to_numpy(grid.GetPoints().GetData())}
    types = vtk_to_numpy(grid.GetCellTypesArray())
    offsets = vtk_to_numpy(grid.GetCells().GetOffsetsArray())
    corners = vtk_to_numpy(grid.GetCells().GetConnectivityArray())
    for kind, count in CORNERS.items():
        cells = np.flatnonzero(types == kind)
        if (offsets[cells + 1] - offsets[cells] != count).any():
            sys.exit("its elements have too many corners, or too few")
        found[f"elements_{count}"] = corners[offsets[cells][:, None] + np.arange(count)]
    holders = grid.GetPointData().GetArray("holder")
    if holders is not None:
        found["holder"] = vtk_to_numpy(holders)
    for name in FIELDS:
        values = grid.GetFieldData().GetAbstractArray(name)
        if values is not None and values.GetNumberOfValues() > 0:
            found[name] = np.array(str(values.GetVariantValue(0).ToString()))
    np.savez(Path.cwd() / READ, **found)


if __name__ == "__main__":
    end_with_parent()
    if sys.argv[1] == "mesh":
        mesh()
    else:
        read(sys.argv[2])
