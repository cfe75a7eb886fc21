"""A run as one USD scene, by usd-core."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from flowborne.base.atomic import replaced_whole
from flowborne.base.extras import optional
from flowborne.formats.creature import Creature
from flowborne.formats.vdb import write_dye
from flowborne.runs.exporters import Written, provided
from flowborne.runs.open_run import OpenRun


@provided(".usd")
@provided(".usda")
@provided(".usdc")
@dataclass(frozen=True)
class ExporterUsd:
    """Skeleton, surfaces, flesh, forces, paths, camera and dye; see `usd_stage`.

    Dye is in separate files: swim.usd refers to swim_dye/swim_0000.vdb and so on.
    """

    def write(self, run: OpenRun, path: Path) -> Written:
        optional("pxr.Usd", "usd-core", "usd", f"'{path.suffix}' files")
        from flowborne.formats.usd_stage import write_stage

        creature, volumes = Creature(run), tuple[Path, ...]()
        if run.dyes:
            folder = path.with_name(f"{path.stem}_dye")
            folder.mkdir(exist_ok=True)
            volumes = write_dye(run, folder / f"{path.stem}.vdb")
        with replaced_whole(path) as new:
            write_stage(creature, new, [f"./{v.parent.name}/{v.name}" for v in volumes])
        return Written((path, *volumes))
