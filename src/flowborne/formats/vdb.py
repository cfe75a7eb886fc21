"""Dye and velocity of a run as OpenVDB volumes, a file per frame."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from flowborne.errors import SceneError
from flowborne.files.atomic import write_atomically
from flowborne.fluid.grid import Grid
from flowborne.formats.vdb_file import VdbGrid, vdb_bytes
from flowborne.runs.exporters import Written, provided
from flowborne.runs.open_run import OpenRun
from flowborne.runs.states import cell_velocity


@provided(".vdb")
@dataclass(frozen=True)
class ExporterVdb:
    """smoke.vdb stands for smoke_0000.vdb, smoke_0001.vdb and so on, a file for each state.

    A grid for each dye, by its name, and "velocity", m/s, the mean of the two faces of a cell.
    Index (0, 0, 0) is the first cell; places are in m, z up.
    """

    def write(self, run: OpenRun, path: Path) -> Written:
        if run.grid is None:
            raise SceneError(f"{run.folder} has no flow: {_without_flow(run)}.")
        files = tuple(numbered(path, frame) for frame in run.frames)
        for number, file in enumerate(files):
            state = run.state(number)
            grids = [dye_grid(run.grid, dye, state[f"scalar_{dye}"]) for dye in run.dyes]
            velocity = cell_velocity(run.grid, state)
            every = np.ones(run.grid.shape, bool)
            grids.append(_grid(run.grid, "velocity", "unknown", velocity, every))
            _write(file, grids)
        return Written(files)


def _without_flow(run: OpenRun) -> str:
    """Why a run has no grid, and what gives it one."""
    if "fluid" in run.scene and "domain" in run.scene:
        return (
            "its scene leaves the fluid out by fluid.coupling = 'none'. Run it with 'one-way' or "
            "'two-way'"
        )
    return "its scene has no fluid. Add [domain] and [fluid]"


def write_dye(run: OpenRun, path: Path) -> tuple[Path, ...]:
    """A file for each state like `path`, with the dyes alone."""
    assert run.grid is not None
    files = tuple(numbered(path, frame) for frame in run.frames)
    for number, file in enumerate(files):
        dyes = {dye: run.arrays[f"scalar_{dye}"][number] for dye in run.dyes}
        _write(file, [dye_grid(run.grid, dye, values) for dye, values in dyes.items()])
    return files


def numbered(path: Path, frame: int) -> Path:
    """The file of a frame: of smoke.vdb and frame 7, smoke_0007.vdb."""
    return path.with_name(f"{path.stem}_{frame:04d}{path.suffix}")


def dye_grid(grid: Grid, dye: str, values: NDArray[np.float32]) -> VdbGrid:
    """A dye where there is some."""
    return _grid(grid, dye, "fog volume", values, values != 0.0)


def _grid(
    grid: Grid, name: str, kind: str, values: NDArray[np.float32], active: NDArray[np.bool_]
) -> VdbGrid:
    x, y, z = (float(along[0]) for along in grid.cell_coordinates())
    return VdbGrid(name, kind, values, active, grid.spacing, (x, y, z))


def _write(path: Path, grids: list[VdbGrid]) -> None:
    content = vdb_bytes(grids)
    write_atomically(path, lambda file: file.write(content), durable=False)
