"""The process that meshes: surfaces in one file, tetrahedra in another.

fTetWild leaves a file in the folder where it runs and writes to the terminal. It is run as a
script, in a folder that is thrown away, and ends with the process that began it.
"""

from __future__ import annotations

import ctypes
import signal
import sys
from pathlib import Path

import numpy as np

SURFACES, TETRAHEDRA = "surfaces.npz", "tetrahedra.npz"

PR_SET_PDEATHSIG = 1
"""Linux's name for the signal that a process gets when its parent ends."""


def end_with_parent() -> None:
    """Let the system end this process with the one that began it, which may be killed: nothing
    else would stop a mesher that has work for hours. Of systems that can, only Linux is asked."""
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, signal.SIGKILL)


def main() -> None:
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


if __name__ == "__main__":
    end_with_parent()
    main()
