"""The process that meshes: surfaces in one file, tetrahedra in another.

fTetWild leaves a file in the folder where it runs and writes to the terminal. It is run as a
script, in a folder that is thrown away.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

SURFACES, TETRAHEDRA = "surfaces.npz", "tetrahedra.npz"


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
    main()
