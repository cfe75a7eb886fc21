"""A run as one USD scene, by usd-core."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from flowborne.io.atomic import replaced_whole
from flowborne.io.exporters import EXPORTERS, Written
from flowborne.io.open_run import OpenRun
from flowborne.io.optional import optional


@EXPORTERS.register(".usd")
@EXPORTERS.register(".usda")
@EXPORTERS.register(".usdc")
@dataclass(frozen=True)
class ExporterUsd:
    """Skeleton, surfaces, flesh, forces, paths and camera, and dye beside; see `usd_stage`."""

    def write(self, run: OpenRun, path: Path) -> Written:
        optional("pxr.Usd", "usd-core", "usd", f"'{path.suffix}' files")
        from flowborne.formats.usd_stage import write_stage

        with replaced_whole(path) as new:
            write_stage(run, new)
        return Written((path,))
