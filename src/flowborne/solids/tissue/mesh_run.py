"""The process that makes or reads a mesh, and may die of it: files in, files out.

fTetWild leaves a file in the folder where it runs and writes to the terminal. VTK trusts what a
file says of its own arrays, and dies where that is wrong. This is run as a script, in a folder that
is thrown away, and ends with the process that began it.
"""

from __future__ import annotations

import ctypes
import signal
import sys
from pathlib import Path
from typing import Any

import numpy as np

SURFACES, TETRAHEDRA, READ = "surfaces.npz", "tetrahedra.npz", "read.npz"

FIELDS = ("bones", "recipe")
"""Texts that a mesh of flesh has."""

CORNERS = {5: 3, 10: 4}
"""VTK's cells that flesh is made of, triangles and tetrahedra -> their corners."""

PR_SET_PDEATHSIG = 1
"""Linux's name for the signal that a process gets when its parent ends."""

MEMORY = 8 << 30
"""Bytes that a file may make VTK ask for."""


def end_with_parent() -> None:
    """Let the system end this process with the one that began it, which may be killed: nothing
    else would stop a mesher that has work for hours. Of systems that can, only Linux is asked."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is the parent's, which ends this
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, signal.SIGKILL)


def mesh() -> None:
    """Mesh what is in SURFACES into TETRAHEDRA, both in this folder."""
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
    """Put what a .vtu file holds into READ: points, elements of each kind, holders and FIELDS."""
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
