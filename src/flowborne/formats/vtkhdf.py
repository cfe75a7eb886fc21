"""A run as one VTKHDF file for ParaView, by h5py."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from flowborne.extras import optional
from flowborne.files.atomic import replaced_whole
from flowborne.runs.exporters import provided
from flowborne.runs.open_run import OpenRun


@provided(".vtkhdf")
@dataclass(frozen=True)
class ExporterVtkHdf:
    """Blocks fluid, bodies, forces and flesh, each where the run has it; see `vtkhdf_file`."""

    def write(self, run: OpenRun, path: Path) -> None:
        optional("h5py", "h5py", "vtk", f"'{path.suffix}' files")
        from flowborne.formats.vtkhdf_file import write_vtkhdf

        with replaced_whole(path) as new:
            write_vtkhdf(run, new)
